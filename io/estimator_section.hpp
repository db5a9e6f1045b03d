// The tables [estimator...] and [tuning...] of a scenario: what the estimators believe.
#pragma once

#include "io/toml_reader.hpp"
#include "models/scenario.hpp"

namespace slipstream {

// Fills scenario.estimator; vehicle and sensors must have been read before.
void read_estimator(TomlTable& root, Scenario& scenario, const TextForm& name_form);

}  // namespace slipstream
