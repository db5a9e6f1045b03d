#include "estimators/sqrt_ukf.hpp"

#include <memory>

namespace slipstream {

std::unique_ptr<Estimator> make_sqrt_ukf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_sqrt_ukf(const Scenario& scenario, const Tuning& tuning) {
  return make_unscented<RootSpread>(scenario, tuning);
}

}  // namespace slipstream
