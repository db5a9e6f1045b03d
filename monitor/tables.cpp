#include "monitor/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "monitor/angles.hpp"
#include "monitor/innovation_sensors.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

std::string or_dash(const std::string& text) { return text.empty() ? "-" : text; }

const PublishedRow* published_row(const Results& results, const EstimatorScore& s, const std::string& state,
                                  const std::string& metric) {
  if (!results.published) return nullptr;
  return results.published->find(s.record->algorithm, state, metric, results.record.info().noise_percent);
}

// "0.9639 (document)": the tuning it was published with is part of the number.
std::string published_text(const PublishedRow* row, bool is_r2) {
  if (!row) return "-";
  return (is_r2 && row->value != 1.0 ? fmt::format("{:.4f}", row->value) : number_text(row->value, 6)) +
         (row->tuning.empty() ? "" : fmt::format(" ({})", plain_line(row->tuning, 16)));
}

std::string band_text(const Consistency& c) {
  return c.samples == 0 ? "-" : fmt::format("{:.3f}..{:.3f}", c.band.low, c.band.high);
}

std::string verdict(const Consistency& c) {
  if (c.samples == 0) return "-";
  return c.within ? "inside" : c.mean < c.band.low ? "below" : "above";
}

// R2 next to 1 needs its distance from 1.
std::string r2_text(double r2) { return std::isfinite(r2) ? fmt::format("{:.5f}", r2) : "-"; }

std::string microseconds(double t) { return std::isfinite(t) ? fmt::format("{:.1f}", t) : "-"; }

}  // namespace

Table accuracy_table(const Results& results) {
  Table table{"Accuracy",
              {{"state", false}, {"estimator", false}, {"tuning", false}, {"R2"}, {"RMSE"}, {"largest error"}, {"at (s)"}},
              {}};
  if (results.published) table.columns.insert(table.columns.begin() + 4, {"R2 published", true});
  const bool has_bound = no_bound_text(results.board).empty();
  if (has_bound) table.columns.push_back({"efficiency"});
  std::vector<std::string> names;
  for (const EstimatorScore& s : results.board.estimators)
    for (const StateColumn& state : s.states)
      if (std::find(names.begin(), names.end(), state.name) == names.end()) names.push_back(state.name);
  for (const std::string& name : names) {
    for (const EstimatorScore& s : results.board.estimators) {
      for (const StateColumn& state : s.states) {
        if (state.name != name) continue;
        const double scale = shown_scale(state.unit);
        std::vector<std::string> row{axis_label(name, shown_unit(state.unit)), s.name, or_dash(s.record->tuning),
                                     r2_text(state.score.r2)};
        if (results.published) row.push_back(published_text(published_row(results, s, name, "r2"), true));
        row.push_back(number_text(scale * state.score.rmse));
        row.push_back(number_text(scale * state.score.max_abs_error));
        row.push_back(std::isfinite(state.max_error_s) ? fmt::format("{:.2f}", state.max_error_s) : "-");
        if (has_bound) row.push_back(number_text(state.bound.efficiency, 3));
        table.rows.push_back(std::move(row));
      }
    }
  }
  return table;
}

Table consistency_table(const Results& results) {
  Table table{"Consistency",
              {{"estimator", false},
               {"NEES"},
               {"n"},
               {"95 % band"},
               {"mean is"},
               {"NIS"},
               {"m"},
               {"95 % band"},
               {"mean is"},
               {"NIS/m, all"}},
              {}};
  for (const EstimatorScore& s : results.board.estimators)
    table.rows.push_back({s.name, number_text(s.nees_score.mean), number_text(s.nees_score.dimension, 3),
                          band_text(s.nees_score), verdict(s.nees_score), number_text(s.nis_score.mean),
                          number_text(s.nis_score.dimension, 3), band_text(s.nis_score), verdict(s.nis_score),
                          number_text(s.nis_ratio)});
  return table;
}

Table sensor_table(const Results& results) {
  Table table{"Consistency of each sensor",
              {{"estimator", false}, {"sensor", false}, {"measured"}, {"gated"}, {"NIS"}, {"m"}, {"95 % band"}, {"mean is"}},
              {}};
  for (const EstimatorScore& s : results.board.estimators)
    for (const SensorScore& sensor : s.sensors)
      table.rows.push_back({s.name, sensor_label(sensor.sensor), fmt::format("{}", sensor.samples),
                            fmt::format("{}", sensor.gated), number_text(sensor.nis.mean), number_text(sensor.nis.dimension, 3),
                            band_text(sensor.nis), verdict(sensor.nis)});
  return table;
}

