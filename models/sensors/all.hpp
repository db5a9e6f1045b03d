// The sensor types: one line each.
#pragma once

#include <array>

#include "models/sensors/accelerometer.hpp"
#include "models/sensors/east_position.hpp"
#include "models/sensors/forward_speed.hpp"
#include "models/sensors/lateral_accelerometer.hpp"
#include "models/sensors/motor_current.hpp"
#include "models/sensors/north_position.hpp"
#include "models/sensors/wheel_speed.hpp"
#include "models/sensors/yaw_rate.hpp"

namespace slipstream {

inline constexpr std::array kSensorTypes{kWheelSpeedSensor,     kAccelerometer,      kYawRateSensor,
                                         kLateralAccelerometer, kMotorCurrentSensor, kForwardSpeedSensor, kEastPositionSensor, kNorthPositionSensor};

}  // namespace slipstream
