// The covariance of the 15 error states under the two things that happen to it, written for speed: F and H are mostly zero.
//
//   propagate   P = F P F' + Q     dp += dt dv,   dv += A dphi + B_f db_f,   dphi = E dphi + B_w db_w
//   correct     S = H P H' + R,   P = (I - K H) P (I - K H)' + K R K',  K = P H' S^-1                               Joseph form
//
// One triangle is computed and mirrored: P is symmetric to the last bit. Without biases their blocks are not touched.
// Q and R are discrete covariances.
#pragma once

#include <array>

#include "estimators/navigation.hpp"

namespace slipstream {

struct ErrorTransition {
  double dt_s = 0.0;
  Matrix3 A, B_f, E, B_w;
  bool has_E = false;  // else E = I
  bool biases = true;
};
void propagate(ErrorCovariance& p, const ErrorTransition& f, const InertialNoise& noise);

// H: identity or nothing on the position, and a block for each of velocity, attitude and gyro bias, or nothing.
struct SparseRows {
  bool position = false, velocity = false, attitude = false, gyro_bias = false;
  Matrix3 of_velocity, of_attitude, of_gyro_bias;
  bool biases = true;
};

// The innovation, and K nu. False, and P as it was: nis > gate, or it cannot be weighed (strapdown_equations.hpp).
bool correct(ErrorCovariance& p, const SparseRows& h, const NavigationMeasurement& z, const Vector3& predicted, double gate,
             NavigationInnovation& i, ErrorVector& correction);

}  // namespace slipstream
