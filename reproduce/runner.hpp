// Runs experiments side by side, each in a process of its own: Ipopt is not safe to use from several threads, and one that
// fails takes nothing else down. What is finished is on disk at once.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "reproduce/experiment.hpp"

namespace slipstream {

struct RunnerHooks {
  std::function<bool()> interrupted;
  // Every second, and whenever something changes.
  struct Activity {
    std::string experiment;
    int done = 0, total = 0;
  };
  std::function<void(const std::vector<Activity>& running, std::size_t finished, std::size_t all)> progress;
  std::function<void(const std::string& experiment, const std::string& error, double elapsed_s)> finished;  // error empty: well
};

// Runs them, at most `jobs` at a time, the longest first; writes their parts. False if it was interrupted.
bool run_experiments(const std::vector<const Experiment*>& todo, const Bench& bench, const std::string& out,
                     const std::string& key, int jobs, const RunnerHooks& hooks);

}  // namespace slipstream
