// A scale car on a stand: its motor turns a wheel that touches nothing (document 002, section 5.1).
//
//   J w' = k_m i(t) - b w                                            (eq. 5.1)
//   i(t): straight lines through the points (current_time_s, current_a), constant before the first and after the last one;
//         two points at one time are a step
//
// State: wheel speed w, time t (t' = 1, so that the current is a function of the state). Mode: between which points.
// Event: the time of the next point, so that no integration step crosses a kink. Range: any speed, no dry friction.
//
// The document prints J, b and the wheel's radius (Table 5), but neither k_m nor the current's values: Figure 16 has no
// readable scale. k_m and the current are ours; scenarios/stand.toml says where they are from.
#pragma once

#include <string>
#include <vector>

#include "common/refusal.hpp"
#include "models/parts/dc_motor.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct SuspendedWheel {
  static constexpr std::string_view kName = "suspended_wheel";
  static constexpr int kStates = 2;
  static constexpr int kEvents = 1;
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 3> kTruth{
      {{"wheel_speed_radps", "rad/s"}, {"motor_current_a", "A"}, {"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, 1> kInputs{{{"drive_torque_nm", "N m"}}};
  struct Mode {
    std::size_t passed = 0;  // points whose time is over
  };
  using State = Vector<double, kStates>;

  double wheel_inertia_kgm2 = 3.2e-3;  // document 002, Table 5
  double viscous_friction_nms = 0.01;
  double wheel_radius_m = 0.033;
  DcMotor motor;
  std::vector<double> current_time_s{1.0, 1.02};
  std::vector<double> current_a{0.0, 10.0};
  double initial_wheel_speed_radps = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("wheel_inertia_kgm2", p.wheel_inertia_kgm2, positive());
    v.number("viscous_friction_nms", p.viscous_friction_nms, non_negative());
    v.number("wheel_radius_m", p.wheel_radius_m, positive());
    DcMotor::visit_parameters(p.motor, v);
    v.list("current_time_s", p.current_time_s, non_negative());
    v.list("current_a", p.current_a, any_number());
    v.number("initial_wheel_speed_radps", p.initial_wheel_speed_radps, any_number());
  }

  // Call once after the parameters are set. Refuses lists that do not fit together.
  void prepare() const {
    if (current_a.size() != current_time_s.size())
      throw Refusal("vehicle.current_a: has " + std::to_string(current_a.size()) + " values, expected " +
                    std::to_string(current_time_s.size()) + ", one for each of vehicle.current_time_s");
    if (current_a.empty()) throw Refusal("vehicle.current_a: has no values, expected at least 1");
    for (std::size_t i = 1; i < current_time_s.size(); ++i)
      if (current_time_s[i] < current_time_s[i - 1])
        throw Refusal("vehicle.current_time_s: expected times that do not decrease, found " +
                      std::to_string(current_time_s[i]) + " after " + std::to_string(current_time_s[i - 1]));
  }

  State initial_state() const { return {initial_wheel_speed_radps, 0.0}; }
  Mode initial_mode() const { return past(0.0, {}); }

  template <typename T>
  T current(const T& t, const Mode& mode) const {
    if (mode.passed == 0) return T(current_a.front());
    if (mode.passed >= current_a.size()) return T(current_a.back());
    const std::size_t from = mode.passed - 1, to = mode.passed;
    const double slope = (current_a[to] - current_a[from]) / (current_time_s[to] - current_time_s[from]);
    return current_a[from] + slope * (t - current_time_s[from]);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    const T torque = motor.wheel_torque_nm(current(x[1], mode));
    return {(1.0 / wheel_inertia_kgm2) * (torque - viscous_friction_nms * x[0]), T(1.0)};
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(mode.passed < current_time_s.size() ? x[1] - current_time_s[mode.passed] : -1.0);
  }
  Mode after_event(int, const State&, Mode mode) const {
    if (mode.passed == current_time_s.size()) return mode;
    return past(current_time_s[mode.passed], mode);  // the point's own time: the root found for it is off by a rounding
  }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const {
    return {motor.wheel_torque_nm(current(x[1], mode))};
  }
  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const double i = current(x[1], mode);
    return {x[0], i, motor.wheel_torque_nm(i)};
  }

 private:
  // All points up to t are over: both of a step at once.
  Mode past(double t, Mode mode) const {
    while (mode.passed < current_time_s.size() && current_time_s[mode.passed] <= t) ++mode.passed;
    return mode;
  }
};

static_assert(Vehicle<SuspendedWheel>);

}  // namespace slipstream
