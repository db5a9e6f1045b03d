// Position to the east of the origin of W: z = x_e, m.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kEastPositionSensor{"east_position", {"east_m", "m"}, "noise_m"};

}  // namespace slipstream
