// The two JSON files of this room: published values in, scores out.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/refusal.hpp"
#include "monitor/results.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

using Json = nlohmann::ordered_json;

// --- Published values in -----------------------------------------------------------------------------------------------

[[noreturn]] void refuse(const std::string& where, const std::string& found, const std::string& expected) {
  throw Refusal(fmt::format("{}: found {}, expected {}", where, found, expected));
}

std::string shown(const Json& value) { return plain_line(value.dump(-1, ' ', true), 40); }

const Json& member(const Json& object, const std::string& key, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end()) throw Refusal(fmt::format("{}: the key \"{}\" is missing", where, key));
  return *found;
}

std::string text_of(const Json& value, const std::string& where) {
  if (!value.is_string()) refuse(where, shown(value), "a text");
  return value.get<std::string>();
}

double number_of(const Json& value, const std::string& where) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(where, shown(value), "a number");
  return value.get<double>();
}

const Json& list_of(const Json& value, const std::string& where) {
  if (!value.is_array()) refuse(where, shown(value), "a list");
  return value;
}

void expect_object(const Json& value, const std::string& where, std::initializer_list<const char*> keys) {
  if (!value.is_object()) refuse(where, shown(value), "an object");
  for (const auto& [key, unused] : value.items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end())
      throw Refusal(fmt::format("{}: unknown key \"{}\", expected one of: {}", where, plain_line(key),
                                fmt::join(keys.begin(), keys.end(), ", ")));
  }
}

PublishedRow row_of(const Json& row, const std::string& where) {
  expect_object(row, where, {"algorithm", "tuning", "state", "metric", "noise_percent", "value", "source"});
  PublishedRow r;
  r.algorithm = text_of(member(row, "algorithm", where), where + ".algorithm");
  r.tuning = text_of(member(row, "tuning", where), where + ".tuning");
  r.metric = text_of(member(row, "metric", where), where + ".metric");
  constexpr std::array kMetrics{"r2", "rmse", "max_abs_error", "step_time_us"};
  if (std::find(kMetrics.begin(), kMetrics.end(), r.metric) == kMetrics.end())
    refuse(where + ".metric", '"' + plain_line(r.metric) + '"',
           fmt::format("one of: {}", fmt::join(kMetrics.begin(), kMetrics.end(), ", ")));
  if (row.contains("state")) r.state = text_of(row["state"], where + ".state");
  if (r.state.empty() != (r.metric == "step_time_us"))
    throw Refusal(fmt::format("{}: metric \"{}\" {}", where, r.metric,
                              r.state.empty() ? "needs the key \"state\"" : "belongs to no state, found one"));
  r.value = number_of(member(row, "value", where), where + ".value");
  r.source = text_of(member(row, "source", where), where + ".source");
  if (row.contains("noise_percent")) r.noise_percent = number_of(row["noise_percent"], where + ".noise_percent");
  return r;
}

// --- Scores out --------------------------------------------------------------------------------------------------------

// JSON has no NaN and no infinity: what is not known is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

template <typename T>
Json optional_number(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json consistency(const Consistency& c) {
  const bool is_whole = c.dimension == std::floor(c.dimension);
  return {{"dimension", is_whole ? Json(static_cast<int>(c.dimension)) : Json(c.dimension)},
          {"samples", c.samples},
          {"band_95", {number(c.band.low), number(c.band.high)}},
          {"within_band", c.samples > 0 ? Json(c.within) : Json(nullptr)}};
}

Json estimator(const EstimatorScore& s) {
  const EstimatorRecord& r = *s.record;
  Json states = Json::object();
  for (const StateColumn& state : s.states)
    states[state.name] = {{"unit", plain_line(state.unit)},
                          {"rmse", number(state.score.rmse)},
                          {"r2", number(state.score.r2)},
                          {"max_abs_error", number(state.score.max_abs_error)},
                          {"max_abs_error_at_s", number(state.max_error_s)},
                          {"samples", state.score.samples},
                          {"rmse_bound", number(state.bound.rmse_bound)},
                          {"efficiency", number(state.bound.efficiency)}};
  Json sensors = Json::object();
  for (const SensorScore& sensor : s.sensors)
    sensors[sensor.sensor] = {{"nis_mean", number(sensor.nis.mean)},
                              {"nis", consistency(sensor.nis)},
                              {"samples", sensor.samples},
                              {"gated", sensor.gated}};
  Json warnings = Json::array();
  for (const Finding& f : s.findings)
    warnings.push_back({{"text", f.text},
                        {"sensor", f.sensor},
                        {"disagrees_with", f.other.empty() ? Json(nullptr) : Json(f.other)},
                        {"cause", cause_name(f.cause)},
                        {"since_s", f.since_s},
                        {"until_s", optional_number(f.until_s)},
                        {"nis_mean", number(f.nis)},
                        {"dimension", number(f.dimension)},
                        {"measured", f.measured},
                        {"outliers", f.outliers},
                        {"gated", f.gated},
                        {"fitted", f.value}});
  Json j = {{"algorithm", r.algorithm},
            {"tuning", r.tuning},
            {"model", r.model},
            {"states", states},
            {"nees_mean", number(s.nees_score.mean)},
            {"nees", consistency(s.nees_score)},
            {"nis_mean", number(s.nis_score.mean)},
            {"nis", consistency(s.nis_score)},
            {"nis_ratio", number(s.nis_ratio)},
            {"sensors", sensors},
            {"warnings", warnings},
            {"estimates", r.utime.size()},
            {"valid", s.valid},
            {"fallback", s.fallback},
            {"invalid", s.invalid},
            {"initialising", s.initialising},
            {"messages_lost", r.sequence.lost + r.reported_lost()},
            {"late", r.late},
            {"out_of_order", r.sequence.out_of_order},
            {"rejected", r.rejected + r.reported_rejected()},
            {"step_time_us",
             {{"p50", number(s.step_times.p50)},
              {"p99", number(s.step_times.p99)},
              {"max", number(s.step_times.max)},
              {"mean", number(s.step_times.mean)}}},
            {"deadline_misses", s.step_times.deadline_misses}};
  if (s.residuals.programs > 0)
    j["kkt_residual"] = {{"programs", s.residuals.programs},
                         {"p50", number(s.residuals.p50)},
                         {"p99", number(s.residuals.p99)},
                         {"max", number(s.residuals.max)}};
  if (r.name_conflict) j["name_conflict"] = true;
  return j;
}

Json bound(const Bound& b) {
  const auto* series = std::get_if<BoundSeries>(&b);
  Json states = Json::object();
  for (std::size_t i = 0; series && i < series->states.size(); ++i) {
    double sum = 0.0;
    for (const double variance : series->variance[i]) sum += variance;
    states[series->states[i]] = {{"rmse_bound", number(std::sqrt(sum / static_cast<double>(series->utime.size())))}};
  }
  return {
      {"applies", series != nullptr}, {"why_not", series ? Json(nullptr) : Json(std::get<std::string>(b))}, {"states", states}};
}

}  // namespace

