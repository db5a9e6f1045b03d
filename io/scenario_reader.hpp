// Scenario files: TOML to models/scenario.hpp, strictly. scenarios/unimog.toml explains every key.
//
// A file may name another one with `base = "other.toml"` (relative to itself): that one is read first and this one laid over
// it. Tables are merged key by key, anything else is replaced; a table whose `type` changes is replaced whole.
//
// Every refusal is a Refusal with one line "FILE:LINE:COLUMN: ...", FILE being the one that holds the wrong value.
#pragma once

#include <string>
#include <vector>

#include "models/scenario.hpp"

namespace slipstream {

struct LoadedScenario {
  Scenario scenario;
  std::string resolved_toml;  // every default filled in; reads back to exactly this scenario and this text

  // Names the experiment, not the start: the same resolved scenario gives the same name.
  std::string run_name() const;
};

// Overrides are "run.seed=7": a dotted key and a TOML value; a bare word is text. They are laid over the file in their order.
LoadedScenario load_scenario_file(const std::string& path, const std::vector<std::string>& overrides = {});

// `source_name` stands for the file in error lines. The text is self-contained: `base` is refused.
LoadedScenario load_scenario_text(const std::string& toml, const std::string& source_name,
                                  const std::vector<std::string>& overrides = {});

// The file with its bases and the overrides as one text without a base, in which nothing is resolved yet: overrides of a later
// reading have the same effect as on the file. Of a simulated drive only.
std::string flat_scenario_file(const std::string& path, const std::vector<std::string>& overrides = {});

// What one estimator believes instead: the keys in [estimator...] and [tuning...] of the file are laid over the scenario's.
// Other tables are refused.
LoadedScenario with_estimator_config(const LoadedScenario& loaded, const std::string& path);

}  // namespace slipstream
