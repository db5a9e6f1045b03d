// What every writer of results reads, and the files that a run leaves.
#pragma once

#include <optional>
#include <string>

#include "monitor/published.hpp"
#include "monitor/run_record.hpp"
#include "monitor/scoreboard.hpp"

namespace slipstream {

// Everything that depends on the wall clock and on who else was on the bus.
struct WallTimes {
  std::string started_utc;             // ISO 8601
  double wall_s = 0.0;                 // from the run descriptor to the end
  std::int64_t messages_ignored = 0;   // of another run
  std::int64_t messages_unusable = 0;  // that the bus could not decode
  std::int64_t log_events = 0;
};

struct Results {
  const RunRecord& record;
  const Scoreboard& board;
  const std::optional<Published>& published;
  const WallTimes& times;
};

// scores.json: bound is the posterior Cramer-Rao bound of the run (bound.hpp): whether it applies, or why not, and its RMSE of
// each state over all samples of the truth; an estimator's rmse_bound is over its own scored instants, and its efficiency is
// (rmse_bound/rmse)^2 (scores.hpp). Keys under run.times, step_time_us and deadline_misses depend on the wall clock; everything
// else is the same for every lockstep run of a scenario. What is not known is null. An estimator's nis.dimension is the mean
// number of measurements of a step, fractional where sensors have unequal rates; nis and those of its sensors are of what was
// not gated; its warnings are what is wrong with its sensors (diagnosis.hpp), with what was fitted in m and rad; its
// name_conflict is there, and true, only if two used its name; its kkt_residual (estimate.lcm) only if it solves programs.
std::string scores_json(const Results& results);

// series.csv: one row per utime. Writes through a temporary file.
void write_series_csv(const std::string& path, const Results& results);

// report.html: self-contained. `with_figures` false leaves them out and says so.
std::string report_html(const Results& results, bool with_figures);

// Writes the whole text under a temporary name, then renames. Refuses what cannot be written.
void write_file(const std::string& path, const std::string& text);

// scenario.toml, series.csv, report.html and, last, scores.json.
void write_results(const std::string& directory, const Results& results, bool with_figures);

// Refuses a folder that cannot be made or written to: the folder itself is made only when a run begins.
void require_writable(const std::string& directory);

// Where results that make room for another run's go: earlier-1, earlier-2 ..., the first that is free. There is no last one,
// because nothing that was recorded may be overwritten; a full disk says so itself.
std::string earlier_directory(const std::string& directory);

// What an earlier run left in the directory under these names.
void remove_results(const std::string& directory);

}  // namespace slipstream
