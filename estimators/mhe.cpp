#include "estimators/mhe.hpp"

#include <fmt/format.h>

#include <memory>

#include "estimators/rti.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_mhe(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_mhe(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        const Belief<M> belief = make_belief(model, scenario, tuning);
        const bool real_time = tuning.mhe_solver == "rti";
        if (tuning.mhe_form == "single_shooting") {
          const Belief<M> weighted = weights_as_noise(belief, tuning);
          const auto arrival_weight = belief_detail::by_name(tuning.arrival_weight, M::kStateNames, 0.0);
          if (real_time) return std::make_unique<RtiSingleShooting<M>>(weighted, tuning.mhe_window, arrival_weight);
          return std::make_unique<MheSingleShooting<M>>(weighted, tuning.mhe_window, arrival_weight);
        }
        for (int k = 0; k < M::kStates; ++k)
          if (belief.initial_variance[k] <= 0.0)
            throw Refusal(fmt::format("tuning: initial_variance.{} is {}, expected a number greater than 0 for mhe",
                                      M::kStateNames[static_cast<std::size_t>(k)].name, belief.initial_variance[k]));
        if (real_time) return std::make_unique<RtiMhe<M>>(belief, tuning.mhe_window);
        return std::make_unique<Mhe<M>>(belief, tuning.mhe_window);
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
