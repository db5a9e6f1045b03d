// Forward speed from the wheels: z = v_x, m/s, along the body's forward axis at its reference point, positive forward.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kForwardSpeedSensor{"forward_speed", {"forward_speed_mps", "m/s"}, "noise_mps"};

}  // namespace slipstream
