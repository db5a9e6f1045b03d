// Two-track: a car on four nonlinear tyres with combined slip, roll and pitch, on a level road whose friction may change.
//
//   v_x' = a_x + w_z v_y,   v_y' = a_y - w_z v_x,   a_x, a_y and w_z' of parts/four_wheels.hpp
//   I_x phi'' = m h a_y + m g h phi - K phi - c_x phi',   I_y theta'' = -m h a_x - K_p theta - c_y theta'
//   psi' = w_z,   X' = v_x cos psi - v_y sin psi,   Y' = v_x sin psi + v_y cos psi,   t' = 1
//   lambda = phi + c_x phi' / K,   P = (K_p theta + c_y theta') / L,   demanded: m (v_ref' + gain (v_ref - v_x))
//
// State: v_x, v_y, w_z, psi, X, Y, phi, phi', theta, theta', t. mu(t), delta(t) and v_ref(t) are timetables: every point is an
// event, and the mode counts those that are past. The driver holds v_ref as far as the tyres let him.
//
// a_x and a_y are what accelerometers on the tilted body read: a_x cos theta - g sin theta, a_y cos phi + g sin phi. The wheel
// speed is v_x / r, of a wheel that rolls. Milliken and Milliken, Race Car Vehicle Dynamics, ch. 5; Pacejka, Tyre and Vehicle
// Dynamics, ch. 1. Range: forward driving with all wheels on the ground; angles of the body small. psi is not wrapped.
#pragma once

#include <utility>
#include <vector>

