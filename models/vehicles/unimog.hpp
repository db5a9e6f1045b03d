// Unimog pulling away: engine, eight-speed gearbox with automatic upshift, differential, one driven wheel with a quarter
// of the vehicle on it (document 002, chapter 7).
//
//   T  = demand * T_m(w_m) * eta_t i_cx i_dif / 4,   w_m = max(w i_cx i_dif, w_idle)       (eqs 7.3-7.10)
//   T  = -T_b sgn w while it brakes, with the clutch open;   J w' = T - mu(l) N r - T_rol,   N = m g cos a
//   m v' = mu(l) N - R_aer - m g sin a,   s' = v                                          (eqs 3.11-3.15, l of eq. 3.1)
//
// State: wheel speed w, vehicle speed v, distance s. Mode: the gear, whether the clutch slips at idle, whether it brakes, the
// stretch of road. Events: upshift when the engine reaches the shift speed from below; the clutch closes or opens at idle
// speed; the brake is pressed when v reaches brake_from_mps (0: never) and let go at brake_until_mps, in the lowest gear from
// the initial one up whose engine is then below the shift speed; the kinks of the grade tan a, which is linear in s between its
// points. The document's road is level and its drive has no brake. a_x is the specific force along the road that an
// accelerometer feels, v' + g sin a: on the level v'. Range: forward driving. At low speed the tyre-wheel mode is stiff, about
// -8800/v per second.
//
// What the document leaves open was found by search against its Figure 40 and Table 14: start in third gear, upshift at
// rated speed, 40 % demand with a quarter of the torque at each wheel, start at 0.5 rad/s without slip, engine points as below.
// The points are 160 kW at 2200 rpm and about the 810 Nm that Figure 40's peak implies; a public data sheet for exactly this
// rating could not be confirmed.
#pragma once

#include <string>
#include <vector>

