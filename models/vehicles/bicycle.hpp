// Bicycle: the linear single-track model with constant cornering stiffnesses, on level ground, driven by a timetable.
//
//   v_y' = a_y - w_z v_x,   w_z' as in parts/single_track.hpp,   psi' = w_z                       (document 002, eqs 3.16, 6.1)
//   X' = v_x cos psi - v_y sin psi,   Y' = v_x sin psi + v_y cos psi,   t' = 1
//
// State: v_y, w_z, psi, X, Y, t. The speed v_x(t) is prescribed, there are no longitudinal dynamics, and the wheel rolls: v_x =
// r w. Mode: how many points of the timetables are past; each is an event. Steering and speed are linear between their points,
// constant before the first and after the last. psi is not wrapped: three laps to the left end at 6 pi. The run starts at X = Y
// = 0.
#pragma once

#include <utility>
#include <vector>

#include "models/parts/single_track.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct Bicycle {
  static constexpr std::string_view kName = "bicycle";
  static constexpr int kStates = 6;
  static constexpr int kEvents = 1;
  static constexpr std::array<std::string_view, kStates> kStateNames{
      "lateral_speed_mps", "yaw_rate_radps", "heading_rad", "x_m", "y_m", ""};
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 11> kTruth{{{"lateral_speed_mps", "m/s"},
                                                    {"yaw_rate_radps", "rad/s"},
                                                    {"heading_rad", "rad"},
                                                    {"x_m", "m"},
                                                    {"y_m", "m"},
                                                    {"front_stiffness_npr", "N/rad"},
                                                    {"rear_stiffness_npr", "N/rad"},
                                                    {"a_y_mps2", "m/s^2"},
                                                    {"speed_mps", "m/s"},
                                                    {"wheel_speed_radps", "rad/s"},
                                                    {"steering_angle_rad", "rad"}}};
  static constexpr std::array<Quantity, 1> kInputs{{{"steering_angle_rad", "rad"}}};
  using Mode = TimePoints::Mode;
  using State = Vector<double, kStates>;

  SingleTrack track;
  double front_stiffness_npr = 4.0;               // C_1, N/rad
  double rear_stiffness_npr = 4.0;                // C_2
  std::vector<double> steering_time_s{1.0, 2.0};  // pulls away and turns left
  std::vector<double> steering_rad{0.0, 0.2};
  std::vector<double> speed_time_s{0.0, 1.5};
  std::vector<double> speed_mps{0.0, 0.5};
  double initial_lateral_speed_mps = 0.0;
  double initial_yaw_rate_radps = 0.0;
  double initial_heading_rad = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    SingleTrack::visit_parameters(p.track, v);
    v.number("front_stiffness_npr", p.front_stiffness_npr, positive());
    v.number("rear_stiffness_npr", p.rear_stiffness_npr, positive());
    v.list("steering_time_s", p.steering_time_s, non_negative());
    v.list("steering_rad", p.steering_rad, any_number());
    v.list("speed_time_s", p.speed_time_s, non_negative());
    v.list("speed_mps", p.speed_mps, any_number());
    v.number("initial_lateral_speed_mps", p.initial_lateral_speed_mps, any_number());
    v.number("initial_yaw_rate_radps", p.initial_yaw_rate_radps, any_number());
    v.number("initial_heading_rad", p.initial_heading_rad, any_number());
  }

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    require_timetable("steering_time_s", steering_time_s, "steering_rad", steering_rad);
    require_timetable("speed_time_s", speed_time_s, "speed_mps", speed_mps);
    std::vector<double> points_s = steering_time_s;
    points_s.insert(points_s.end(), speed_time_s.begin(), speed_time_s.end());
    points_ = TimePoints(std::move(points_s));
    steering_.clear();
    speed_.clear();
    for (Mode mode = 0; mode < points_.modes(); ++mode) {
      steering_.push_back(timetable_line(points_.begin_s(mode), steering_time_s, steering_rad));
      speed_.push_back(timetable_line(points_.begin_s(mode), speed_time_s, speed_mps));
    }
  }

  State initial_state() const {
    State x;
    x << initial_lateral_speed_mps, initial_yaw_rate_radps, initial_heading_rad, 0.0, 0.0, 0.0;
    return x;
  }
  Mode initial_mode() const { return points_.at_start(); }

  template <typename T>
  T steering(const T& t, Mode mode) const {
    return steering_[mode].at(t);
  }
  template <typename T>
  T speed(const T& t, Mode mode) const {
    return speed_[mode].at(t);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::cos, std::sin;
    const T &v_y = x[0], &w_z = x[1], &psi = x[2];
    const T v_x = speed(x[5], mode);
    const auto a = track.accelerations(v_y, w_z, v_x, steering(x[5], mode), front_stiffness_npr, rear_stiffness_npr);
    const T c = cos(psi), s = sin(psi);
    Vector<T, kStates> rate;
    rate << a.lateral_mps2 - w_z * v_x, a.yaw_radps2, w_z, v_x * c - v_y * s, v_x * s + v_y * c, T(1.0);
    return rate;
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(points_.event(x[5], mode));
  }
  Mode after_event(int, const State&, Mode mode) const { return points_.after(mode); }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const { return {steering(x[5], mode)}; }

  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const double v_x = speed(x[5], mode), delta = steering(x[5], mode);
    const auto a = track.accelerations(x[0], x[1], v_x, delta, front_stiffness_npr, rear_stiffness_npr);
    return {
        x[0], x[1], x[2], x[3], x[4], front_stiffness_npr, rear_stiffness_npr, a.lateral_mps2, v_x, v_x / track.wheel_radius_m,
        delta};
  }

 private:
  TimePoints points_;                            // of both timetables
  std::vector<TimetableLine> steering_, speed_;  // one per mode
};

static_assert(Vehicle<Bicycle>);

}  // namespace slipstream
