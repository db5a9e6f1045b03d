// A driven or braked wheel that hardly slips, on a slope: its friction is what the torque demands, at once or nearly so.
//
//   N = m g cos a,   q = tan a: the grade, positive uphill
//   m v' = mu N - R_aer(v) - m g sin a                        the vehicle
//   J w' = T - b w - (mu + f_r sgn w) N r                     the wheel
//   mu   = C l,   w = (1 + l) v / r                           the tyre at small slip l: C = dmu/dl at l = 0 (Pacejka's B C D)
//
// The second and third lines make l, hence mu, a fast state:  mu' = (mu_T - mu)/tau,  tau = J v / (C N r^2 (1 + J/(m r^2))),
// where mu_T is the friction at which wheel and vehicle accelerate together, r w' = v':
//
//   mu_T = [T - b w - f_r N r sgn w + (J/r) (R_aer/m + g sin a)] / [N r (1 + J/(m r^2))]
//
// So a step of the torque is a step of the friction, 1 ms later at 9 m/s and sooner below. tau_0 is added to tau: what is
// faster than a sample looks the same whatever its rate, and need not be integrated. The wheel's speed follows its own
// equation, w = (1 + l) v/r, with the same tau:  w' = (v' + v mu'/C)/r + ((1 + mu/C) v/r - w)/tau,  which forgets a wrong
// start. Left out, being small where l is: l v' in l', and the curve of the tyre above a third of its peak. Range: |l| below
// some per cent; T positive when driving, negative when braking. The slow part is exact, as in Kokotovic, Khalil and O'Reilly,
// Singular Perturbation Methods in Control (1986), section 1.2: mu_T is the slow manifold. Tyre and wheel: document 002,
// eqs 3.1-3.15.
#pragma once

#include <cmath>

#include "models/parts/driven_wheel.hpp"

namespace slipstream {

struct RollingWheel {
  static constexpr double kSpeedEps_mps = 1e-3;  // |v| = sqrt(v^2 + eps^2)

  DrivenWheel wheel;
  double slip_stiffness = 19.0;      // C; the dry road of Table 1: 10 * 1.9 * 1
  double least_relaxation_s = 1e-3;  // tau_0

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    DrivenWheel::visit_parameters(p.wheel, v);
    v.number("slip_stiffness", p.slip_stiffness, positive());
    v.number("least_relaxation_s", p.least_relaxation_s, positive());
  }

  // What the road and the load make of it, for one state.
  template <typename T>
  struct Road {
    T mass_kg;
    T sine, cosine;  // of the slope
  };
  template <typename T>
  static Road<T> road(const T& mass_kg, const T& grade) {
    using std::sqrt;
    const T cosine = 1.0 / sqrt(1.0 + grade * grade);
    return {mass_kg, grade * cosine, cosine};
  }

  // Specific force along the road, F_x/m - R_aer/m: what an accelerometer feels, on the level v'.
  template <typename T>
  T specific_force_mps2(const Road<T>& at, const T& mu, const T& v) const {
    return (kGravity_mps2 * at.cosine) * mu - wheel.quarter.drag_n(v) / at.mass_kg;
  }

  // mu_T
  template <typename T>
  T demanded_friction(const Road<T>& at, double torque_nm, const T& w, const T& v) const {
    const QuarterCar& q = wheel.quarter;
    const double r = q.wheel_radius_m, J = q.wheel_inertia_kgm2;
    const T Nr = (kGravity_mps2 * r) * (at.mass_kg * at.cosine);
    const T resisted = q.drag_n(v) / at.mass_kg + kGravity_mps2 * at.sine;
    const T left =
        torque_nm - q.viscous_friction_nms * w - (q.rolling_resistance * Nr) * wheel.rolling_direction(w) + (J / r) * resisted;
    return left / (Nr * carried(at));
  }

  // tau_0 + tau
  template <typename T>
  T relaxation_s(const Road<T>& at, const T& v) const {
    using std::sqrt;
    const double r = wheel.quarter.wheel_radius_m;
    const T N = kGravity_mps2 * (at.mass_kg * at.cosine);
    return least_relaxation_s + (wheel.quarter.wheel_inertia_kgm2 / (slip_stiffness * r * r)) *
                                    sqrt(v * v + kSpeedEps_mps * kSpeedEps_mps) / (N * carried(at));
  }

  // w', v', mu'
  template <typename T>
  Vector<T, 3> rates(const Road<T>& at, double torque_nm, const T& w, const T& v, const T& mu) const {
    const double r = wheel.quarter.wheel_radius_m;
    const T tau = relaxation_s(at, v);
    const T v_dot = specific_force_mps2(at, mu, v) - kGravity_mps2 * at.sine;
    const T mu_dot = (demanded_friction(at, torque_nm, w, v) - mu) / tau;
    const T slipping = (1.0 / r) * (v + (1.0 / slip_stiffness) * (mu * v));
    const T w_dot = (1.0 / r) * (v_dot + (1.0 / slip_stiffness) * (v * mu_dot)) + (slipping - w) / tau;
    return {w_dot, v_dot, mu_dot};
  }

  // The speed at which a wheel of this speed rolls, with the slip of mu.
  double speed_mps(double w, double mu) const { return w * wheel.quarter.wheel_radius_m / (1.0 + mu / slip_stiffness); }

 private:
  // 1 + J/(m r^2): the wheel's inertia carried along.
  template <typename T>
  T carried(const Road<T>& at) const {
    const double r = wheel.quarter.wheel_radius_m;
    return 1.0 + (wheel.quarter.wheel_inertia_kgm2 / (r * r)) / at.mass_kg;
  }
};

}  // namespace slipstream
