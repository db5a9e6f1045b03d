// Combustion engine at full load: crankshaft speed in, torque out. Two curves:
//
//   quadratic  T_m = P1 + P2 w_m - P3 w_m^2,  P1 = 0.87 P_M/w_M, P2 = 1.13 P_M/w_M^2, P3 = P_M/w_M^3   (doc. 002, eqs 7.1-7.2)
//   quintic    T_m = a1 w^5 + ... + a6, least squares through points of a data sheet                    (doc. 002, ch. 7)
//
// Below idle speed the engine is held at idle by a slipping clutch: T_m(w_m) = T_m(w_idle) for w_m < w_idle.
// Valid from idle to rated speed. P_M is the rated power at w_M.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/polynomial.hpp"
#include "common/types.hpp"

namespace slipstream {

// T = sum_i c_i w^i, ascending powers, evaluated by Horner's rule in s = w / scale, which keeps the c_i near the torque's size.
struct EngineCurve {
  static constexpr int kDegree = 5;
  std::array<double, kDegree + 1> coefficient{};
  double scale_radps = 1.0;

  template <typename T>
  T torque_nm(const T& engine_speed_radps) const {
    const T s = (1.0 / scale_radps) * engine_speed_radps;
    T sum = T(coefficient[kDegree]);
    for (int i = kDegree - 1; i >= 0; --i) sum = sum * s + coefficient[static_cast<std::size_t>(i)];
    return sum;
  }
};

inline EngineCurve quadratic_curve(double rated_power_w, double rated_speed_radps) {
  const double p = rated_power_w / rated_speed_radps;  // torque at rated speed; s = w / w_M
  return {{0.87 * p, 1.13 * p, -p, 0.0, 0.0, 0.0}, rated_speed_radps};
}

inline EngineCurve quintic_curve(const std::vector<double>& speed_rpm, const std::vector<double>& torque_nm) {
  EngineCurve curve;
  curve.scale_radps = speed_rpm.back() * kRadpsPerRpm;
  const std::vector<double> fit = fit_polynomial(speed_rpm, torque_nm, EngineCurve::kDegree);
  std::copy(fit.begin(), fit.end(), curve.coefficient.begin());
  return curve;
}

}  // namespace slipstream