const PublishedRow* Published::find(const std::string& algorithm, const std::string& state, const std::string& metric,
                                    std::optional<double> noise_percent) const {
  for (const PublishedRow& row : rows) {
    const bool noise_agrees =
        !row.noise_percent || (noise_percent && std::abs(*row.noise_percent - *noise_percent) < 1e-9);  // rounding of 100 x
    if (row.algorithm == algorithm && row.state == state && row.metric == metric && noise_agrees) return &row;
  }
  return nullptr;
}

Published parse_published(const std::string& text, const std::string& source_name) {
  Json file;
  try {
    file = Json::parse(text);
  } catch (const nlohmann::json::parse_error& e) {
    const std::size_t at = std::min(e.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw Refusal(fmt::format("{}:{}: this is not JSON", source_name, line));
  }
  expect_object(file, source_name, {"title", "rows", "notes"});
  Published published;
  published.title = text_of(member(file, "title", source_name), source_name + ": title");
  const Json& rows = list_of(member(file, "rows", source_name), source_name + ": rows");
  for (std::size_t i = 0; i < rows.size(); ++i)
    published.rows.push_back(row_of(rows[i], fmt::format("{}: rows[{}]", source_name, i)));
  if (file.contains("notes")) {
    const Json& notes = list_of(file["notes"], source_name + ": notes");
    for (std::size_t i = 0; i < notes.size(); ++i)
      published.notes.push_back(text_of(notes[i], fmt::format("{}: notes[{}]", source_name, i)));
  }
  return published;
}

Published load_published(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw Refusal(path + ": cannot be read, expected a JSON file of published values");
  return parse_published(text.str(), path);
}

std::string scores_json(const Results& results) {
  const RunInfo& info = results.record.info();
  const double simulated_s = seconds(results.record.simulated());
  Json measurements = Json::object();
  std::int64_t lost = results.record.truth().sequence.lost;
  std::int64_t out_of_order = results.record.truth().sequence.out_of_order;
  std::int64_t late = 0;
  for (const auto& [quantity, reading] : results.record.readings()) {
    measurements[quantity] = reading.utime.size();
    lost += reading.sequence.lost;
    out_of_order += reading.sequence.out_of_order;
    late += reading.late;
  }
  Json run = {{"id", info.name},
              {"scenario", info.scenario.empty() ? Json(nullptr) : Json(info.scenario)},
              {"seed", optional_number(info.seed)},
              {"duration_s", optional_number(info.duration_s)},
              {"complete", results.board.complete},
              {"seen_from_start", results.record.seen_from_start()},
              {"clock", info.clock},
              {"simulated_s", simulated_s},
              {"noise_percent", optional_number(info.noise_percent)},
              {"deadline_s", info.deadline_s > 0.0 ? Json(info.deadline_s) : Json(nullptr)},
              {"truth_samples", results.record.truth().utime.size()},
              {"measurements", measurements},
              {"messages_lost", lost},
              {"out_of_order", out_of_order},
              {"measured_late", late},
              {"rejected", results.record.rejected()},
              {"times",
               {{"started_utc", results.times.started_utc},
                {"wall_s", results.times.wall_s},
                {"realtime_factor", number(simulated_s / results.times.wall_s)},
                {"messages_ignored", results.times.messages_ignored},
                {"messages_unusable", results.times.messages_unusable},
                {"announcements_rejected", results.record.announcements_rejected()},
                {"log_events", results.times.log_events}}}};
  Json estimators = Json::object();
  for (const EstimatorScore& s : results.board.estimators) estimators[s.name] = estimator(s);
  const Json file = {{"run", run}, {"bound", bound(results.board.bound)}, {"estimators", estimators}};
  return file.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace slipstream
