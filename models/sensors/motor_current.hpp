// Motor current sensor: z = i, A, positive when driving.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kMotorCurrentSensor{"motor_current", {"motor_current_a", "A"}, "noise_a"};

}  // namespace slipstream
