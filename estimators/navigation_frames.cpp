#include "estimators/navigation_frames.hpp"

#include "estimators/kalman.hpp"

namespace slipstream {

NavigationFrames::NavigationFrames(const Strapdown& model, const StrapdownTuning& tuning, double gyro_variance)
    : R_BS_(from_rpy(model.imu_rpy_rad).toRotationMatrix()),
      position_(model.imu_position_m),
      s_(R_BS_.transpose() * model.imu_position_m),
      error_(orientation_error_of(tuning)),
      gyro_variance_(gyro_variance),
      biases_(tuning.biases),
      f_deviation_(tuning.accelerometer_bias_deviation_mps2),
      w_deviation_(tuning.gyro_bias_deviation_radps) {}

PublishedNavigation NavigationFrames::publish(const NavigationBelief& belief, const Vector3& w) const {
  const NavigationState& x = belief.x;
  const Matrix3 R = x.q_WS.toRotationMatrix();
  const Vector3 at = R * s_, turning = R * (w - x.b_w).cross(s_);
  const Vector3 rpy = to_rpy(Matrix3(R * R_BS_.transpose()));
  PublishedNavigation published;
  published.mean << x.p_WS - at, x.v_WS - turning, rpy, x.b_f, x.b_w;

  // phi: the attitude's error in W's axes.
  const Matrix3 phi = error_ == OrientationError::kGlobal ? Matrix3(Matrix3::Identity()) : R;
  ErrorCovariance J = ErrorCovariance::Identity();
  J.block<3, 3>(kPosition, kAttitude) = skew(at) * phi;
  J.block<3, 3>(kVelocity, kAttitude) = skew(turning) * phi;
  J.block<3, 3>(kVelocity, kGyroBias) = -R * skew(s_);
  J.block<3, 3>(kAttitude, kAttitude) = rpy_jacobian(rpy) * phi;
  published.covariance.noalias() = J * belief.P * J.transpose();
  const Matrix3 arm = R * skew(s_);
  published.covariance.block<3, 3>(kVelocity, kVelocity) += gyro_variance_ * arm * arm.transpose();
  symmetrise(published.covariance);
  return published;
}

NavigationBelief NavigationFrames::start(const Vector3& p_WB, const Vector3& v_WB, const Vector3& rpy,
                                         const Vector3& p_deviation, const Vector3& v_deviation, const Vector3& rpy_deviation,
                                         const Vector3& w) const {
  NavigationBelief belief;
  NavigationState& x = belief.x;
  x.q_WS = from_rpy(rpy) * Rotation(R_BS_);
  const Matrix3 R = x.q_WS.toRotationMatrix();
  x.p_WS = p_WB + R * s_;
  x.v_WS = v_WB + R * w.cross(s_);
  const Matrix3 phi = error_ == OrientationError::kGlobal ? Matrix3(Matrix3::Identity()) : R;
  // Position and velocity of B are known independently of its attitude; those of S then are not.
  const Matrix3 to_error = (rpy_jacobian(rpy) * phi).inverse();
  ErrorCovariance J = ErrorCovariance::Identity();
  J.block<3, 3>(kPosition, kAttitude) = -skew(R * s_) * phi * to_error;
  J.block<3, 3>(kVelocity, kAttitude) = -skew(R * w.cross(s_)) * phi * to_error;
  J.block<3, 3>(kVelocity, kGyroBias) = R * skew(s_);
  J.block<3, 3>(kAttitude, kAttitude) = to_error;
  ErrorVector deviation;
  deviation << p_deviation, v_deviation, rpy_deviation, Vector3::Constant(biases_ ? f_deviation_ : 0.0),
      Vector3::Constant(biases_ ? w_deviation_ : 0.0);
  belief.P = J * deviation.cwiseAbs2().asDiagonal() * J.transpose();
  symmetrise(belief.P);
  return belief;
}

}  // namespace slipstream
