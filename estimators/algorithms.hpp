// One line per algorithm: defined in the .cpp of its name, listed in registry.cpp.
#pragma once

#include <memory>

#include "estimators/estimator.hpp"
#include "models/scenario.hpp"

namespace slipstream {

std::unique_ptr<Estimator> make_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_mhe(const Scenario& scenario, const Tuning& tuning);

}  // namespace slipstream
