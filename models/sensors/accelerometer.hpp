// Longitudinal accelerometer: z = a_x, m/s^2, along the body's forward axis, positive forward; on level ground the specific
// force along x is the acceleration itself.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kAccelerometer{"accelerometer", {"a_x_mps2", "m/s^2"}, "noise_mps2"};

}  // namespace slipstream
