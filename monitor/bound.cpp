#include "monitor/bound.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <type_traits>

#include "common/check.hpp"
#include "models/scenario.hpp"
#include "monitor/bound_recursion.hpp"

namespace slipstream {
namespace {

// The numbers and flags among a struct's parameters (common/parameters.hpp), by key.
struct ParameterValues {
  std::map<std::string, double> value;

  template <typename T>
  void number(const std::string& key, const T& field, const Range&) {
    value[key] = static_cast<double>(field);
  }
  void flag(const std::string& key, bool field) { value[key] = field ? 1.0 : 0.0; }
  template <typename... Ts>
  void list(const Ts&...) {}
  template <typename... Ts>
  void triple(const Ts&...) {}
  template <typename... Ts>
  void choice(const Ts&...) {}
  template <typename... Ts>
  void choices(const Ts&...) {}
};

template <typename P>
std::map<std::string, double> parameters_of(const P& p) {
  ParameterValues values;
  P::visit_parameters(p, values);
  return values.value;
}

template <typename M>
constexpr bool kSaysWhatItIs = requires {
  M::kExactFor;
};

// Why the model's equations are not the plant's; empty if they are.
template <ProcessModel M, Vehicle V>
std::string mismatch(const M& model, const V& vehicle) {
  const std::map<std::string, double> plant = parameters_of(vehicle);
  std::vector<std::string_view> held;
  for (const Quantity& state : M::kStateNames)
    if (plant.contains(std::string(state.name))) held.push_back(state.name);
  if (!held.empty())
    return fmt::format("the plant '{}' holds {} fixed, which the model '{}' has among its states", V::kName,
                       fmt::join(held, " and "), M::kName);
  if constexpr (kSaysWhatItIs<M>) {
    if (M::kExactFor == V::kName) {
      for (const auto& [key, value] : parameters_of(model))
        if (const auto own = plant.find(key); own != plant.end() && own->second != value)
          return fmt::format("{} is {} in estimator.model and {} in the plant, whose own equations the bound needs", key, value,
                             own->second);
      return "";
    }
  }
  return fmt::format("the model '{}' is not what the plant '{}' does, whose own equations the bound needs", M::kName, V::kName);
}

// How a sensor errs beyond its noise; empty if it does not.
std::string other_error(const SensorErrors& e) {
  if (e.scale != 1.0) return fmt::format("a scale of {:g}", e.scale);
  if (e.bias != 0.0) return fmt::format("a bias of {:g}", e.bias);
  if (e.quantum != 0.0) return fmt::format("a quantum of {:g}", e.quantum);
  if (e.delay_s != 0.0) return fmt::format("a delay of {:g} s", e.delay_s);
  return "";
}

// Then every 1/rate_hz is the time of a sample of the truth.
bool is_multiple(double truth_rate_hz, double rate_hz) {
  const double times = truth_rate_hz / rate_hz;
  return times >= 0.5 && std::abs(times - std::round(times)) < 1e-9 * times;  // rounding of rates like 1/3 Hz
}

std::string rate_mismatch(const std::string& who, double rate_hz, double truth_rate_hz) {
  return fmt::format("{} at {:g} Hz and truth_rate_hz is {:g}, but the bound needs the truth at all of these instants", who,
                     rate_hz, truth_rate_hz);
}

// The model's output that a sensor measures; -1: none.
template <ProcessModel M>
int output_of(const SensorConfig& sensor) {
  for (int i = 0; i < M::kOutputs; ++i)
    if (M::kOutputNames[static_cast<std::size_t>(i)].name == sensor.quantity) return i;
  return -1;
}

template <ProcessModel M>
std::string why_not(const Scenario& scenario) {
  const PlantConfig& plant = scenario.plant;
  const bool is_pushed =
      std::any_of(plant.process_noise.begin(), plant.process_noise.end(), [](const auto& item) { return item.second > 0.0; });
  if (!is_pushed)
    return "the plant has no process noise: once its start is known so is its state, and the least error is or becomes zero";
  if (!is_multiple(plant.truth_rate_hz, plant.process_noise_rate_hz))
    return rate_mismatch("the plant is pushed", plant.process_noise_rate_hz, plant.truth_rate_hz);
  for (const SensorConfig& sensor : scenario.sensors) {
    if (output_of<M>(sensor) < 0) continue;
    if (const std::string error = other_error(sensor.errors); !error.empty())
      return fmt::format("[sensor.{}] has {}, and the bound is for sensors that err by their noise only", sensor.type, error);
    if (sensor.noise.variance(1.0) == 0.0) return fmt::format("[sensor.{}] has no noise", sensor.type);
    if (!is_multiple(plant.truth_rate_hz, sensor.rate_hz))
      return rate_mismatch(fmt::format("[sensor.{}] measures", sensor.type), sensor.rate_hz, plant.truth_rate_hz);
  }
  return "";
}

// Variances of the states that are named; every name is a state's.
template <ProcessModel M>
Vector<double, M::kStates> variances(const std::map<std::string, double>& deviation) {
  Vector<double, M::kStates> result = Vector<double, M::kStates>::Zero();
  std::size_t found = 0;
  for (int i = 0; i < M::kStates; ++i)
    if (const auto d = deviation.find(std::string(M::kStateNames[static_cast<std::size_t>(i)].name)); d != deviation.end()) {
      result[i] = d->second * d->second;
      ++found;
    }
  SLIPSTREAM_CHECK(found == deviation.size());
  return result;
}

template <ProcessModel M>
Bound bound_of(const M& model, const Scenario& scenario, const TrueRun& run) {
  BoundProblem<M> problem;
  problem.model = model;
  problem.start_variance = variances<M>(scenario.plant.start_deviation);
  problem.push_variance = variances<M>(scenario.plant.process_noise);
  problem.push_rate_hz = scenario.plant.process_noise_rate_hz;
  for (const SensorConfig& sensor : scenario.sensors)
    if (const int output = output_of<M>(sensor); output >= 0) problem.sensors.push_back({output, sensor.noise, sensor.rate_hz});
  return trajectory_bound(problem, run);
}

}  // namespace

const std::vector<double>* BoundSeries::of(const std::string& state) const {
  const auto found = std::find(states.begin(), states.end(), state);
  return found == states.end() ? nullptr : &variance[static_cast<std::size_t>(found - states.begin())];
}

std::optional<std::string> why_no_bound(const Scenario& scenario) {
  if (scenario.recorded) return "the drive is recorded: what disturbed it and how its sensors err is not known";
  if (scenario.estimator.strapdown)
    return "the inputs of a strapdown model are an IMU's noisy readings, and the bound needs true ones";
  std::string reason = std::visit([](const auto& model, const auto& vehicle) { return mismatch(model, vehicle); },
                                  scenario.estimator.process, scenario.plant.vehicle);
  if (reason.empty())
    reason = std::visit([&]<typename M>(const M&) { return why_not<M>(scenario); }, scenario.estimator.process);
  if (reason.empty()) return std::nullopt;
  return reason;
}

Bound posterior_bound(const Scenario& scenario, const TrueRun& run) {
  if (std::optional<std::string> reason = why_no_bound(scenario)) return *std::move(reason);
  return std::visit(
      [&]<typename M>(const M& model) -> Bound {
        if constexpr (kSaysWhatItIs<M>) return bound_of(model, scenario, run);
        SLIPSTREAM_CHECK(false);  // mismatch() has refused it
        return std::string();
      },
      scenario.estimator.process);
}

}  // namespace slipstream
