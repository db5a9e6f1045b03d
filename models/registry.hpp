// The lists that a new vehicle or process model is added to: one line each.
#pragma once

#include <variant>

#include "models/processes/lateral_bicycle.hpp"
#include "models/processes/lateral_tyres.hpp"
#include "models/processes/longitudinal_friction.hpp"
#include "models/processes/point_mass_motion.hpp"
#include "models/processes/torque_friction.hpp"
#include "models/processes/torque_friction_load.hpp"
#include "models/processes/tyre_friction.hpp"
#include "models/processes/wheel_friction.hpp"
#include "models/vehicles/bicycle.hpp"
#include "models/vehicles/point_mass.hpp"
#include "models/vehicles/road_car.hpp"
#include "models/vehicles/suspended_wheel.hpp"
#include "models/vehicles/torque_car.hpp"
#include "models/vehicles/two_track.hpp"
#include "models/vehicles/unimog.hpp"

namespace slipstream {

using AnyVehicle = std::variant<Unimog, TorqueCar, SuspendedWheel, Bicycle, RoadCar, PointMass, TwoTrack>;
using AnyProcess = std::variant<LongitudinalFriction, WheelFriction, LateralBicycle, PointMassMotion, TorqueFriction,
                                TorqueFrictionLoad, TyreFriction, LateralTyres>;

}  // namespace slipstream
