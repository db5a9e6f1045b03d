#include "plant/mounted_sensors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/check.hpp"

namespace slipstream {
namespace {

Vector3 standard_normal(RandomStream& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

Vector3 saturated(const Vector3& y, double range) { return range > 0.0 ? Vector3(y.cwiseMax(-range).cwiseMin(range)) : y; }

Values values_of(const Vector3& v) { return Values(std::span<const double>(v.data(), 3)); }

}  // namespace

MountedImu::MountedImu(const Imu& imu, double gravity_mps2, RandomStream random)
    : imu_(imu),
      q_BS_(from_rpy(imu.rpy_rad)),
      gravity_mps2_(gravity_mps2),
      random_(random),
      bias_mps2_(imu.bias_mps2),
      bias_radps_(imu.bias_radps) {}

Vector3 MountedImu::draw(double deviation) { return deviation * standard_normal(random_); }

Values MountedImu::read(Utime from, const RigidMotion& first, Utime to, const RigidMotion& last) {
  SLIPSTREAM_CHECK(to > from && from > before_);
  const double since = before_ < 0 ? 0.0 : std::sqrt(seconds(from - before_)), dt = seconds(to - from);
  before_ = from;
  bias_mps2_ += draw(imu_.bias_walk_mps2 * since);
  bias_radps_ += draw(imu_.bias_walk_radps * since);

  const Vector3 gained = last.velocity_of(imu_.position_m) - first.velocity_of(imu_.position_m);
  const Rotation q_SW = (first.q_WB * q_BS_).conjugate();
  const Vector3 f = q_SW * (gained / dt + gravity_mps2_ * Vector3::UnitZ());
  const Vector3 w = q_BS_.conjugate() * local_minus(last.q_WB, first.q_WB) / dt;
  const Vector3 z_f = saturated(imu_.accelerometer_scale.cwiseProduct(f) + bias_mps2_ + draw(imu_.noise_mps2), imu_.range_mps2);
  const Vector3 z_w = saturated(imu_.gyro_scale.cwiseProduct(w) + bias_radps_ + draw(imu_.noise_radps), imu_.range_radps);
  return Values(std::array{z_f[0], z_f[1], z_f[2], z_w[0], z_w[1], z_w[2]});
}

Values gnss_reading(const Gnss& gnss, const LocalFrame& world, const RigidMotion& motion, RandomStream& random) {
  const Vector3 fix = motion.position_of(gnss.position_m) + gnss.noise_m.cwiseProduct(standard_normal(random));
  const Geodetic at = world.to_geodetic(fix);
  return values_of({at.latitude_deg, at.longitude_deg, at.height_m});
}

Values lidar_reading(const Lidar& lidar, const RigidMotion& motion, RandomStream& random) {
  const Vector3 in_map = from_rpy(lidar.map_rpy_rad).conjugate() * (motion.position_of(lidar.position_m) - lidar.map_offset_m);
  return values_of(in_map + lidar.noise_m.cwiseProduct(standard_normal(random)));
}

}  // namespace slipstream
