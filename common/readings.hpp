// The readings that carry several numbers, by the name of their quantity, and what each number is.
//
//   imu              specific force and angular rate of the sensor against W, both in the sensor's axes
//   gnss             WGS-84, of the antenna
//   lidar            position of the LIDAR in its own map's frame
//
// Whoever keeps scalars only (series, plots) keeps a reading's components under these names.
#pragma once

#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "common/messages.hpp"

namespace slipstream {

inline constexpr std::string_view kImu = "imu", kGnss = "gnss", kLidar = "lidar";

struct Component {
  std::string_view name;  // with the unit as suffix
  std::string_view unit;  // for axes
};

inline constexpr std::array<Component, 6> kImuComponents{{{"f_x_mps2", "m/s^2"},
                                                          {"f_y_mps2", "m/s^2"},
                                                          {"f_z_mps2", "m/s^2"},
                                                          {"w_x_radps", "rad/s"},
                                                          {"w_y_radps", "rad/s"},
                                                          {"w_z_radps", "rad/s"}}};
inline constexpr std::array<Component, 3> kGnssComponents{
    {{"latitude_deg", "deg"}, {"longitude_deg", "deg"}, {"height_m", "m"}}};
inline constexpr std::array<Component, 3> kLidarComponents{{{"lidar_x_m", "m"}, {"lidar_y_m", "m"}, {"lidar_z_m", "m"}}};

// No IMU on a vehicle measures more: ten thousand g, a thousand turns a second.
inline constexpr double kMostForce_mps2 = 1e5, kMostRate_radps = 1e4;

// Of a quantity with several numbers; empty: the quantity is a number.
inline std::span<const Component> components_of(std::string_view quantity) {
  if (quantity == kImu) return kImuComponents;
  if (quantity == kGnss) return kGnssComponents;
  if (quantity == kLidar) return kLidarComponents;
  return {};
}

// What makes a reading unusable whoever reads it; null: nothing.
inline const char* problem_of(std::string_view quantity, const Values& value) {
  const std::span<const Component> components = components_of(quantity);
  if (value.size() != (components.empty() ? 1 : components.size())) return "it has the wrong number of values";
  for (const double v : value)
    if (!std::isfinite(v)) return "its value is not finite";
  if (quantity == kImu)
    for (std::size_t i = 0; i < 6; ++i)
      if (std::abs(value[i]) > (i < 3 ? kMostForce_mps2 : kMostRate_radps)) return "its value is beyond what any IMU measures";
  if (quantity == kGnss && std::abs(value[0]) > 90.0) return "its latitude is not from -90 to 90 degrees";
  if (quantity == kGnss && std::abs(value[1]) > 180.0) return "its longitude is not from -180 to 180 degrees";
  return nullptr;
}

}  // namespace slipstream
