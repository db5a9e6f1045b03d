// A car as a point that moves in the plane: its engine's power pushes it, its steering turns its heading.
//
//   x_e' = v cos theta,   x_n' = v sin theta
//   v' = (P u_a v/(v^2 + v_eps^2) - A C_d v^2)/M,   theta' = v tan(u_psi)/L
//
// Document 000, eq. 1, after Gao (2014); v/(v^2 + v_eps^2) stands for its 1/v, so that the car can stand. Its drag has no air
// density and no 1/2: A C_d v^2 in N. W: east, north; theta from east towards north, not wrapped. u_a in 0 ... 1 is the
// accelerator, u_psi the angle of the front wheels, positive to the left. Range: forward, |u_psi| well below a right angle.
#pragma once

#include <cmath>

#include "common/parameters.hpp"
#include "common/types.hpp"

namespace slipstream {

struct PointMassCar {
  double peak_power_w = 1e5;     // P: document 000, section 4, as all of these
  double frontal_area_m2 = 1.0;  // A
  double drag_coefficient = 0.3;
  double mass_kg = 1250.0;
  double wheelbase_m = 2.5;    // L
  double speed_eps_mps = 0.5;  // v_eps: at 20 m/s the push is 0.06 % below the document's

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("peak_power_w", p.peak_power_w, non_negative());
    v.number("frontal_area_m2", p.frontal_area_m2, non_negative());
    v.number("drag_coefficient", p.drag_coefficient, non_negative());
    v.number("mass_kg", p.mass_kg, positive());
    v.number("wheelbase_m", p.wheelbase_m, positive());
    v.number("speed_eps_mps", p.speed_eps_mps, positive());
  }

  // Of (x_e, x_n, v, theta); U: a known input, or one that depends on the state (a timetable's).
  template <typename T, typename U>
  Vector<T, 4> derivative(const T& v, const T& theta, const U& accelerator, const U& steering_tangent) const {
    using std::cos, std::sin;
    const T push = (peak_power_w * accelerator) * v / (v * v + speed_eps_mps * speed_eps_mps);
    const T drag = (frontal_area_m2 * drag_coefficient) * v * v;
    return {v * cos(theta), v * sin(theta), (push - drag) * (1.0 / mass_kg), v * steering_tangent * (1.0 / wheelbase_m)};
  }

  // The fastest rate of v' around v, 1/s: that of the push is greatest at standstill.
  template <typename T>
  T fastest_rate_hz(const T& v) const {
    using std::abs;
    const double e = speed_eps_mps * speed_eps_mps;
    return (peak_power_w / (v * v + e) + 2.0 * frontal_area_m2 * drag_coefficient * abs(v)) / mass_kg;
  }
};

}  // namespace slipstream
