// The algorithms by name. A new one is its own .cpp with one `make_` function, and its declaration and its line in
// registry.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimators/estimator.hpp"
#include "models/scenario.hpp"

namespace slipstream {

std::vector<std::string> algorithm_names();

// Refuses an unknown algorithm, an unknown tuning, and a tuning that the algorithm cannot work with; one line each.
std::unique_ptr<Estimator> make_estimator(const std::string& algorithm, const Scenario& scenario, const std::string& tuning);

}  // namespace slipstream