#include "models/parts/four_wheels.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct TwoTrack {
  static constexpr std::string_view kName = "two_track";
  static constexpr int kStates = 11;
  static constexpr int kEvents = 1;
  static constexpr std::array<std::string_view, kStates> kStateNames{
      "forward_speed_mps", "lateral_speed_mps", "yaw_rate_radps", "heading_rad",      "x_m", "y_m",
      "roll_rad",          "roll_rate_radps",   "pitch_rad",      "pitch_rate_radps", ""};
  static constexpr std::array<bool, kStates> kIgnorable{false, false, false, false, true, true,
                                                        false, false, false, false, false};
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 21> kTruth{{{"forward_speed_mps", "m/s"},
                                                    {"lateral_speed_mps", "m/s"},
                                                    {"yaw_rate_radps", "rad/s"},
                                                    {"heading_rad", "rad"},
                                                    {"x_m", "m"},
                                                    {"y_m", "m"},
                                                    {"roll_rad", "rad"},
                                                    {"roll_rate_radps", "rad/s"},
                                                    {"pitch_rad", "rad"},
                                                    {"pitch_rate_radps", "rad/s"},
                                                    {"a_x_mps2", "m/s^2"},
                                                    {"a_y_mps2", "m/s^2"},
                                                    {"wheel_speed_radps", "rad/s"},
                                                    {"steering_angle_rad", "rad"},
                                                    {"sideslip_rad", "rad"},
                                                    {"front_cornering_prad", "1/rad"},
                                                    {"rear_cornering_prad", "1/rad"},
                                                    {"friction", "1"},
                                                    {"front_stiffness_npr", "N/rad"},  // of the axle at its static load
                                                    {"rear_stiffness_npr", "N/rad"},
                                                    {"friction_used", "1"}}};  // the force in the plane by mu m g
  static constexpr std::array<Quantity, 1> kInputs{{{"steering_angle_rad", "rad"}}};
  using Mode = TimePoints::Mode;
  using State = Vector<double, kStates>;

  FourWheels car;
  double front_cornering_prad = 5.0;  // k of the front tyres
  double rear_cornering_prad = 5.7;
  double roll_inertia_kgm2 = 0.01;   // I_x
  double pitch_inertia_kgm2 = 0.03;  // I_y
  double roll_damping_nms = 0.5;     // c_x
  double pitch_damping_nms = 1.5;    // c_y
  double speed_gain_hz = 3.0;        // of the driver
  std::vector<double> friction_time_s{0.0};
  std::vector<double> friction{0.8};
  std::vector<double> steering_time_s{1.0, 2.0};  // pulls away and turns left
  std::vector<double> steering_rad{0.0, 0.1};
  std::vector<double> speed_time_s{0.0, 1.5};
  std::vector<double> speed_mps{0.5, 1.5};
  double initial_heading_rad = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    FourWheels::visit_parameters(p.car, v);
    v.number("front_cornering_prad", p.front_cornering_prad, positive());
    v.number("rear_cornering_prad", p.rear_cornering_prad, positive());
    v.number("roll_inertia_kgm2", p.roll_inertia_kgm2, positive());
    v.number("pitch_inertia_kgm2", p.pitch_inertia_kgm2, positive());
    v.number("roll_damping_nms", p.roll_damping_nms, non_negative());
    v.number("pitch_damping_nms", p.pitch_damping_nms, non_negative());
    v.number("speed_gain_hz", p.speed_gain_hz, non_negative());
    v.list("friction_time_s", p.friction_time_s, non_negative());
    v.list("friction", p.friction, positive());
    v.list("steering_time_s", p.steering_time_s, non_negative());
    v.list("steering_rad", p.steering_rad, between(-0.5 * kPi, 0.5 * kPi));
    v.list("speed_time_s", p.speed_time_s, non_negative());
    v.list("speed_mps", p.speed_mps, non_negative());
    v.number("initial_heading_rad", p.initial_heading_rad, any_number());
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together, and a body that falls
  // over.
  void prepare() {
    require_timetable("friction_time_s", friction_time_s, "friction", friction);
    require_timetable("steering_time_s", steering_time_s, "steering_rad", steering_rad);
    require_timetable("speed_time_s", speed_time_s, "speed_mps", speed_mps);
    car.chassis.require_upright();
    std::vector<double> points_s = steering_time_s;
    points_s.insert(points_s.end(), speed_time_s.begin(), speed_time_s.end());
    points_s.insert(points_s.end(), friction_time_s.begin(), friction_time_s.end());
    points_ = TimePoints(std::move(points_s));
    steering_.clear();
    speed_.clear();
    friction_.clear();
    for (Mode mode = 0; mode < points_.modes(); ++mode) {
      steering_.push_back(timetable_line(points_.begin_s(mode), steering_time_s, steering_rad));
      speed_.push_back(timetable_line(points_.begin_s(mode), speed_time_s, speed_mps));
      friction_.push_back(timetable_line(points_.begin_s(mode), friction_time_s, friction));
    }
  }

  // Straight ahead at the first speed.
  State initial_state() const {
    State x = State::Zero();
    x[0] = speed_mps.front();
    x[3] = initial_heading_rad;
    return x;
  }
  Mode initial_mode() const { return points_.at_start(); }

  template <typename T>
  std::array<FourWheels::Wheel<T>, 4> wheels(const Vector<T, kStates>& x, Mode mode) const {
    const Chassis& c = car.chassis;
    const T delta = steering_[mode].at(x[10]), mu = friction_[mode].at(x[10]);
    const T demand_n = c.mass_kg * (speed_[mode].rate + speed_gain_hz * (speed_[mode].at(x[10]) - x[0]));
    const T lean_rad = x[6] + (roll_damping_nms / c.roll_stiffness_nmprad()) * x[7];
    const T to_front_n = (c.pitch_stiffness_nmprad * x[8] + pitch_damping_nms * x[9]) * (1.0 / c.wheelbase_m());
    return car.wheels<T, T>({x[0], x[1], x[2], delta, lean_rad, to_front_n, demand_n},
                            {T(front_cornering_prad), T(rear_cornering_prad)}, {mu, mu});
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::cos, std::sin;
    const T &v_x = x[0], &v_y = x[1], &w_z = x[2];
    const Chassis& b = car.chassis;
    const auto a = car.accelerations(wheels(x, mode));
    const double mh = b.mass_kg * b.cg_height_m;
    const T c = cos(x[3]), s = sin(x[3]);
    Vector<T, kStates> rate;
    rate << a.forward_mps2 + w_z * v_y, a.lateral_mps2 - w_z * v_x, a.yaw_radps2, w_z, v_x * c - v_y * s, v_x * s + v_y * c,
        x[7],
        (mh * a.lateral_mps2 - b.net_roll_stiffness_nmprad() * x[6] - roll_damping_nms * x[7]) * (1.0 / roll_inertia_kgm2),
        x[9], (-mh * a.forward_mps2 - b.pitch_stiffness_nmprad * x[8] - pitch_damping_nms * x[9]) * (1.0 / pitch_inertia_kgm2),
        T(1.0);
    return rate;
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(points_.event(x[10], mode));
  }
  Mode after_event(int, const State&, Mode mode) const { return points_.after(mode); }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const { return {steering_[mode].at(x[10])}; }

  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const auto a = car.accelerations(wheels(x, mode));
    const double mu = friction_[mode].at(x[10]);
    return {x[0],
            x[1],
            x[2],
            x[3],
            x[4],
            x[5],
            x[6],
            x[7],
            x[8],
            x[9],
            a.forward_mps2 * std::cos(x[8]) - kGravity_mps2 * std::sin(x[8]),
            a.lateral_mps2 * std::cos(x[6]) + kGravity_mps2 * std::sin(x[6]),
            x[0] / car.chassis.wheel_radius_m,
            steering_[mode].at(x[10]),
            std::atan2(x[1], x[0]),
            front_cornering_prad,
            rear_cornering_prad,
            mu,
            front_cornering_prad * car.chassis.front_load_n(),
            rear_cornering_prad * car.chassis.rear_load_n(),
            std::hypot(a.forward_mps2, a.lateral_mps2) / (mu * kGravity_mps2)};
  }

 private:
  TimePoints points_;                                       // of all timetables
  std::vector<TimetableLine> steering_, speed_, friction_;  // one per mode
};

static_assert(Vehicle<TwoTrack>);

}  // namespace slipstream
