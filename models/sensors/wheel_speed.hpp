// Wheel speed sensor: z = w, rad/s, positive when rolling forward.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kWheelSpeedSensor{"wheel_speed", {"wheel_speed_radps", "rad/s"}, "noise_radps"};

}  // namespace slipstream
