// Rotations as unit quaternions and their manifold operations: the only place that knows what an angle is.
//
//   exp(phi)  the rotation by |phi| about phi,   log(q)  its inverse, |log q| <= pi
//   global error (document 001, eq. 3.26):  q [+] phi = exp(phi) q,     q2 [-] q1 = log(q2 q1^-1)     phi in W's axes
//   local error:                            q (+) phi = q exp(phi),     q2 (-) q1 = log(q1^-1 q2)     phi in the body's axes
//   roll-pitch-yaw (phi, theta, psi):       R_WB = Rz(psi) Ry(theta) Rx(phi), theta in [-pi/2, pi/2]
//
// R_WB turns a vector's coordinates in B into those in W; q_WB is the same rotation.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "common/types.hpp"

namespace slipstream {

using Vector3 = Vector<double, 3>;
using Matrix3 = Matrix<double, 3>;
using Rotation = Eigen::Quaternion<double>;

// a x b = skew(a) b.
inline Matrix3 skew(const Vector3& a) {
  Matrix3 m;
  m << 0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0;
  return m;
}

inline double wrap_angle(double angle_rad) { return std::remainder(angle_rad, 2.0 * kPi); }

// Document 001, eq. 3.7, with the series of sin(x/2)/x where it would divide by zero.
inline Rotation rotation_exp(const Vector3& phi) {
  const double squared = phi.squaredNorm();
  if (squared < 1e-8) {  // the next terms of both series are below 1e-18
    const double w = 1.0 - squared / 8.0, s = 0.5 - squared / 48.0;
    return {w, s * phi[0], s * phi[1], s * phi[2]};
  }
  const double angle = std::sqrt(squared), s = std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), s * phi[0], s * phi[1], s * phi[2]};
}

inline Vector3 rotation_log(const Rotation& q) {
  const Vector3 v = q.w() < 0.0 ? Vector3(-q.vec()) : Vector3(q.vec());
  const double s = v.norm(), w = std::abs(q.w());
  if (s < 1e-8) return 2.0 * v;  // atan2(s, w)/s = 1 to s^2/3
  return 2.0 * std::atan2(s, w) / s * v;
}

inline Rotation global_plus(const Rotation& q, const Vector3& phi) { return (rotation_exp(phi) * q).normalized(); }
inline Vector3 global_minus(const Rotation& q2, const Rotation& q1) { return rotation_log(q2 * q1.conjugate()); }
inline Rotation local_plus(const Rotation& q, const Vector3& phi) { return (q * rotation_exp(phi)).normalized(); }
inline Vector3 local_minus(const Rotation& q2, const Rotation& q1) { return rotation_log(q1.conjugate() * q2); }

inline Rotation from_rpy(const Vector3& rpy) {
  return Rotation(Eigen::AngleAxisd(rpy[2], Vector3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3::UnitY()) *
                  Eigen::AngleAxisd(rpy[0], Vector3::UnitX()));
}

inline Vector3 to_rpy(const Matrix3& r) {
  return {std::atan2(r(2, 1), r(2, 2)), std::atan2(-r(2, 0), std::hypot(r(2, 1), r(2, 2))), std::atan2(r(1, 0), r(0, 0))};
}
inline Vector3 to_rpy(const Rotation& q) { return to_rpy(q.toRotationMatrix()); }

// d(rpy)/d(phi) of a small global error phi: rpy(exp(phi) q) = rpy(q) + J phi. Singular at a pitch of +-90 degrees.
inline Matrix3 rpy_jacobian(const Vector3& rpy) {
  const double c = std::cos(rpy[2]), s = std::sin(rpy[2]), t = std::tan(rpy[1]), secant = 1.0 / std::cos(rpy[1]);
  Matrix3 j;
  j << c * secant, s * secant, 0.0, -s, c, 0.0, c * t, s * t, 1.0;
  return j;
}

}  // namespace slipstream
