// The one file of the room that names the JSON library: lines of runs, and results.json.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "studies/run_line.hpp"
#include "studies/summary.hpp"

namespace slipstream {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTimes = "step_time_us";  // the last key of a line, and the only one that the wall clock decides

// JSON has no NaN: what is not known is null.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }
double number_of(const Json& j) { return j.is_null() ? std::nan("") : j.get<double>(); }

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double v : values) list.push_back(number(v));
  return list;
}
std::vector<double> numbers_of(const Json& list) {
  std::vector<double> values;
  for (const Json& j : list) values.push_back(number_of(j));
  return values;
}
void read_numbers(const Json& j, const char* key, std::vector<double>& to) {
  if (j.contains(key)) to = numbers_of(j.at(key));
}

Json to_json(const NormalisedSum& s) {
  return {{"samples", s.samples}, {"sum", number(s.sum)}, {"dimensions", number(s.dimensions)}};
}
NormalisedSum sum_of(const Json& j) { return {j.at("samples"), number_of(j.at("sum")), number_of(j.at("dimensions"))}; }

Json to_json(const EstimatorRun& run) {
  Json states = Json::object();
  for (const StateErrors& s : run.states) {
    Json& one = states[s.state] = {{"samples", s.samples}, {"square_sum", number(s.square_sum)}, {"most", number(s.most)}};
    if (s.bound_sum) one["bound_sum"] = number(*s.bound_sum);
    if (!s.series.empty()) one["series"] = numbers(s.series);
  }
  Json j = {{"steps", run.tally.steps},    {"fallback", run.tally.fallback}, {"invalid", run.tally.invalid},
            {"samples", run.samples},      {"missing", run.missing},         {"norm_sum", number(run.norm_sum)},
            {"states", std::move(states)}, {"nees", to_json(run.nees)},      {"nis", to_json(run.nis)}};
  if (!run.t_s.empty()) {
    j["t_s"] = numbers(run.t_s);
    j["norm_series"] = numbers(run.norm_series);
    j["nees_series"] = numbers(run.nees_series);
  }
  return j;
}

EstimatorRun run_of(const std::string& name, const Json& j) {
  EstimatorRun run;
  run.estimator = name;
  run.tally = {j.at("steps"), j.at("fallback"), j.at("invalid")};
  run.samples = j.at("samples");
  run.missing = j.at("missing");
  run.norm_sum = number_of(j.at("norm_sum"));
  for (const auto& [state, s] : j.at("states").items()) {
    StateErrors errors{state, s.at("samples"), number_of(s.at("square_sum")), number_of(s.at("most")), {}, {}};
    if (s.contains("bound_sum")) errors.bound_sum = number_of(s.at("bound_sum"));
    read_numbers(s, "series", errors.series);
    run.states.push_back(std::move(errors));
  }
  run.nees = sum_of(j.at("nees"));
  run.nis = sum_of(j.at("nis"));
  read_numbers(j, "t_s", run.t_s);
  for (const double t : run.t_s)
    if (!std::isfinite(t)) throw NotARun("a time that is no number");
  read_numbers(j, "norm_series", run.norm_series);
  read_numbers(j, "nees_series", run.nees_series);
  bool fit = run.norm_series.size() == run.t_s.size() && run.nees_series.size() == run.t_s.size();
  for (const StateErrors& s : run.states) fit = fit && s.series.size() == run.t_s.size();
  if (!fit) throw NotARun("series of different lengths");
  return run;
}

}  // namespace

