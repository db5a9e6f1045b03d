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
        std::vector<double> column;
        for (int i = 0; i < M::kOutputs; ++i) {
          if (M::kOutputNames[static_cast<std::size_t>(i)].name != output) continue;
          for (std::size_t k = 0; k < played.estimates.size(); ++k) {
            Vector<double, M::kInputs> u;
            for (int j = 0; j < M::kInputs; ++j) u[j] = played.readings[k][static_cast<std::size_t>(j)];  // inputs come first
            const Vector<double, M::kStates> x = Eigen::Map<const Vector<double, M::kStates>>(played.estimates[k].mean.data());
            column.push_back(model.template output<double>(x, u)[i]);
          }
        }
        return column;
      },
      t.process ? *t.process : scenario.estimator.process);
}

}  // namespace slipstream::test
