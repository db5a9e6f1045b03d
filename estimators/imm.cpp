#include "estimators/imm.hpp"

#include <memory>

#include "common/refusal.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_imm(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_imm(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        if constexpr (SwitchingModel<M>)
          return std::make_unique<Imm<M>>(make_belief(model, scenario, tuning));
        else
          throw Refusal("imm: works on model tyre_friction only; the scenario's is " + std::string(M::kName));
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
