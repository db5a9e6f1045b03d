#include "estimators/rbpf.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_rbpf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_rbpf(const Scenario& scenario, const Tuning& tuning) {
  return make_particle_estimator<RaoBlackwellisedFilter>(scenario, tuning, "rbpf");
}

}  // namespace slipstream
