// Position to the north of the origin of W: z = x_n, m.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kNorthPositionSensor{"north_position", {"north_m", "m"}, "noise_m"};

}  // namespace slipstream