Table timing_table(const Results& results) {
  Table table{"Time a step, microseconds",
              {{"estimator", false}, {"algorithm", false}, {"mean"}, {"p50"}, {"p99"}, {"max"}, {"deadline"}, {"missed"}},
              {}};
  if (results.published) table.columns.push_back({"published"});
  const double deadline_s = results.record.info().deadline_s;
  for (const EstimatorScore& s : results.board.estimators) {
    const StepTimes& t = s.step_times;
    std::vector<std::string> row{s.name,
                                 or_dash(s.record->algorithm),
                                 microseconds(t.mean),
                                 microseconds(t.p50),
                                 microseconds(t.p99),
                                 microseconds(t.max),
                                 deadline_s > 0.0 ? number_text(deadline_s * 1e6, 7) : "-",
                                 fmt::format("{}", t.deadline_misses)};
    if (results.published) row.push_back(published_text(published_row(results, s, "", "step_time_us"), false));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table delivery_table(const Results& results) {
  Table table{"Estimates and messages",
              {{"estimator", false},
               {"valid"},
               {"fallback"},
               {"invalid"},
               {"initialising"},
               {"lost"},
               {"late"},
               {"out of order"},
               {"rejected"}},
              {}};
  const bool solves = std::any_of(results.board.estimators.begin(), results.board.estimators.end(),
                                  [](const EstimatorScore& s) { return s.residuals.programs > 0; });
  if (solves) {
    table.columns.push_back({"KKT p50"});
    table.columns.push_back({"KKT max"});
  }
  for (const EstimatorScore& s : results.board.estimators) {
    const EstimatorRecord& r = *s.record;
    std::vector<std::string> row{s.name};
    for (const std::int64_t count : {s.valid, s.fallback, s.invalid, s.initialising, r.sequence.lost + r.reported_lost(),
                                     r.late, r.sequence.out_of_order, r.rejected + r.reported_rejected()})
      row.push_back(fmt::format("{}", count));
    if (solves) {
      row.push_back(number_text(s.residuals.p50));
      row.push_back(number_text(s.residuals.max));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<std::string> warning_lines(const Scoreboard& board) {
  std::vector<std::pair<std::string, std::string>> said;  // sentence, names
  for (const EstimatorScore& s : board.estimators)
    for (const Finding& f : s.findings) {
      const auto same = std::find_if(said.begin(), said.end(), [&](const auto& line) { return line.first == f.text; });
      if (same == said.end())
        said.emplace_back(f.text, s.name);
      else
        same->second += ", " + s.name;
    }
  std::vector<std::string> lines;
  for (const auto& [text, names] : said) lines.push_back(fmt::format("{}: {}", names, text));
  return lines;
}

std::string no_bound_text(const Scoreboard& board) {
  const std::string* reason = std::get_if<std::string>(&board.bound);
  return reason ? fmt::format("No bound: {}.", *reason) : "";
}

std::string to_text(const Table& table, std::size_t width) {
  const std::size_t n = table.columns.size();
  // Display columns: bytes that do not continue a UTF-8 character.
  const auto length = [](const std::string& s) {
    return static_cast<std::size_t>(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  };
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t w = length(table.columns[c].title);
    for (const auto& row : table.rows) w = std::max(w, length(row[c]));
    widths.push_back(w);
  }
  const auto total = [&] { return std::accumulate(widths.begin(), widths.end(), 2 * (n - 1)); };
  while (total() > width) {
    std::size_t widest = n;
    for (std::size_t c = 0; c < n; ++c)
      if (!table.columns[c].is_number && widths[c] > 6 && (widest == n || widths[c] > widths[widest])) widest = c;
    if (widest == n) break;  // numbers are never cut
    --widths[widest];
  }
  const auto line = [&](const auto& cell) {
    std::string text;
    for (std::size_t c = 0; c < n; ++c) {
      std::string value = cell(c);
      if (length(value) > widths[c]) value = plain_line(value).substr(0, widths[c] - 1) + "~";
      const std::string padding(widths[c] - length(value), ' ');
      text += (c > 0 ? "  " : "") + (table.columns[c].is_number ? padding + value : value + padding);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    return text + "\n";
  };
  std::string text = line([&](std::size_t c) { return table.columns[c].title; });
  for (const auto& row : table.rows) text += line([&](std::size_t c) { return row[c]; });
  return text;
}

std::string to_html(const Table& table) {
  std::string html = fmt::format("<table>\n<caption>{}</caption>\n<thead><tr>", html_escape(table.title));
  for (const Table::Column& column : table.columns)
    html += fmt::format("<th scope=\"col\"{}>{}</th>", column.is_number ? " class=\"number\"" : "", html_escape(column.title));
  html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c)
      html += fmt::format("<td{}>{}</td>", table.columns[c].is_number ? " class=\"number\"" : "", html_escape(row[c]));
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table>\n";
}

}  // namespace slipstream
