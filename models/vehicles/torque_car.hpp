// Quarter car driven by a timetable of torque: one wheel under a quarter of a vehicle, with a motor that lags, a load that
// moves to the driven axle, and friction from a tyre or imposed (document 002, chapters 4 and 5).
//
//   T_m' = (T(t) - T_m) / tau                   T(t) piecewise linear; tau = 0: T_m = T
//   N = m (g + k v')                            k: height of the centre of gravity by wheelbase, > 0 when N grows with v'
//   m v' = mu N - R_aer(v)                      so  v' = (mu g - R_aer/m) / (1 - k mu)
//   J w' = T_m - mu N r - f_r N r sgn(w) - b w,   s' = v,   t' = 1             (eqs 3.11-3.15, 5.6; the parts' heads)
//
// mu is a tyre's mu(slip) on a surface, which may change at given times, a constant, or a constant that steps. Where it is
// imposed the wheel does not feel its slip: w integrates every difference of T and the grip's torque by 1/J, and nothing brings
// it back to rolling. State: w, v, s, T_m, t. Mode: how many points of the timetable, of the surfaces and of the friction's
// step are past; each is an event. T, the commanded torque, is what estimators are told. The available friction is the D of the
// surface; unknown (NaN) where mu is imposed. Range: forward driving on level ground.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "models/parts/pacejka.hpp"
#include "models/parts/quarter_car.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct TorqueCar {
  static constexpr std::string_view kName = "quarter_car";
  static constexpr int kStates = 5;
  static constexpr int kEvents = 1;
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 10> kTruth{{{"wheel_speed_radps", "rad/s"},
                                                    {"speed_mps", "m/s"},
                                                    {"friction", "1"},
                                                    {"a_x_mps2", "m/s^2"},
                                                    {"slip", "1"},
                                                    {"distance_m", "m"},
                                                    {"drive_torque_nm", "N m"},  // commanded, T
                                                    {"motor_torque_nm", "N m"},  // after the lag, T_m
                                                    {"normal_force_n", "N"},
                                                    {"available_friction", "1"}}};
  static constexpr std::array<Quantity, 1> kInputs{{{"drive_torque_nm", "N m"}}};
  using Mode = TimePoints::Mode;
  using State = Vector<double, kStates>;

  // The light vehicle of document 002, Table 3
  QuarterCar quarter{431.0, 2.1, 0.3, 0.015, 0.0, 1.225, 2.0, 0.45};
  std::vector<double> torque_time_s{0.0};
  std::vector<double> torque_nm{200.0};
  double motor_lag_s = 0.0;    // tau; T_m starts at 0
  double load_transfer = 0.0;  // k
  std::string friction = "tyre";
  std::string surface = "snow";        // of "tyre", at first
  std::vector<double> surface_time_s;  // when it changes,
  std::vector<std::string> surfaces;   // and to which
  double friction_constant = 0.15;     // of "constant"
  double friction_before = 0.1;        // of "step"
  double friction_after = 0.25;
  double step_time_s = 5.0;
  double initial_wheel_speed_radps = 1.0;  // rolling without slip
  double slip_speed_eps_mps = 0.01;        // v_eps of the regularised slip

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    QuarterCar::visit_parameters(p.quarter, v);
    v.list("torque_time_s", p.torque_time_s, non_negative());
    v.list("torque_nm", p.torque_nm, any_number());
    v.number("motor_lag_s", p.motor_lag_s, non_negative());
    v.number("load_transfer", p.load_transfer, between(-0.5, 0.5));
    v.choice("friction", p.friction, Choices{"tyre", "constant", "step"});
    v.choice("surface", p.surface, Choices{"dry", "wet", "snow", "ice"});
    v.list("surface_time_s", p.surface_time_s, non_negative());
    v.choices("surfaces", p.surfaces, Choices{"dry", "wet", "snow", "ice"});
    v.number("friction_constant", p.friction_constant, between(0.0, 1.2));
    v.number("friction_before", p.friction_before, between(0.0, 1.2));
    v.number("friction_after", p.friction_after, between(0.0, 1.2));
    v.number("step_time_s", p.step_time_s, non_negative());
    v.number("initial_wheel_speed_radps", p.initial_wheel_speed_radps, non_negative());
    v.number("slip_speed_eps_mps", p.slip_speed_eps_mps, positive());
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    require_timetable("torque_time_s", torque_time_s, "torque_nm", torque_nm);
    std::vector<double> points_s = torque_time_s;
    if (friction == "step") points_s.push_back(step_time_s);
    if (surfaces.size() != surface_time_s.size())
      throw Refusal("vehicle.surfaces: has " + std::to_string(surfaces.size()) + " values, expected " +
                    std::to_string(surface_time_s.size()) + ", one for each of vehicle.surface_time_s");
    for (std::size_t i = 1; i < surface_time_s.size(); ++i)
      if (!(surface_time_s[i] > surface_time_s[i - 1]))
        throw Refusal("vehicle.surface_time_s: expected increasing times, found " + std::to_string(surface_time_s[i]) +
                      " after " + std::to_string(surface_time_s[i - 1]));
    points_s.insert(points_s.end(), surface_time_s.begin(), surface_time_s.end());
    points_ = TimePoints(std::move(points_s));
    pieces_.clear();
    for (Mode mode = 0; mode < points_.modes(); ++mode) {
      const double from_s = points_.begin_s(mode);
      const double stepped = from_s < step_time_s ? friction_before : friction_after;
      pieces_.push_back({timetable_line(from_s, torque_time_s, torque_nm), friction == "step" ? stepped : friction_constant,
                         surface_at(from_s)});
    }
    has_tyre_ = friction == "tyre";
  }

  State initial_state() const {
    State x;
    x << initial_wheel_speed_radps, initial_wheel_speed_radps * quarter.wheel_radius_m, 0.0, 0.0, 0.0;
    return x;
  }
  Mode initial_mode() const { return points_.at_start(); }

  template <typename T>
  T commanded_torque(const T& t, const Mode& mode) const {
    return pieces_[mode].torque_nm.at(t);
  }
  template <typename T>
  T motor_torque(const Vector<T, kStates>& x, const Mode& mode) const {
    return motor_lag_s > 0.0 ? x[3] : commanded_torque(x[4], mode);
  }
  template <typename T>
  T slip(const Vector<T, kStates>& x) const {
    return longitudinal_slip(x[0], x[1], quarter.wheel_radius_m, slip_speed_eps_mps);
  }
  template <typename T>
  T friction_now(const Vector<T, kStates>& x, const Mode& mode) const {
    return has_tyre_ ? pieces_[mode].tyre.friction(slip(x)) : T(pieces_[mode].friction);
  }
  template <typename T>
  T acceleration(const T& mu, const T& v) const {
    return quarter.acceleration_mps2(mu, v) / (1.0 - load_transfer * mu);
  }
  // N / (m g)
  template <typename T>
  T load(const T& a_x) const {
    return 1.0 + (load_transfer / kGravity_mps2) * a_x;
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    const T& w = x[0];
    const T& v = x[1];
    const T mu = friction_now(x, mode), a_x = acceleration(mu, v), n = load(a_x);
    const T transferred_nm = (n - 1.0) * quarter.rolling_torque_nm(w);
    const T motor_nm = motor_torque(x, mode);
    Vector<T, kStates> rate;
    rate[0] = quarter.wheel_acceleration_radps2(T(motor_nm - transferred_nm), T(mu * n), w);
    rate[1] = a_x;
    rate[2] = v;
    rate[3] = motor_lag_s > 0.0 ? T((1.0 / motor_lag_s) * (commanded_torque(x[4], mode) - x[3])) : T(0.0);
    rate[4] = T(1.0);
    return rate;
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(points_.event(x[4], mode));
  }
  Mode after_event(int, const State&, Mode mode) const { return points_.after(mode); }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const { return {commanded_torque(x[4], mode)}; }

  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const double mu = friction_now(x, mode), a_x = acceleration(mu, x[1]);
    return {x[0],
            x[1],
            mu,
            a_x,
            slip(x),
            x[2],
            commanded_torque(x[4], mode),
            motor_torque(x, mode),
            quarter.normal_force_n() * load(a_x),
            has_tyre_ ? pieces_[mode].tyre.d : std::numeric_limits<double>::quiet_NaN()};
  }

 private:
  struct Piece {
    TimetableLine torque_nm;
    double friction;  // where it is imposed
    PacejkaTyre tyre;
  };

  // From t on.
  PacejkaTyre surface_at(double t) const {
    const auto past = std::upper_bound(surface_time_s.begin(), surface_time_s.end(), t) - surface_time_s.begin();
    const std::string& name = past == 0 ? surface : surfaces[static_cast<std::size_t>(past - 1)];
    for (const Surface& s : kSurfaces)
      if (s.name == name) return s.tyre;
    return {};
  }

  TimePoints points_;          // of torque and friction
  std::vector<Piece> pieces_;  // one per mode
  bool has_tyre_ = true;
};

static_assert(Vehicle<TorqueCar>);

}  // namespace slipstream
