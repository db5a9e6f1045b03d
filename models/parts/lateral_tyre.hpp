// Lateral tyre of one wheel: magic formula, with what its load and its longitudinal force make of it.
//
//   F_y = G D sin(C atan(B t - E (B t - atan(B t)))),   B = K / (C D)
//   D = mu F_z / (1 + q (n - 1)),   K = k F_z (1 + s^2) / (s^2 + n^2),   n = F_z / F_0
//   F_x = D u / r^(1/2),   G = (1 - u^2 / r)^(1/2),   r = (1 + u^4)^(1/2),   u = F_d / D:   F_x^2 + (G D)^2 = D^2
//
// t is the tangent of the slip angle, positive where it pushes to the left (+y). F_0 is the load at which k and mu are given:
// there the slope at t = 0 is k F_0, with k the cornering coefficient in 1/rad (Gillespie, Fundamentals of Vehicle Dynamics,
// ch. 6), and the peak mu F_0. q takes friction from a loaded tyre, and s, the load in F_0 at which the stiffness is greatest,
// makes it grow less than the load: an axle that leans on one wheel is softer and grips less (Pacejka, Tyre and Vehicle
// Dynamics, 2012, section 4.3.2, simplified). Combined slip is the friction ellipse, with the demanded longitudinal force F_d
// given: it is delivered but for u^4 / 4 of it, and cut smoothly at the limit. Left out: camber, aligning torque, relaxation,
// the wheel's own spin.
#pragma once

#include <cmath>

#include "common/parameters.hpp"
#include "models/parts/pacejka.hpp"

namespace slipstream {

// Near x above some eps, near 0 below -eps; smooth and positive everywhere.
template <typename T>
T positive_part(const T& x, double eps) {
  using std::sqrt;
  return 0.5 * (x + sqrt(x * x + eps * eps));
}

struct LateralTyre {
  double shape_c = 1.4;            // C
  double shape_e = -0.2;           // E
  double friction_per_load = 0.1;  // q
  double stiffest_load = 2.5;      // s

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("tyre_shape_c", p.shape_c, between(1.0, 2.0));
    v.number("tyre_shape_e", p.shape_e, between(-10.0, 1.0));
    v.number("tyre_friction_per_load", p.friction_per_load, between(0.0, 0.9));
    v.number("tyre_stiffest_load", p.stiffest_load, between(0.5, 100.0));
  }

  template <typename T>
  struct Force {
    T along_n;  // F_x, N
    T aside_n;  // F_y
  };

  // slip t; k in 1/rad; mu and load_n positive; demand_n is F_d.
  template <typename T>
  Force<T> force(const T& slip, const T& k, const T& mu, const T& load_n, double reference_load_n, const T& demand_n) const {
    using std::sqrt;
    const double s2 = stiffest_load * stiffest_load;
    const T n = load_n * (1.0 / reference_load_n);
    const T peak_n = mu * load_n / (1.0 + friction_per_load * (n - 1.0));
    const T stiffness_n = k * load_n * (1.0 + s2) / (s2 + n * n);
    const T u = demand_n / peak_n, u2 = u * u, root = sqrt(1.0 + u2 * u2);
    const T grip = 1.0 / sqrt(root * (root + u2));  // G: root^2 - u^4 = 1
    return {demand_n / sqrt(root), grip * magic_formula(slip, T(stiffness_n / (shape_c * peak_n)), shape_c, peak_n, shape_e)};
  }
};

}  // namespace slipstream
