#include "estimators/ukf.hpp"

#include <memory>

namespace slipstream {

std::unique_ptr<Estimator> make_ukf(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_ukf(const Scenario& scenario, const Tuning& tuning) {
  return make_unscented<SquaredSpread>(scenario, tuning);
}

}  // namespace slipstream
