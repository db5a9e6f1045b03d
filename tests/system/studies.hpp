// Small studies for the tests of the programs that play them, and what is found of them afterwards.
#pragma once

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/system/bench.hpp"

namespace slipstream::test {

// A point mass for half a second, followed by an EKF: about half a millisecond a run. Line 8 is the first of `more`.
inline std::string write_study(const Bench& bench, int runs, const std::string& more = "") {
  static int number = 0;
  return bench.folder.write("study-" + std::to_string(number++) + ".toml",
                            "name = \"small\"\nruns = " + std::to_string(runs) +
                                "\nseed = 7\n[[scenario]]\nfile = \"" SLIPSTREAM_SOURCE_DIR
                                "/scenarios/point_mass.toml\"\nset = [\"run.duration_s=0.5\"]\n[estimator.ekf]\n" +
                                more);
}

inline std::string results_of(const Bench& bench, const std::string& out) { return text_of(bench.path(out + "/results.json")); }

// The lines of a file of runs without the wall clock, sorted.
inline std::vector<std::string> sorted_lines(const std::string& path) {
  std::istringstream in(text_of(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line.substr(0, line.find("\"step_time_us\"")));
  std::sort(lines.begin(), lines.end());
  return lines;
}

// Waits until some runs are written.
inline bool begun(const std::string& out) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (std::chrono::steady_clock::now() < limit) {
    std::error_code none;
    const auto size = std::filesystem::file_size(out + "/runs.jsonl", none);
    if (!none && size > 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

// Processes of this program whose command line holds `text`.
inline std::vector<pid_t> children_named(const std::string& program, const std::string& text) {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::string command = text_of(entry.path().string() + "/cmdline");
    std::replace(command.begin(), command.end(), '\0', ' ');
    if (command.find(program) != std::string::npos && command.find(text + " ") != std::string::npos)
      found.push_back(static_cast<pid_t>(std::stol(name)));
  }
  return found;
}

// What still runs with this folder, once a moment has passed.
inline std::string survivors(const std::string& out) {
  for (int i = 0; i < 100; ++i) {
    if (children_named("slipstream-study", out).empty()) return "";
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::string text;
  for (const pid_t pid : children_named("slipstream-study", out)) text += " " + std::to_string(pid);
  return text;
}

}  // namespace slipstream::test
