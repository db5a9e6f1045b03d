#include "estimators/particle_filter.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning) {
  return make_particle_estimator<ParticleFilter>(scenario, tuning, "pf");
}

}  // namespace slipstream
