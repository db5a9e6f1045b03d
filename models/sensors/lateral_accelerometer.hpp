// Lateral accelerometer: z = a_y, m/s^2, at the centre of gravity along the body's left axis; on level ground the specific force
// along y is v_y' + w_z v_x.
#pragma once

#include "models/sensors/sensor.hpp"

namespace slipstream {

inline constexpr SensorType kLateralAccelerometer{"lateral_accelerometer", {"a_y_mps2", "m/s^2"}, "noise_mps2"};

}  // namespace slipstream
