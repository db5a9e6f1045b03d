// What the study programs have in common, whoever computes: what is said, and how a call ends.
#pragma once

#include <functional>
#include <string>

#include "studies/desk.hpp"

namespace slipstream {

// Computes what the desk hands out in `jobs` processes of this machine. False if it was interrupted.
bool conduct(const Study& study, Desk& desk, int jobs, const std::function<bool()>& interrupted);

// After the last item: the summary, if everything of the whole study is there or has failed. Refuses at the end where items
// have failed or the call was interrupted.
void conclude(const Study& study, const std::string& folder, const Shard& shard, Desk& desk, bool complete,
              const Desk::Say& say);

// Lines of several folders or files, beside each of which lies its study.toml, become one folder. `partial`: also if some are
// missing.
void merge_runs(const Study& study, const std::vector<std::string>& files, const std::string& folder, bool partial,
                const Desk::Say& say);

}  // namespace slipstream
