// Wheel, vehicle and friction without a tyre model: the friction coefficient is a state that only process noise moves.
//
//   w' = (T - b w - (mu + f_r sgn w) m g r) / J,   v' = mu g - R_aer(v)/m + k (r w - v),   mu' = 0
//   z = (w, a_x),   a_x = mu g - R_aer(v)/m
//
// Document 002, eq. 7.12, with b of eq. 5.3. Three terms are ours: the drag R_aer (`drag = false` leaves it out, as the
// document does); sgn, a cubic between +-standstill_eps_radps, so that the wheel may stop and turn back; and k,
// rolling_rate_hz, the belief that in the long run the wheel rolls. With k = 0 (eq. 7.12) nothing ties v to a measurement: it
// is the integral of a_x from the start, and its uncertainty grows with time. Input: T, the torque at this wheel.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/dual.hpp"
#include "models/parts/quarter_car.hpp"
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

  QuarterCar quarter;
  bool drag = true;
  double standstill_eps_radps = 0.1;
  double rolling_rate_hz = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    QuarterCar::visit_parameters(p.quarter, v);
    v.flag("drag", p.drag);
    v.number("standstill_eps_radps", p.standstill_eps_radps, positive());
    v.number("rolling_rate_hz", p.rolling_rate_hz, non_negative());
  }

  template <typename T>
  T acceleration(const T& mu, const T& v) const {
    return drag ? quarter.acceleration_mps2(mu, v) : kGravity_mps2 * mu;
  }

  // sgn(w): +-1 outside the standstill range, (3 s - s^3)/2 with s = w/eps inside.
  template <typename T>
  T rolling_direction(const T& w) const {
    const double inside = value_of(w) / standstill_eps_radps;
    if (inside >= 1.0) return T(1.0);
    if (inside <= -1.0) return T(-1.0);
    const T s = (1.0 / standstill_eps_radps) * w;
    return 0.5 * s * (3.0 - s * s);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const T& w = x[0];
    const T& v = x[1];
    const T& mu = x[2];
    const double grip_nm = quarter.normal_force_n() * quarter.wheel_radius_m;  // torque per unit of friction
    const T w_dot = (1.0 / quarter.wheel_inertia_kgm2) * (u[0] - quarter.viscous_friction_nms * w -
                                                          grip_nm * (mu + quarter.rolling_resistance * rolling_direction(w)));
    T v_dot = acceleration(mu, v);
    if (rolling_rate_hz > 0.0) v_dot = v_dot + rolling_rate_hz * (quarter.wheel_radius_m * w - v);
    return {w_dot, v_dot, T(0.0)};
  }

  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], acceleration(x[2], x[1])};
  }

  // The fastest rate of x' = f around x, 1/s: bounds the length of a stable Runge-Kutta step.
  double fastest_rate_hz(const Vector<double, kStates>& x) const {
    const double rate = std::max(quarter.viscous_friction_nms / quarter.wheel_inertia_kgm2, rolling_rate_hz);
    if (std::abs(x[0]) >= standstill_eps_radps) return rate;
    return rate + 1.5 * quarter.rolling_resistance * quarter.normal_force_n() * quarter.wheel_radius_m /
                      (standstill_eps_radps * quarter.wheel_inertia_kgm2);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = z * quarter.wheel_radius_m;
    return true;
  }
};

static_assert(ProcessModel<LongitudinalFriction>);

}  // namespace slipstream