#include "common/refusal.hpp"
#include "models/parts/driveline.hpp"
#include "models/parts/engine.hpp"
#include "models/parts/pacejka.hpp"
#include "models/parts/quarter_car.hpp"
#include "models/parts/smooth_profile.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct Unimog {
  static constexpr std::string_view kName = "unimog";
  static constexpr int kStates = 3;
  static constexpr int kEvents = 4;
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising, Crossing::kBoth, Crossing::kRising,
                                                            Crossing::kRising};
  static constexpr std::array<Quantity, 12> kTruth{{{"wheel_speed_radps", "rad/s"},
                                                    {"speed_mps", "m/s"},
                                                    {"friction", "1"},
                                                    {"a_x_mps2", "m/s^2"},
                                                    {"slip", "1"},
                                                    {"distance_m", "m"},
                                                    {"drive_torque_nm", "N m"},
                                                    {"engine_speed_radps", "rad/s"},
                                                    {"engine_torque_nm", "N m"},
                                                    {"gear", "1"},
                                                    {"grade", "1"},
                                                    {"mass_kg", "kg"}}};
  static constexpr std::array<Quantity, 1> kInputs{{{"drive_torque_nm", "N m"}}};
  struct Mode {
    int gear = 1;
    bool idling = false;  // clutch slips, engine held at idle speed
    bool braking = false;
    TimePoints::Mode road = 0;  // points of the grade that are behind
  };
  using State = Vector<double, kStates>;

  QuarterCar quarter;
  Driveline driveline;
  std::string surface = "dry";
  std::string engine = "quintic";
  std::vector<double> engine_speed_rpm{800, 1000, 1200, 1400, 1600, 1800, 2000, 2200};
  std::vector<double> engine_torque_nm{510, 640, 745, 803, 808, 775, 734, 694.5};
  double rated_power_w = 160e3;
  double rated_speed_rpm = 2200.0;
  double idle_speed_rpm = 800.0;
  double shift_speed_rpm = 2200.0;
  double demand = 0.4;
  double torque_share = 0.25;  // of the driveline's torque at this wheel
  double initial_gear = 3;
  double initial_wheel_speed_radps = 0.5;
  double slip_speed_eps_mps = 0.01;  // v_eps of the regularised slip
  std::vector<double> grade_at_m{0.0};
  std::vector<double> grade{0.0};  // tan a
  double brake_torque_nm = 4000.0;
  double brake_from_mps = 0.0;
  double brake_until_mps = 2.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    QuarterCar::visit_parameters(p.quarter, v);
    v.choice("surface", p.surface, Choices{"dry", "wet", "snow", "ice"});
    v.choice("engine", p.engine, Choices{"quintic", "quadratic"});
    v.list("engine_speed_rpm", p.engine_speed_rpm, positive());
    v.list("engine_torque_nm", p.engine_torque_nm, any_number());
    v.number("rated_power_w", p.rated_power_w, positive());
    v.number("rated_speed_rpm", p.rated_speed_rpm, positive());
    v.number("idle_speed_rpm", p.idle_speed_rpm, positive());
    v.number("shift_speed_rpm", p.shift_speed_rpm, positive());
    v.list("gear_ratio", p.driveline.gear_ratio, positive());
    v.number("final_drive", p.driveline.final_drive, positive());
    v.number("efficiency", p.driveline.efficiency, between(0.0, 1.0));
    v.number("demand", p.demand, between(0.0, 1.0));
    v.number("torque_share", p.torque_share, between(0.0, 1.0));
    v.number("initial_gear", p.initial_gear, between(1.0, 32.0));
    v.number("initial_wheel_speed_radps", p.initial_wheel_speed_radps, non_negative());
    v.number("slip_speed_eps_mps", p.slip_speed_eps_mps, positive());
    v.list("grade_at_m", p.grade_at_m, non_negative());
    v.list("grade", p.grade, between(-0.5, 0.5));
    v.number("brake_torque_nm", p.brake_torque_nm, positive());
    v.number("brake_from_mps", p.brake_from_mps, non_negative());
    v.number("brake_until_mps", p.brake_until_mps, positive());
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    if (engine_speed_rpm.size() != engine_torque_nm.size())
      throw Refusal("vehicle.engine_torque_nm: has " + std::to_string(engine_torque_nm.size()) + " values, expected " +
                    std::to_string(engine_speed_rpm.size()) + ", one for each of vehicle.engine_speed_rpm");
    if (engine_speed_rpm.size() <= EngineCurve::kDegree)
      throw Refusal("vehicle.engine_speed_rpm: has " + std::to_string(engine_speed_rpm.size()) +
                    " values, expected at least 6 for a quintic");
    for (std::size_t i = 1; i < engine_speed_rpm.size(); ++i)
      if (engine_speed_rpm[i] <= engine_speed_rpm[i - 1])
        throw Refusal("vehicle.engine_speed_rpm: expected increasing values, found " + std::to_string(engine_speed_rpm[i]) +
                      " after " + std::to_string(engine_speed_rpm[i - 1]));
    if (initial_gear != static_cast<int>(initial_gear) || initial_gear > driveline.gears())
      throw Refusal("vehicle.initial_gear: expected a whole number from 1 to " + std::to_string(driveline.gears()));
    if (shift_speed_rpm <= idle_speed_rpm)
      throw Refusal("vehicle.shift_speed_rpm: found " + std::to_string(shift_speed_rpm) +
                    ", expected more than idle_speed_rpm");
    if (initial_gear < driveline.gears() &&
        driveline.engine_speed_radps(initial_wheel_speed_radps, static_cast<int>(initial_gear)) >=
            shift_speed_rpm * kRadpsPerRpm)
      throw Refusal("vehicle.initial_wheel_speed_radps: turns the engine beyond shift_speed_rpm in the initial gear");
    if (brake_from_mps > 0.0 && brake_until_mps >= brake_from_mps)
      throw Refusal("vehicle.brake_until_mps: found " + std::to_string(brake_until_mps) +
                    ", expected less than brake_from_mps");
    if (grade.empty()) throw Refusal("vehicle.grade: is empty, expected at least one number");
    require_profile("grade_at_m", grade_at_m, "grade", grade);
    points_ = TimePoints(grade_at_m);
    slopes_.clear();
    for (TimePoints::Mode mode = 0; mode < points_.modes(); ++mode)
      slopes_.push_back(timetable_line(points_.begin_s(mode), grade_at_m, grade));
    curve_ = engine == "quadratic" ? quadratic_curve(rated_power_w, rated_speed_rpm * kRadpsPerRpm)
                                   : quintic_curve(engine_speed_rpm, engine_torque_nm);
    for (const Surface& s : kSurfaces)
      if (s.name == surface) tyre_ = s.tyre;
  }

  State initial_state() const { return {initial_wheel_speed_radps, initial_wheel_speed_radps * quarter.wheel_radius_m, 0.0}; }
  Mode initial_mode() const {
    const int gear = static_cast<int>(initial_gear);
    return {gear, driveline.engine_speed_radps(initial_wheel_speed_radps, gear) < idle_speed_rpm * kRadpsPerRpm, false,
            points_.at_start()};
  }

  template <typename T>
  T engine_speed_radps(const T& wheel_speed_radps, const Mode& mode) const {
    if (mode.idling) return T(idle_speed_rpm * kRadpsPerRpm);
    return driveline.engine_speed_radps(wheel_speed_radps, mode.gear);
  }
  template <typename T>
  T engine_torque(const T& wheel_speed_radps, const Mode& mode) const {
    if (mode.braking) return T(0.0);
    return demand * curve_.torque_nm(engine_speed_radps(wheel_speed_radps, mode));
  }
  template <typename T>
  T wheel_torque(const T& wheel_speed_radps, const Mode& mode) const {
    if (mode.braking) return -brake_torque_nm * QuarterCar::direction(wheel_speed_radps);
    return torque_share * driveline.wheel_torque_nm(engine_torque(wheel_speed_radps, mode), mode.gear);
  }
  template <typename T>
  T slip(const T& wheel_speed_radps, const T& speed_mps) const {
    return longitudinal_slip(wheel_speed_radps, speed_mps, quarter.wheel_radius_m, slip_speed_eps_mps);
  }

  // tan a
  template <typename T>
  T grade_at(const T& distance_m, const Mode& mode) const {
    return slopes_[mode.road].at(distance_m);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::sqrt;
    const T& w = x[0];
    const T& v = x[1];
    const T q = grade_at(x[2], mode), cosine = 1.0 / sqrt(1.0 + q * q);
    const T felt = tyre_.friction(slip(w, v)) * cosine;                  // F_x / (m g)
    const T lighter_nm = (1.0 - cosine) * quarter.rolling_torque_nm(w);  // rolling resistance that the slope takes off
    return {quarter.wheel_acceleration_radps2(T(wheel_torque(w, mode) + lighter_nm), felt, w),
            quarter.acceleration_mps2(felt, v) - kGravity_mps2 * (q * cosine), v};
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    const double engine_radps = driveline.engine_speed_radps(x[0], mode.gear);
    const double to_shift = engine_radps - shift_speed_rpm * kRadpsPerRpm;
    const double to_brake = brake_from_mps == 0.0 ? -1.0 : mode.braking ? brake_until_mps - x[1] : x[1] - brake_from_mps;
    return {mode.gear < driveline.gears() && !mode.braking ? to_shift : -1.0, engine_radps - idle_speed_rpm * kRadpsPerRpm,
            to_brake, points_.event(x[2], mode.road)};
  }
  Mode after_event(int event, const State& x, Mode mode) const {
    const auto is_slow = [&](double rpm) { return driveline.engine_speed_radps(x[0], mode.gear) < rpm * kRadpsPerRpm; };
    if (event == 0) {
      ++mode.gear;
      mode.idling = is_slow(idle_speed_rpm);
    } else if (event == 1) {
      mode.idling = !mode.idling;
    } else if (event == 2) {
      mode.braking = !mode.braking;
      if (!mode.braking)
        for (mode.gear = static_cast<int>(initial_gear); mode.gear < driveline.gears() && !is_slow(shift_speed_rpm);)
          ++mode.gear;
      mode.idling = is_slow(idle_speed_rpm);
    } else {
      mode.road = points_.after(mode.road);
    }
    return mode;
  }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const { return {wheel_torque(x[0], mode)}; }

  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const double l = slip(x[0], x[1]);
    const double mu = tyre_.friction(l), q = grade_at(x[2], mode);
    return {x[0],
            x[1],
            mu,
            quarter.acceleration_mps2(mu / std::sqrt(1.0 + q * q), x[1]),
            l,
            x[2],
            wheel_torque(x[0], mode),
            engine_speed_radps(x[0], mode),
            engine_torque(x[0], mode),
            static_cast<double>(mode.gear),
            q,
            quarter.mass_kg};
  }

  const EngineCurve& curve() const { return curve_; }
  const PacejkaTyre& tyre() const { return tyre_; }

 private:
  EngineCurve curve_;
  PacejkaTyre tyre_;
  TimePoints points_{{0.0}};  // of the grade
  std::vector<TimetableLine> slopes_{{}, {}};
};

static_assert(Vehicle<Unimog>);

}  // namespace slipstream
