// A simulated drive: the scenario's vehicle integrated by CVODE and measured by the scenario's sensors.
//
// Every channel has its own rate (common/schedule.hpp). Sample times do not restart the integrator. Each sensor draws its noise from a stream of its own name (common/random.hpp); a sensor's delay
// (models/sensors/errors.hpp) moves the time at which its sample is published, not the time at which it is taken. IMU, GNSS and
// LIDAR are mounted on a vehicle that has a motion (models/vehicle.hpp): their readings carry the time at which they were
// taken, and the IMU's biases join the truth.
#pragma once

#include <memory>

#include "models/scenario.hpp"
#include "plant/drive_source.hpp"

namespace slipstream {

// Refuses a sensor whose quantity the vehicle does not have, and a mounted one on a vehicle without a motion.
std::unique_ptr<DriveSource> make_simulated_drive(const Scenario& scenario);

}  // namespace slipstream
