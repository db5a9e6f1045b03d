#include "estimators/particle_filter.hpp"

#include <memory>

namespace slipstream {

std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        return std::make_unique<ParticleFilter<M>>(make_belief(model, scenario, tuning), tuning.pf_particles,
                                                   tuning.pf_resample_below, tuning.pf_recover,
                                                   RandomStream(scenario.run.seed, 0, "estimator.pf"));
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
