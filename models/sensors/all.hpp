// The sensor types: one line each.
#pragma once

#include <array>

#include "models/sensors/accelerometer.hpp"
#include "models/sensors/wheel_speed.hpp"

namespace slipstream {

inline constexpr std::array kSensorTypes{kWheelSpeedSensor, kAccelerometer};

}  // namespace slipstream
