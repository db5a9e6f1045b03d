// The estimated measurements, z^ = h(x^) after the update, of a scenario played in process: for scores where nothing but the
// measurements is known.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "tests/support/in_process.hpp"

namespace slipstream::test {

// One value per instant of `played`; empty if the tuning's model has no output of that name.
inline std::vector<double> estimated_output(const Played& played, const Scenario& scenario, const std::string& tuning,
                                            const std::string& output) {
  const Tuning& t = scenario.estimator.tunings.at(tuning);
  return std::visit(
      [&]<typename M>(const M& model) {
        const auto outputs = estimated_outputs(model, played);
        for (std::size_t i = 0; i < outputs.size(); ++i)
          if (M::kOutputNames[i].name == output) return outputs[i];
        return std::vector<double>{};
      },
      t.process ? *t.process : scenario.estimator.process);
}

}  // namespace slipstream::test
