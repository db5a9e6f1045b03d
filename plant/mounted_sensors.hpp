// What sensors that are mounted on a moving body read: models/sensors/imu.hpp and fixes.hpp, with noise. Every reading draws
// the same number of deviates, whatever the parameters: changing one leaves the draws of the others alone.
#pragma once

#include "common/geodesy.hpp"
#include "common/messages.hpp"
#include "common/random.hpp"
#include "models/rigid_motion.hpp"
#include "models/sensors/fixes.hpp"
#include "models/sensors/imu.hpp"

namespace slipstream {

class MountedImu {
 public:
  MountedImu(const Imu& imu, double gravity_mps2, RandomStream random);

  // The reading of the interval between two instants with the motions there; intervals follow one another. The first has the
  // biases of the start, each later one those that have walked since the beginning of the one before it.
  Values read(Utime from, const RigidMotion& first, Utime to, const RigidMotion& last);

  // Of the latest reading.
  const Vector3& bias_mps2() const { return bias_mps2_; }
  const Vector3& bias_radps() const { return bias_radps_; }

 private:
  Vector3 draw(double deviation);

  Imu imu_;
  Rotation q_BS_;
  double gravity_mps2_;
  RandomStream random_;
  Vector3 bias_mps2_, bias_radps_;
  Utime before_ = -1;  // beginning of the reading before; -1: none
};

Values gnss_reading(const Gnss& gnss, const LocalFrame& world, const RigidMotion& motion, RandomStream& random);
Values lidar_reading(const Lidar& lidar, const RigidMotion& motion, RandomStream& random);

}  // namespace slipstream