namespace {

Json to_json(const Consistency& c) {
  return {{"samples", c.samples},
          {"mean", number(c.mean)},
          {"dimension", number(c.dimension)},
          {"band", numbers({c.band.low, c.band.high})},
          {"within", c.within}};
}

Json to_json(const Comparison& c) {
  return {{"estimator", c.first},
          {"against", c.second},
          {"runs", c.used},
          {"eta", numbers({c.mean_first, c.mean_second})},
          {"difference", number(c.difference)},
          {"interval", numbers({c.low, c.high})},
          {"sentence", c.sentence()}};
}

Json to_json(const Study& study, std::size_t case_index, const EstimatorSummary& e) {
  Json states = Json::object();
  for (const StateSummary& s : e.states) {
    Json& one = states[s.state] = {{"samples", s.samples}, {"rmse", number(s.rmse)}, {"most", number(s.most)}};
    if (s.bound_rmse) one["bound_rmse"] = number(*s.bound_rmse);
    if (s.efficiency) one["efficiency"] = number(*s.efficiency);
    if (s.efficiency_off) one["efficiency_off"] = number(*s.efficiency_off);
    if (!s.eps_k.empty()) one["eps_k"] = numbers(s.eps_k);
  }
  Json j = {{"eta", number(e.eta)},       {"steps", e.tally.steps},      {"fallback", e.tally.fallback},
            {"invalid", e.tally.invalid}, {"states", std::move(states)}, {"nees", to_json(e.nees)},
            {"nis", to_json(e.nis)}};
  if (e.nees_inside) j["nees"]["inside"] = number(*e.nees_inside);
  if (e.worst_run) {
    const auto run = static_cast<std::size_t>(*e.worst_run);
    j["worst"] = {{"run", run},
                  {"seed", study.seed_of(*e.worst_run)},
                  {"eta", number(e.eta_of_run[run])},
                  {"replay", replay_command(study, case_index * static_cast<std::size_t>(study.runs) + run)}};
  }
  if (!e.t_s.empty()) {
    j["t_s"] = numbers(e.t_s);
    j["eps_k"] = numbers(e.eps_k);
    j["nees_k"] = numbers(e.nees_k);
  }
  return j;
}

Json to_json(const CaseSummary& c) {
  Json grid = Json::object();
  for (const auto& [key, value] : c.point) grid[key] = value;
  return {{"scenario", c.scenario}, {"grid", std::move(grid)}, {"runs", c.runs}};
}

}  // namespace

std::string results_json(const Study& study, const Summary& summary) {
  Json cases = Json::array();
  for (std::size_t i = 0; i < summary.cases.size(); ++i) {
    Json one = to_json(summary.cases[i]);
    for (const EstimatorSummary& e : summary.cases[i].estimators) one["estimators"][e.estimator] = to_json(study, i, e);
    if (summary.cases[i].why_no_bound) one["why_no_bound"] = *summary.cases[i].why_no_bound;
    one["comparisons"] = Json::array();
    for (const Comparison& c : summary.cases[i].comparisons) one["comparisons"].push_back(to_json(c));
    cases.push_back(std::move(one));
  }
  return Json{{"study", study.name}, {"description", study.description}, {"key", study.key},         {"runs", study.runs},
              {"seed", study.seed},  {"missing", summary.missing},       {"cases", std::move(cases)}}
             .dump(1) +
         "\n";
}

std::string timings_json(const Study& study, const Summary& summary) {
  Json cases = Json::array();
  for (const CaseSummary& c : summary.cases) {
    Json one = to_json(c);
    for (const EstimatorSummary& e : c.estimators) one[kTimes][e.estimator] = number(e.step_time_us);
    cases.push_back(std::move(one));
  }
  return Json{{"study", study.name}, {"key", study.key}, {"cases", std::move(cases)}}.dump(1) + "\n";
}

std::string to_text(const RunLine& line) {
  Json estimators = Json::object(), times = Json::object();
  for (std::size_t k = 0; k < line.estimators.size(); ++k) {
    estimators[line.estimators[k].estimator] = to_json(line.estimators[k]);
    times[line.estimators[k].estimator] = number(line.step_time_us[k]);
  }
  return Json{{"study", line.study},
              {"item", line.item},
              {"seed", line.seed},
              {"estimators", std::move(estimators)},
              {kTimes, std::move(times)}}
      .dump();
}

RunLine read_run_line(const std::string& text) {
  const Json j = Json::parse(text, nullptr, false);
  if (!j.is_object()) throw NotARun("not a line of JSON");
  try {
    RunLine line{j.at("study"), j.at("item"), j.at("seed"), {}, {}};
    for (const auto& [name, run] : j.at("estimators").items()) {
      line.estimators.push_back(run_of(name, run));
      line.step_time_us.push_back(number_of(j.at(kTimes).at(name)));
    }
    return line;
  } catch (const nlohmann::json::exception&) {
    throw NotARun("not the line of a run");
  }
}

bool is_same_result(const std::string& a, const std::string& b) {
  const std::string key = fmt::format(",\"{}\":", kTimes);
  const auto result = [&](const std::string& line) { return std::string_view(line).substr(0, line.rfind(key)); };
  return result(a) == result(b);
}

}  // namespace slipstream
