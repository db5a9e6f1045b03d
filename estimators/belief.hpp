// What an estimator believes, as numbers: its process model, its noise and its start. Built once from a scenario.
//
// Process noise is diagonal. "density": Q(dt) = q dt with q a variance per second (continuous white noise, discretised to first
// order). "step": Q is the discrete covariance of one step whatever its length.
// Measurement noise is diagonal: each sensor's own law (noise.hpp), or a given variance.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "common/refusal.hpp"
#include "estimators/estimator.hpp"
#include "models/process.hpp"
#include "models/scenario.hpp"

namespace slipstream {

template <ProcessModel M>
struct Belief {
  static constexpr int n = M::kStates;
  static constexpr int m = M::kOutputs;
  static_assert(n <= kMaxStates && m <= kMaxOutputs && M::kInputs <= kMaxInputs);

  M model;
  std::array<NoiseLaw, m> noise{};
  Vector<double, n> process_variance = Vector<double, n>::Zero();
  bool process_per_step = false;
  Vector<double, n> initial_mean = Vector<double, n>::Zero();
  Vector<double, n> initial_variance = Vector<double, n>::Zero();
  Vector<double, n> lower = Vector<double, n>::Constant(-std::numeric_limits<double>::infinity());
  Vector<double, n> upper = Vector<double, n>::Constant(std::numeric_limits<double>::infinity());

  Vector<double, n> process_covariance(double dt_s) const {
    return process_per_step ? process_variance : Vector<double, n>(process_variance * dt_s);
  }
};

namespace belief_detail {
template <std::size_t Count>
Vector<double, static_cast<int>(Count)> by_name(const std::map<std::string, double>& values,
                                                const std::array<Quantity, Count>& names, double otherwise) {
  Vector<double, static_cast<int>(Count)> result;
  for (std::size_t i = 0; i < Count; ++i) {
    const auto found = values.find(std::string(names[i].name));
    result[static_cast<int>(i)] = found == values.end() ? otherwise : found->second;
  }
  return result;
}
}  // namespace belief_detail

// Refuses a sensor without noise where the tuning takes the sensors' own. The law of an output that no sensor measures stays
// empty. Maps may leave states out: variance 0, mean 0, no bound.
template <ProcessModel M>
Belief<M> make_belief(const M& model, const Scenario& scenario, const Tuning& tuning) {
  using belief_detail::by_name;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Belief<M> b;
  b.model = model;
  const auto given = by_name(tuning.measurement_variance, M::kOutputNames, -1.0);
  for (std::size_t i = 0; i < M::kOutputNames.size(); ++i) {
    if (tuning.measurement_noise == "given" && given[static_cast<int>(i)] >= 0.0) {
      b.noise[i] = {0.0, std::sqrt(given[static_cast<int>(i)])};
      continue;
    }
    for (const SensorConfig& s : scenario.sensors) {
      if (s.quantity != M::kOutputNames[i].name) continue;
      if (s.noise.relative == 0.0 && s.noise.absolute == 0.0)
        throw Refusal("sensor." + s.type +
                      ": has no noise, which no estimator can weigh; give it some, or let the tuning say " +
                      "measurement_noise = \"given\"");
      b.noise[i] = s.noise;
    }
  }
  b.process_variance = by_name(tuning.process_variance, M::kStateNames, 0.0);
  b.process_per_step = tuning.process_noise == "step";
  b.initial_mean = by_name(tuning.initial_mean, M::kStateNames, 0.0);
  b.initial_variance = by_name(tuning.initial_variance, M::kStateNames, 0.0);
  b.lower = by_name(scenario.estimator.lower_bound, M::kStateNames, -kInfinity);
  b.upper = by_name(scenario.estimator.upper_bound, M::kStateNames, kInfinity);
  return b;
}

}  // namespace slipstream
