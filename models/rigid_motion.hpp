// The motion of a rigid body against W (east-north-up), as strapdown sensors feel it, and what they feel at a point of it.
//
//   point r (B):   p_WS = p + R r,   v = v_WB + R (w x r),   a = a_WB + R (alpha x r + w x (w x r))
//   specific force of a sensor there, axes R_BS:   f_S = R_BS' R' (a + g z),   w_S = R_BS' w          g: gravity, z: up
//
// The earth's rotation is left out: at most 7.3e-5 rad/s and, at 20 m/s, 3 mm/s^2, below what such sensors resolve.
#pragma once

#include "common/rotation.hpp"

namespace slipstream {

struct RigidMotion {
  Vector3 p_WB = Vector3::Zero();  // of B's reference point, m
  Vector3 v_WB = Vector3::Zero();  // in W, m/s
  Vector3 a_WB = Vector3::Zero();  // in W, m/s^2
  Rotation q_WB = Rotation::Identity();
  Vector3 w_WB_B = Vector3::Zero();      // in B, rad/s
  Vector3 alpha_WB_B = Vector3::Zero();  // its derivative, rad/s^2

  Vector3 position_of(const Vector3& r_B) const { return p_WB + q_WB * r_B; }
  Vector3 velocity_of(const Vector3& r_B) const { return v_WB + q_WB * w_WB_B.cross(r_B); }
  Vector3 acceleration_of(const Vector3& r_B) const {
    return a_WB + q_WB * (alpha_WB_B.cross(r_B) + w_WB_B.cross(w_WB_B.cross(r_B)));
  }
  // In B's axes.
  Vector3 specific_force_of(const Vector3& r_B, double gravity_mps2) const {
    return q_WB.conjugate() * (acceleration_of(r_B) + gravity_mps2 * Vector3::UnitZ());
  }
};

}  // namespace slipstream
