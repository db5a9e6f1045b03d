#include "monitor/live_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "monitor/angles.hpp"
#include "monitor/tables.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr std::ptrdiff_t kRecentSteps = 200;  // of the p50 that the live table shows

const char* state_name(RunState state) {
  switch (state) {
    case RunState::kRunning:
      return "running";
    case RunState::kPaused:
      return "paused";
    case RunState::kStopped:
      return "stopped";
    case RunState::kEnded:
      return "ended";
  }
  return "?";
}

std::string standing(const EstimatorRecord& r) {
  if (r.presence == Presence::kLeft) return "left";
  if (!r.status) return "joined";
  return status_name(*r.status);
}

// A line that wraps would break the redrawing: what does not fit is left out.
std::string cut_lines(const std::string& text, std::size_t width) {
  std::string result;
  std::size_t column = 0;
  for (const char c : text) {
    const bool starts_character = (c & 0xC0) != 0x80;
    if (c == '\n') {
      column = 0;
    } else if (starts_character) {
      ++column;
    }
    if (column <= width) result += c;
  }
  return result;
}

double recent_p50(const std::vector<double>& step_time_us) {
  std::vector<double> recent(step_time_us.end() - std::min(kRecentSteps, std::ssize(step_time_us)), step_time_us.end());
  std::erase_if(recent, [](double t) { return !std::isfinite(t); });
  return percentile(std::move(recent), 0.5);
}

}  // namespace

std::string LiveTable::lines(const RunRecord& run, std::size_t width) {
  const RunInfo& info = run.info();
  std::string head = fmt::format("{}  {}  {:.2f}", plain_line(info.name), plain_line(info.clock), seconds(run.simulated()));
  head += info.duration_s ? fmt::format(" of {:g} s  {}", *info.duration_s, state_name(run.state()))
                          : fmt::format(" s  {}", state_name(run.state()));
  if (const std::vector<double>* gear = run.truth_column("gear"); gear && !gear->empty() && std::isfinite(gear->back()))
    head += fmt::format("  gear {:g}", gear->back());
  std::string text = head + "\n";

  Table table{"", {{"estimator", false}, {"algorithm/tuning", false}, {"status", false}}, {}};
  std::vector<std::string> names;
  for (const auto& [name, r] : run.estimators())
    for (const std::string& state : r.state_names)
      if (names.size() < 4 && std::find(names.begin(), names.end(), state) == names.end()) names.push_back(state);
  for (const std::string& name : names) table.columns.push_back({"rmse " + plain_line(readable_name(name), 11)});
  for (const char* title : {"NIS/m", "p50 us", "lost"}) table.columns.push_back({title});
  for (const auto& [name, r] : run.estimators()) {
    RunningScore& score = scores_[name];
    score.update(run, r);
    std::vector<std::string> row{name, r.algorithm.empty() ? "-" : r.algorithm + "/" + r.tuning, standing(r)};
    for (const std::string& state : names) {
      const auto found = std::find(r.state_names.begin(), r.state_names.end(), state);
      const bool has_it = found != r.state_names.end();
      const auto i = static_cast<std::size_t>(found - r.state_names.begin());
      row.push_back(has_it ? number_text(shown_scale(r.state_units[i]) * score.rmse(i), 3) : "-");
    }
    row.push_back(number_text(score.nis_ratio(), 3));
    const double p50 = recent_p50(r.step_time_us);
    row.push_back(std::isfinite(p50) ? fmt::format("{:.0f}", p50) : "-");
    row.push_back(fmt::format("{}", r.sequence.lost + r.reported_lost()));
    table.rows.push_back(std::move(row));
  }
  std::string warnings;
  for (const auto& [name, r] : run.estimators()) {
    Health& health = health_[name];
    health.update(r);
    for (const std::string& line : health.present()) warnings += wrapped(fmt::format("! {}: {}", name, line), width, 2) + "\n";
  }
  text += table.rows.empty() ? "waiting for estimators\n" : to_text(table, width);
  return cut_lines(text + warnings, width);
}

std::string LiveTable::redraw(const RunRecord& run, std::size_t width) {
  const std::string text = lines(run, width);
  std::string out = lines_written_ > 0 ? fmt::format("\x1b[{}A\r", lines_written_) : "";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    out += "\x1b[2K" + text.substr(begin, end + 1 - begin);  // clears the line first
    begin = end + 1;
  }
  out += "\x1b[J";
  lines_written_ = static_cast<int>(std::count(text.begin(), text.end(), '\n'));
  return out;
}

std::string scoreboard_text(const Results& results, std::size_t width) {
  const RunInfo& info = results.record.info();
  std::string text = fmt::format("run {} ({}, {}{}), {:g} s simulated\n", plain_line(info.name),
                                 results.board.complete ? "complete" : "INCOMPLETE", plain_line(info.clock),
                                 info.seed ? fmt::format(", seed {}", *info.seed) : "", seconds(results.record.simulated()));
  if (results.board.estimators.empty()) return text + "no estimator took part\n";
  for (const Table& table : {accuracy_table(results), consistency_table(results), sensor_table(results), timing_table(results),
                             delivery_table(results)})
    text += "\n" + table.title + "\n" + to_text(table, width);
  if (const std::string none = no_bound_text(results.board); !none.empty()) text += "\n" + wrapped(none, width, 2) + "\n";
  std::string warnings;
  for (const std::string& line : warning_lines(results.board)) warnings += wrapped(line, width, 2) + "\n";
  if (!warnings.empty()) text += "\nWarnings\n" + warnings;
  if (results.published) text += "\nPublished: " + plain_line(results.published->title, width - 11) + "\n";
  return text;
}

}  // namespace slipstream
