// What the command lines of the study programs say.
#pragma once

#include <string>

#include "studies/desk.hpp"

namespace slipstream {

Shard parse_shard(const std::string& text);   // "2/3"; empty: everything
int parse_jobs(double jobs, int by_default);  // 0: the default

// "300 runs: 3 cases x 100, estimators pf, ukf; ..."
std::string begin_text(const Study& study, const Desk& desk, const Shard& shard, const std::string& folder);

}  // namespace slipstream
