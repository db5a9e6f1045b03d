// Yaw rate gyroscope: z = w_z, rad/s, about the body's upward axis, positive when turning left.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kYawRateSensor{"yaw_rate", {"yaw_rate_radps", "rad/s"}, "noise_radps"};

}  // namespace slipstream
