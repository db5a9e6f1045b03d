#include "estimators/ekf.hpp"

#include <memory>

namespace slipstream {

std::unique_ptr<Estimator> make_ekf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_ekf(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        return std::make_unique<Ekf<M>>(make_belief(model, scenario, tuning));
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
