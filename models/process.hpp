// What an estimator's process model must offer: a smooth x' = f(x, u), the outputs h(x, u) that sensors measure, and the names
// by which sensors, truth and estimates find each other. It says what the estimator believes, never what the plant is.
//
// Process models are plain structs in models/processes; models/registry.hpp lists them.
#pragma once

#include <array>
#include <concepts>
#include <string_view>

#include "common/types.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

// A model whose derivative and output take inputs of any scalar, so that several instants with inputs of their own go through
// at once (pack.hpp), says kInputsOfAnyScalar. The others are evaluated one by one.
template <typename M>
concept TakesPackedInputs = requires {
  requires M::kInputsOfAnyScalar;
};

// A model whose equations are a vehicle's own, given its parameters and inputs, may say so: kExactFor, the vehicle's name.
// Every state that the vehicle names is then one of the model's, and they are all of them (tests/models/process_laws_test.cpp).
// States that only process noise changes may be named, since that saves time: kConstant, std::array<bool, kStates>.

// The inputs of a step are their mean over it. A model whose state follows an input without lag wants them as they are at the
// step's instant, and says so: kInputsAtEnd.
template <typename M>
constexpr bool inputs_at_end() {
  if constexpr (requires { M::kInputsAtEnd; }) return M::kInputsAtEnd;
  return false;
}

template <typename M>
concept ProcessModel = requires(const M model, Vector<double, M::kStates> x, Vector<double, M::kInputs> u) {
  { M::kName } -> std::convertible_to<std::string_view>;
  { M::kStates } -> std::convertible_to<int>;
  { M::kInputs } -> std::convertible_to<int>;
  { M::kOutputs } -> std::convertible_to<int>;
  M::kStateNames;   // std::array<Quantity, kStates>
  M::kInputNames;   // std::array<Quantity, kInputs>
  M::kOutputNames;  // std::array<Quantity, kOutputs>: the quantities of the sensors it can use
  model.template derivative<double>(x, u);
  model.template output<double>(x, u);
  { model.fastest_rate_hz(x) } -> std::convertible_to<double>;  // around x; long times are divided by it; of any real scalar
  M::kLinear;  // std::array<bool, kStates>: f and h are linear in these states together, given the others
  // The state that one measured output implies, for a start on the move; false if that output does not fix a start.
  { model.start_from(0, 0.0, x) } -> std::same_as<bool>;
};

}  // namespace slipstream
