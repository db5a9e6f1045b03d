// The wheel of a process model whose friction is a state, not a tyre's: what the torque leaves over turns the wheel.
//
//   J w' = T - b w - (mu + f_r sgn w) m g r          (document 002, eqs 5.6 and 7.11; b of eq. 5.3, f_r of eq. 3.11)
//
// sgn is a cubic between +-standstill_eps_radps, so that the wheel may stop and turn back. T positive when driving.
#pragma once

#include <cmath>

#include "common/dual.hpp"
#include "common/pack.hpp"
#include "models/parts/quarter_car.hpp"

namespace slipstream {

struct DrivenWheel {
  QuarterCar quarter;
  double standstill_eps_radps = 0.1;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    QuarterCar::visit_parameters(p.quarter, v);
    v.number("standstill_eps_radps", p.standstill_eps_radps, positive());
  }

  // sgn(w): +-1 outside the standstill range, (3 s - s^3)/2 with s = w/eps inside.
  template <typename T>
  T rolling_direction(const T& w) const {
    const T s = clamp((1.0 / standstill_eps_radps) * w, -1.0, 1.0);
    return 0.5 * s * (3.0 - s * s);
  }

  // U: a known torque, or one for each lane of T.
  template <typename T, typename U>
  T acceleration_radps2(const U& torque_nm, const T& w, const T& mu) const {
    const double grip_nm = quarter.normal_force_n() * quarter.wheel_radius_m;  // torque per unit of friction
    return (1.0 / quarter.wheel_inertia_kgm2) *
           (torque_nm - quarter.viscous_friction_nms * w - grip_nm * (mu + quarter.rolling_resistance * rolling_direction(w)));
  }

  // The fastest rate of w' around w, 1/s: bounds the length of a stable Runge-Kutta step.
  template <typename T>
  T fastest_rate_hz(const T& w) const {
    using std::abs;
    const double rate = quarter.viscous_friction_nms / quarter.wheel_inertia_kgm2;
    const double standing = rate + 1.5 * quarter.rolling_resistance * quarter.normal_force_n() * quarter.wheel_radius_m /
                                       (standstill_eps_radps * quarter.wheel_inertia_kgm2);
    return select_less(abs(w), T(standstill_eps_radps), T(standing), T(rate));
  }
};

}  // namespace slipstream
