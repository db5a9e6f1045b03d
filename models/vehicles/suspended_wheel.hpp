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

#include <vector>

#include "models/parts/dc_motor.hpp"
#include "models/parts/timetable.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct SuspendedWheel {
  static constexpr std::string_view kName = "suspended_wheel";
  static constexpr int kStates = 2;
  static constexpr int kEvents = 1;
  static constexpr std::array<std::string_view, kStates> kStateNames{"wheel_speed_radps", ""};
  static constexpr std::array<Crossing, kEvents> kCrossings{Crossing::kRising};
  static constexpr std::array<Quantity, 3> kTruth{
      {{"wheel_speed_radps", "rad/s"}, {"motor_current_a", "A"}, {"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, 1> kInputs{{{"drive_torque_nm", "N m"}}};
  using Mode = TimePoints::Mode;
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

  // Derived from the parameters; call once after they are set. Refuses lists that do not fit together.
  void prepare() {
    require_timetable("current_time_s", current_time_s, "current_a", current_a);
    points_ = TimePoints(current_time_s);
    lines_.clear();
    for (Mode mode = 0; mode < points_.modes(); ++mode)
      lines_.push_back(timetable_line(points_.begin_s(mode), current_time_s, current_a));
  }

  State initial_state() const { return {initial_wheel_speed_radps, 0.0}; }
  Mode initial_mode() const { return points_.at_start(); }

  template <typename T>
  T current(const T& t, const Mode& mode) const {
    return lines_[mode].at(t);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    const T torque = motor.wheel_torque_nm(current(x[1], mode));
    return {(1.0 / wheel_inertia_kgm2) * (torque - viscous_friction_nms * x[0]), T(1.0)};
  }

  Vector<double, kEvents> events(const State& x, const Mode& mode) const {
    return Vector<double, kEvents>(points_.event(x[1], mode));
  }
  Mode after_event(int, const State&, Mode mode) const { return points_.after(mode); }

  std::array<double, kInputs.size()> inputs(const State& x, const Mode& mode) const {
    return {motor.wheel_torque_nm(current(x[1], mode))};
  }
  std::array<double, kTruth.size()> truth(const State& x, const Mode& mode) const {
    const double i = current(x[1], mode);
    return {x[0], i, motor.wheel_torque_nm(i)};
  }

 private:
  TimePoints points_;
  std::vector<TimetableLine> lines_;  // one per mode
};

static_assert(Vehicle<SuspendedWheel>);

}  // namespace slipstream
