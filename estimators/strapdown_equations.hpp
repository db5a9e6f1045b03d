// The equations that the strapdown filters share: how the mean moves, what a measurement says of it, and how far off that is.
//
//   f = z_f - b_f,  w = z_w - b_w, held over dt from t_k:
//   p += dt v + dt^2/2 a,   v += dt a,   q = q exp(w dt),   a = R f - g z,   R = C(q_k)        document 001, eqs 3.2-3.5
//   kPoint  h = p + R l          kBodyVelocity  h = R_BS [R' v + (w - b_w) x l]
//   nis = nu' S^-1 nu
//
// The velocity's sum takes every reading in the axes of t_k: exact for readings as models/sensors/imu.hpp defines them.
#pragma once

#include <cmath>

#include "estimators/navigation.hpp"

namespace slipstream {

inline bool is_usable(const Inertial& reading, const InertialNoise& noise, double dt_s) {
  return dt_s > 0.0 && std::isfinite(dt_s) && std::isfinite(reading.f.sum() + reading.w.sum()) &&
         std::isfinite(noise.f + noise.w + noise.f_walk + noise.w_walk);
}

// R = C(q_WS) and turn = exp(w dt) of that step.
inline NavigationState moved(const NavigationState& x, const Inertial& reading, double gravity_mps2, double dt_s,
                             const Matrix3& r, const Rotation& turn) {
  Vector3 a = r * (reading.f - x.b_f);
  a[2] -= gravity_mps2;
  return {(x.q_WS * turn).normalized(), x.p_WS + dt_s * (x.v_WS + 0.5 * dt_s * a), x.v_WS + dt_s * a, x.b_f, x.b_w};
}
inline NavigationState moved(const NavigationState& x, const Inertial& reading, double gravity_mps2, double dt_s) {
  return moved(x, reading, gravity_mps2, dt_s, x.q_WS.toRotationMatrix(), rotation_exp(dt_s * (reading.w - x.b_w)));
}

// h(x) of `rows`; zero beyond size.
inline Vector3 predicted(const NavigationState& x, const NavigationMeasurement& m) {
  if (m.kind == NavigationMeasurement::kPoint) return x.p_WS + x.q_WS * m.l;
  const Vector3 v_B = m.R_BS * (x.q_WS.conjugate() * x.v_WS + (m.w - x.b_w).cross(m.l));
  Vector3 h = Vector3::Zero();
  for (int i = 0; i < m.size; ++i) h[i] = v_B[m.rows[static_cast<std::size_t>(i)]];
  return h;
}

// nu = z - h and S = HPH' + R with ones on the diagonal beyond size; its inverse by S = L D L' and nis. False: S is not
// positive definite, to what its digits allow, or something is not finite.
inline bool weigh(const NavigationMeasurement& m, const Vector3& h, const Matrix3& hph, NavigationInnovation& i,
                  Matrix3& inverse) {
  i.size = m.size;
  i.nu.setZero();
  i.S.setIdentity();
  for (int r = 0; r < m.size; ++r) {
    i.nu[r] = m.z[r] - h[r];
    for (int c = 0; c < m.size; ++c) i.S(r, c) = 0.5 * (hph(r, c) + hph(c, r)) + m.R(r, c);
  }
  constexpr double kDigits = 1e-14;  // a pivot below this part of its diagonal is rounding
  const Matrix3& s = i.S;
  const double d0 = s(0, 0), u0 = 1.0 / d0;
  const double l10 = s(1, 0) * u0, l20 = s(2, 0) * u0;
  const double d1 = s(1, 1) - l10 * s(1, 0), u1 = 1.0 / d1, c21 = s(2, 1) - l20 * s(1, 0);
  const double l21 = c21 * u1;
  const double d2 = s(2, 2) - l20 * s(2, 0) - l21 * c21, u2 = 1.0 / d2;
  if (!(d0 > 0.0 && d1 > kDigits * s(1, 1) && d2 > kDigits * s(2, 2))) return false;
  const double m20 = l10 * l21 - l20;  // of L^-1 = [1; -l10 1; m20 -l21 1]
  inverse(0, 0) = u0 + l10 * l10 * u1 + m20 * m20 * u2;
  inverse(1, 0) = inverse(0, 1) = -l10 * u1 - m20 * l21 * u2;
  inverse(2, 0) = inverse(0, 2) = m20 * u2;
  inverse(1, 1) = u1 + l21 * l21 * u2;
  inverse(2, 1) = inverse(1, 2) = -l21 * u2;
  inverse(2, 2) = u2;
  const Vector3 y{i.nu[0], i.nu[1] - l10 * i.nu[0], i.nu[2] - l21 * i.nu[1] + m20 * i.nu[0]};
  i.nis = y[0] * y[0] * u0 + y[1] * y[1] * u1 + y[2] * y[2] * u2;
  return std::isfinite(i.nis);
}

// Symmetric, and its eigenvalues not below zero by more than rounding: biases left out make it singular.
inline bool is_covariance(const ErrorCovariance& p) {
  constexpr double kDigits = 1e-9;  // as is_positive_definite's in kalman.hpp
  if (p != p.transpose()) return false;
  ErrorVector scale = p.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 1.0;
  ErrorCovariance raised = scale.asDiagonal() * p * scale.asDiagonal();  // correlations: its blocks' units differ
  raised.diagonal().array() += kDigits;
  return raised.llt().info() == Eigen::Success;
}

}  // namespace slipstream
