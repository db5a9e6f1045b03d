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

  // k sgn(w): +-k outside the standstill range, k (3 s - s^3)/2 with s = w/eps inside.
  template <typename T>
  T times_direction(double k, const T& w) const {
    const double eps = standstill_eps_radps;
    const T near = clamp(w, -eps, eps);
    return near * (1.5 * k / eps - (0.5 * k / (eps * eps * eps)) * (near * near));
  }

  template <typename T>
  T rolling_direction(const T& w) const {
    return times_direction(1.0, w);
  }

  // U: a known torque, or one for each lane of T.
  template <typename T, typename U>
  T acceleration_radps2(const U& torque_nm, const T& w, const T& mu) const {
    const double per_torque = 1.0 / quarter.wheel_inertia_kgm2;
    const double per_friction = quarter.normal_force_n() * quarter.wheel_radius_m * per_torque;
    return (torque_nm * per_torque - per_friction * mu) - (quarter.viscous_friction_nms * per_torque) * w -
           times_direction(quarter.rolling_resistance * per_friction, w);
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
