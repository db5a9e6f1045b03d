// Between the IMU's frame S, in which the strapdown filters work, and the body's reference point B, of which everybody speaks.
//
//   r: the IMU's place in B, R_BS: its axes in B, s = R_BS' r
//   p_WB = p_WS - R_WS s,   v_WB = v_WS - R_WS ((w - b_w) x s),   R_WB = R_WS R_BS'
//
// Published: (p_WB, v_WB, roll, pitch, yaw of R_WB, b_f, b_w); its covariance is J P J' with J the derivative of these by the
// error state, plus, where s is not zero, what the gyro's noise does to v_WB.
#pragma once

#include "estimators/navigation.hpp"

namespace slipstream {

struct PublishedNavigation {
  ErrorVector mean;
  ErrorCovariance covariance;
};

class NavigationFrames {
 public:
  NavigationFrames(const Strapdown& model, const StrapdownTuning& tuning, double gyro_variance);

  // A point of the body, from B into S.
  Vector3 in_imu_frame(const Vector3& r_B) const { return R_BS_.transpose() * (r_B - position_); }
  const Matrix3& R_BS() const { return R_BS_; }

  PublishedNavigation publish(const NavigationBelief& belief, const Vector3& w) const;
  // The belief of a start: position, velocity and roll-pitch-yaw of B with their standard deviations, w the rate measured then.
  NavigationBelief start(const Vector3& p_WB, const Vector3& v_WB, const Vector3& rpy, const Vector3& p_deviation,
                         const Vector3& v_deviation, const Vector3& rpy_deviation, const Vector3& w) const;

 private:
  Matrix3 R_BS_;
  Vector3 position_, s_;
  OrientationError error_;
  double gyro_variance_;
  bool biases_;
  double f_deviation_, w_deviation_;  // of the biases at the start
};

}  // namespace slipstream
