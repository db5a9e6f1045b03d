// What a vehicle must offer to be simulated: a hybrid ordinary differential equation x' = f(x, mode) whose discrete mode
// (gear, clutch) changes where one of its event functions crosses zero, and the named truth it shows.
//
// Vehicles are plain structs in models/vehicles; models/registry.hpp lists them.
#pragma once

#include <array>
#include <concepts>
#include <string_view>

#include "common/types.hpp"
#include "models/rigid_motion.hpp"

namespace slipstream {

// A vehicle may name its states, for those who disturb them (plant.process_noise): kStateNames, an array of kStates texts,
// empty for a clock. And it may say on which of them nothing depends, neither x' nor an event, as on a place in the endless
// plane: kIgnorable, an array of kStates truth values (ignorable coordinates: Goldstein, Classical Mechanics, section 2.6).

struct Quantity {
  std::string_view name;  // with the unit as suffix
  std::string_view unit;  // for axes
};

// Which zero crossings of an event function count.
enum class Crossing { kRising, kFalling, kBoth };

template <typename V>
concept Vehicle = requires(const V vehicle, Vector<double, V::kStates> x, typename V::Mode mode) {
  { V::kStates } -> std::convertible_to<int>;
  { V::kEvents } -> std::convertible_to<int>;
  { V::kName } -> std::convertible_to<std::string_view>;
  V::kTruth;      // std::array<Quantity, ...>
  V::kInputs;     // std::array<Quantity, ...>: what estimators are told without noise
  V::kCrossings;  // std::array<Crossing, kEvents>
  vehicle.initial_state();
  vehicle.initial_mode();
  vehicle.template derivative<double>(x, mode);  // x' = f(x, mode), templated on the scalar
  vehicle.events(x, mode);                       // Vector<double, kEvents>: mode changes where one crosses zero
  vehicle.after_event(0, x, mode);               // -> Mode
  vehicle.truth(x, mode);                        // values of kTruth
  vehicle.inputs(x, mode);                       // values of kInputs
};

// What sensors can be mounted on: its motion in three dimensions, of which velocity and rates are exact derivatives.
template <typename V>
concept MovingVehicle = Vehicle<V> && requires(const V vehicle, Vector<double, V::kStates> x, typename V::Mode mode) {
  { vehicle.motion(x, mode) } -> std::same_as<RigidMotion>;
};

}  // namespace slipstream
