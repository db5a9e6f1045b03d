// Longitudinal tyre: Pacejka's magic formula and the slip it takes.
//
//   mu(l) = D sin(C atan(B l - E (B l - atan(B l))))        l = (w r - v) / sqrt(v^2 + v_eps^2)
//
// l is the slip of document 002, eq. 3.1, regularised at standstill: at v = 0 it is finite, and for v >> v_eps the two
// agree to v_eps^2 / (2 v^2). mu is the friction coefficient F_x / F_z (eq. 3.3), odd in l, positive when driving.
// Slope at l = 0: B C D. Peak: D where C >= 1 and the argument reaches pi / (2 C).
// Coefficients: document 002, Table 1 (after Pacejka 2005). Pure longitudinal slip only.
#pragma once

#include <array>
#include <cmath>
#include <string_view>

namespace slipstream {

// mu(l) of any coefficients; B and D may be states.
template <typename T>
T magic_formula(const T& slip, const T& b, double c, const T& d, double e) {
  using std::atan, std::sin;
  const T bl = b * slip;
  return d * sin(c * atan(bl - e * (bl - atan(bl))));
}

struct PacejkaTyre {
  double b = 10.0;
  double c = 1.9;
  double d = 1.0;
  double e = 0.97;

  template <typename T>
  T friction(const T& slip) const {
    using std::atan, std::sin;
    const T bl = b * slip;
    return d * sin(c * atan(bl - e * (bl - atan(bl))));
  }
};

template <typename T>
T longitudinal_slip(const T& wheel_speed_radps, const T& speed_mps, double radius_m, double v_eps_mps) {
  using std::sqrt;
  return (radius_m * wheel_speed_radps - speed_mps) / sqrt(speed_mps * speed_mps + v_eps_mps * v_eps_mps);
}

struct Surface {
  std::string_view name;
  PacejkaTyre tyre;
};

inline constexpr std::array<Surface, 4> kSurfaces{{
    {"dry", {10.0, 1.9, 1.0, 0.97}},
    {"wet", {12.0, 2.3, 0.82, 1.0}},
    {"snow", {5.0, 2.0, 0.3, 1.0}},
    {"ice", {4.0, 2.0, 0.1, 1.0}},
}};

}  // namespace slipstream
