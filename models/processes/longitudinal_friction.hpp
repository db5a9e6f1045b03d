// Wheel, vehicle and friction without a tyre model: the friction coefficient is a state that only process noise moves.
//
//   w' = (T - b w - (mu + f_r sgn w) m g r) / J,   v' = mu g - R_aer(v)/m + k (r w - v),   mu' = 0
//   z = (w, a_x),   a_x = mu g - R_aer(v)/m
//
// Document 002, eq. 7.12, with b of eq. 5.3. Three terms are ours: the drag R_aer (`drag = false` leaves it out, as the
// document does); sgn, a cubic around standstill (parts/driven_wheel.hpp); and k,
// rolling_rate_hz, the belief that in the long run the wheel rolls. With k = 0 (eq. 7.12) nothing ties v to a measurement: it
// is the integral of a_x from the start, and its uncertainty grows with time. Input: T, the torque at this wheel.
#pragma once

#include "models/parts/driven_wheel.hpp"
#include "models/process.hpp"

namespace slipstream {

struct LongitudinalFriction {
  static constexpr std::string_view kName = "longitudinal_friction";
  static constexpr int kStates = 3;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"wheel_speed_radps", "rad/s"}, {"speed_mps", "m/s"}, {"friction", "1"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  static constexpr bool kInputsOfAnyScalar = true;
  static constexpr std::array<bool, kStates> kLinear{false, false, true};
  static constexpr std::array<bool, kStates> kConstant{false, false, true};

  DrivenWheel wheel;
  bool drag = true;
  double rolling_rate_hz = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    DrivenWheel::visit_parameters(p.wheel, v);
    v.flag("drag", p.drag);
    v.number("rolling_rate_hz", p.rolling_rate_hz, non_negative());
  }

  template <typename T>
  T acceleration(const T& mu, const T& v) const {
    return drag ? wheel.quarter.acceleration_mps2(mu, v) : kGravity_mps2 * mu;
  }

  template <typename T, typename U>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<U, kInputs>& u) const {
    const T& w = x[0];
    const T& v = x[1];
    const T& mu = x[2];
    T v_dot = acceleration(mu, v);
    if (rolling_rate_hz > 0.0) v_dot = v_dot + rolling_rate_hz * (wheel.quarter.wheel_radius_m * w - v);
    return {wheel.acceleration_radps2(u[0], w, mu), v_dot, T(0.0)};
  }

  template <typename T, typename U>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<U, kInputs>&) const {
    return {x[0], acceleration(x[2], x[1])};
  }

  // The fastest rate of x' = f around x, 1/s: bounds the length of a stable Runge-Kutta step.
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    const T turning_hz = wheel.fastest_rate_hz(x[0]), rolling_hz(rolling_rate_hz);
    return select_less(turning_hz, rolling_hz, rolling_hz, turning_hz);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = z * wheel.quarter.wheel_radius_m;
    return true;
  }
};

static_assert(ProcessModel<LongitudinalFriction>);

}  // namespace slipstream
