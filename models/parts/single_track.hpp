// Linear single-track ("bicycle") model: the two wheels of an axle are one, side forces are proportional to slip angles.
//
//   alpha_1 = (v_x delta - v_y - a_1 w_z) / v_r,   alpha_2 = (a_2 w_z - v_y) / v_r,   v_r = sqrt(v_x^2 + v_eps^2)
//   a_y = v_y' + w_z v_x = (C_1 alpha_1 + C_2 alpha_2) / m,   w_z' = (a_1 C_1 alpha_1 - a_2 C_2 alpha_2) / I_z
//
// Index 1 is the front axle. Body frame: x forward, y left, at the centre of gravity; delta, w_z positive to the left. Document
// 002, eq. 3.16, of which only v_r is not: it keeps the model finite at standstill, where no force is left but one against the
// side motion. Away from it slip angles are short by v_eps^2 / (2 v_x^2), 0.2 % at 0.35 m/s. Range: small angles, linear tyres.
// The model is stiff when slow: its rates are at most (C_1 + C_2) / (m v_r) + (a_1^2 C_1 + a_2^2 C_2) / (I_z v_r).
#pragma once

#include <cmath>

#include "common/parameters.hpp"

namespace slipstream {

struct SingleTrack {
  double mass_kg = 2.8;         // the scale car's: document 002, Table 10
  double front_axle_m = 0.134;  // a_1, from the centre of gravity
  double rear_axle_m = 0.122;   // a_2
  double yaw_inertia_kgm2 = 0.2;
  double wheel_radius_m = 0.033;
  double slip_speed_eps_mps = 0.02;  // v_eps

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("mass_kg", p.mass_kg, positive());
    v.number("front_axle_m", p.front_axle_m, positive());
    v.number("rear_axle_m", p.rear_axle_m, positive());
    v.number("yaw_inertia_kgm2", p.yaw_inertia_kgm2, positive());
    v.number("wheel_radius_m", p.wheel_radius_m, positive());
    v.number("slip_speed_eps_mps", p.slip_speed_eps_mps, positive());
  }

  template <typename T>
  struct Accelerations {
    T lateral_mps2;  // a_y
    T yaw_radps2;    // w_z'
  };

  // v_x and delta are inputs (U), the stiffnesses C_1, C_2 in N/rad known or states: any scalars that mix.
  template <typename T, typename U, typename C>
  Accelerations<T> accelerations(const T& v_y, const T& w_z, const U& v_x, const U& delta, const C& c_1, const C& c_2) const {
    using std::sqrt;
    const U v_r = sqrt(v_x * v_x + slip_speed_eps_mps * slip_speed_eps_mps);
    const T alpha_1 = (v_x * delta - v_y - front_axle_m * w_z) / v_r;
    const T alpha_2 = (rear_axle_m * w_z - v_y) / v_r;
    const T front_n = c_1 * alpha_1;
    const T rear_n = c_2 * alpha_2;
    return {(front_n + rear_n) * (1.0 / mass_kg), (front_axle_m * front_n - rear_axle_m * rear_n) * (1.0 / yaw_inertia_kgm2)};
  }

  // The fastest rate, 1/s, of these stiffnesses at standstill, where it is greatest.
  template <typename C>
  C fastest_rate_hz(const C& c_1, const C& c_2) const {
    using std::abs;
    const C f = abs(c_1), r = abs(c_2);
    return ((f + r) / mass_kg + (front_axle_m * front_axle_m * f + rear_axle_m * rear_axle_m * r) / yaw_inertia_kgm2) /
           slip_speed_eps_mps;
  }
};

}  // namespace slipstream
