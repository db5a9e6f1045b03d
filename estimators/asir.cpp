#include "estimators/asir.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_asir(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_asir(const Scenario& scenario, const Tuning& tuning) {
  return make_particle_estimator<AuxiliaryParticleFilter>(scenario, tuning, "asir");
}

}  // namespace slipstream
