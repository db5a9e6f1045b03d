#include "studies/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "monitor/tables.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kMostCases = 40;            // in the tables of the terminal
constexpr double kNormal975 = 1.959963984540054;  // of a standard normal deviate
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double ratio(double sum, std::int64_t n) { return n > 0 ? sum / static_cast<double>(n) : kNan; }

void add(NormalisedSum& to, const NormalisedSum& s) {
  to.samples += s.samples;
  to.sum += s.sum;
  to.dimensions += s.dimensions;
}

// `independent`: how many of its samples count as independent of each other.
Consistency consistency(const NormalisedSum& s, std::int64_t independent) {
  Consistency c{s.samples, ratio(s.dimensions, s.samples), ratio(s.sum, s.samples), {kNan, kNan}, false};
  if (s.samples == 0 || independent == 0 || c.dimension <= 0.0) return c;
  c.band = mean_chi_square_band(independent, c.dimension);
  c.within = c.band.contains(c.mean);
  return c;
}

double mean_of_known(const std::vector<double>& values) {
  double sum = 0.0;
  std::int64_t n = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    sum += v;
    ++n;
  }
  return ratio(sum, n);
}

}  // namespace

Summariser::Summariser(const Study& study) : study_(study) {
  for (const StudyCase& one : study.cases) {
    CaseSummary c{study.scenarios[one.scenario].name, {}, 0, {}, why_no_bound(one.drive), {}};
    for (std::size_t a = 0; a < study.grid.size(); ++a) c.point.emplace_back(study.grid[a].key, one.values[a]);
    const auto runs = static_cast<std::size_t>(study.runs);
    for (const StudyEstimator& e : study.estimators)
      c.estimators.push_back({e.name, {}, kNan, std::vector<double>(runs, kNan), {}, {}, {}, {}, {}, {}, {}, {}, kNan});
    summary_.cases.push_back(std::move(c));
    sums_.emplace_back(study.estimators.size());
    run_.emplace_back();
  }
}

void Summariser::add(const RunLine& line) {
  SLIPSTREAM_CHECK(line.item >= next_ && line.item < study_.items());
  for (; next_ < line.item; ++next_) summary_.missing.push_back(next_);
  ++next_;
  const std::size_t index = line.item / static_cast<std::size_t>(study_.runs);
  const auto run = static_cast<std::size_t>(study_.run_of(line.item));
  CaseSummary& c = summary_.cases[index];
  ++c.runs;
  run_[index].push_back(run);
  const auto same_estimator = [](const EstimatorSummary& a, const EstimatorRun& b) { return a.estimator == b.estimator; };
  if (!std::equal(c.estimators.begin(), c.estimators.end(), line.estimators.begin(), line.estimators.end(), same_estimator))
    throw Refusal(fmt::format("item {} has other estimators than the study", line.item));
  for (std::size_t k = 0; k < c.estimators.size(); ++k) {
    const EstimatorRun& r = line.estimators[k];
    EstimatorSummary& e = c.estimators[k];
    Sums& sums = sums_[index][k];
    e.tally.steps += r.tally.steps;
    e.tally.fallback += r.tally.fallback;
    e.tally.invalid += r.tally.invalid;
    e.eta_of_run[run] = r.missing > 0 ? kNan : ratio(r.norm_sum, r.samples);
    slipstream::add(sums.nees, r.nees);
    slipstream::add(sums.nis, r.nis);
    sums.step_time_us += line.step_time_us[k];
    if (e.states.empty()) {
      for (const StateErrors& s : r.states)
        e.states.push_back({s.state, 0, kNan, 0.0, {}, {}, {}, std::vector<double>(e.eta_of_run.size(), kNan), {}});
      for (auto* column : {&sums.square_sum, &sums.bound_sum, &sums.bound_bound, &sums.bound_square, &sums.square_square})
        column->resize(r.states.size());
    }
    const auto same_state = [](const StateSummary& a, const StateErrors& b) { return a.state == b.state; };
    if (!std::equal(e.states.begin(), e.states.end(), r.states.begin(), r.states.end(), same_state))
      throw Refusal(fmt::format("item {} has other states than the runs before it", line.item));
    for (std::size_t i = 0; i < r.states.size(); ++i) {
      const StateErrors& s = r.states[i];
      e.states[i].samples += s.samples;
      e.states[i].most = std::max(e.states[i].most, s.most);
      e.states[i].rmse_of_run[run] = std::sqrt(ratio(s.square_sum, s.samples));
      sums.square_sum[i] += s.square_sum;
      const double bound = s.bound_sum.value_or(kNan);
      sums.bound_sum[i] += bound;
      sums.bound_bound[i] += bound * bound;
      sums.bound_square[i] += bound * s.square_sum;
      sums.square_square[i] += s.square_sum * s.square_sum;
    }
    for (std::size_t j = 0; j < r.t_s.size(); ++j) {
      Samples& at = sums.samples[r.t_s[j]];
      at.absolute.resize(r.states.size());
      at.known.resize(r.states.size());
      ++at.runs;
      if (std::isfinite(r.norm_series[j])) at.norm += r.norm_series[j], ++at.norms;
      if (std::isfinite(r.nees_series[j])) at.nees += r.nees_series[j], ++at.neeses;
      for (std::size_t i = 0; i < r.states.size(); ++i)
        if (std::isfinite(r.states[i].series[j])) at.absolute[i] += r.states[i].series[j], ++at.known[i];
    }
  }
}

void Summariser::compare_pairs(std::size_t index) {
  CaseSummary& c = summary_.cases[index];
  const std::vector<std::uint64_t>& run = run_[index];  // that are there
  const auto eta_of = [&](const std::string& name) {
    const auto found =
        std::find_if(c.estimators.begin(), c.estimators.end(), [&](const EstimatorSummary& e) { return e.estimator == name; });
    SLIPSTREAM_CHECK(found != c.estimators.end());
    std::vector<double> eta;
    for (const std::uint64_t r : run) eta.push_back(found->eta_of_run[r]);
    return eta;
  };
  for (const StudyPair& pair : study_.pairs)
    c.comparisons.push_back(compare(pair.estimator, eta_of(pair.estimator), pair.against, eta_of(pair.against), run));
}

Summary Summariser::finish() {
  for (; next_ < study_.items(); ++next_) summary_.missing.push_back(next_);
  for (std::size_t index = 0; index < summary_.cases.size(); ++index) {
    CaseSummary& c = summary_.cases[index];
    for (std::size_t k = 0; k < c.estimators.size(); ++k) {
      EstimatorSummary& e = c.estimators[k];
      const Sums& sums = sums_[index][k];
      e.eta = mean_of_known(e.eta_of_run);
      for (std::size_t run = 0; run < e.eta_of_run.size(); ++run) {
        const double eta = e.eta_of_run[run];
        if (std::isfinite(eta) && !(e.worst_run && e.eta_of_run[static_cast<std::size_t>(*e.worst_run)] >= eta))
          e.worst_run = static_cast<int>(run);
      }
      e.nees = consistency(sums.nees, c.runs);
      e.nis = consistency(sums.nis, sums.nis.samples);
      e.step_time_us = ratio(sums.step_time_us, e.tally.steps);
      for (std::size_t i = 0; i < e.states.size(); ++i) {
        e.states[i].rmse = std::sqrt(ratio(sums.square_sum[i], e.states[i].samples));
        if (const double bound = std::sqrt(ratio(sums.bound_sum[i], e.states[i].samples)); std::isfinite(bound)) {
          e.states[i].bound_rmse = bound;
          const double r = sums.bound_sum[i] / sums.square_sum[i], n = c.runs;
          e.states[i].efficiency = r;
          const double scatter = sums.bound_bound[i] - 2.0 * r * sums.bound_square[i] + r * r * sums.square_square[i];
          if (c.runs > 1)
            e.states[i].efficiency_off = kNormal975 * std::sqrt(std::max(0.0, scatter) * n / (n - 1.0)) / sums.square_sum[i];
        }
      }
      std::int64_t inside = 0, banded = 0;
      for (const auto& [t_s, at] : sums.samples) {
        e.t_s.push_back(t_s);
        e.eps_k.push_back(ratio(at.norm, at.norms));
        e.nees_k.push_back(ratio(at.nees, at.neeses));
        for (std::size_t i = 0; i < e.states.size(); ++i) e.states[i].eps_k.push_back(ratio(at.absolute[i], at.known[i]));
        if (at.neeses == 0 || !(e.nees.dimension > 0.0)) continue;
        ++banded;
        inside += mean_chi_square_band(at.neeses, e.nees.dimension).contains(e.nees_k.back()) ? 1 : 0;
      }
      if (banded > 0) e.nees_inside = static_cast<double>(inside) / static_cast<double>(banded);
    }
    compare_pairs(index);
  }
  return std::move(summary_);
}

std::string replay_command(const Study& study, std::size_t item) {
  const StudyCase& one = study.case_of(item);
  std::string command = fmt::format("slipstream-plant scenarios/{}.toml --set run.seed={}", study.scenarios[one.scenario].name,
                                    study.seed_of(study.run_of(item)));
  for (std::size_t a = 0; a < study.grid.size(); ++a)
    command += fmt::format(" --set '{}={}'", study.grid[a].key, one.values[a]);
  return command;
}

namespace {

std::string case_name(const CaseSummary& c) {
  std::string name = c.scenario;
  for (const auto& [key, value] : c.point) name += fmt::format(", {} = {}", key.substr(key.rfind('.') + 1), value);
  return name;
}

std::string mean_and_band(const Consistency& c) {
  if (c.samples == 0) return "-";
  return fmt::format("{} ({:.3f}..{:.3f})", c.mean < 1e4 ? fmt::format("{:.3f}", c.mean) : number_text(c.mean), c.band.low,
                     c.band.high);
}

}  // namespace

// "0.98 +-0.12"
std::string efficiency_text(const StateSummary& s) {
  return fmt::format("{:.2f}{}", *s.efficiency, s.efficiency_off ? fmt::format(" +-{:.2f}", *s.efficiency_off) : "");
}

std::string summary_text(const Study& study, const Summary& summary) {
  std::vector<std::string> states;
  for (const CaseSummary& c : summary.cases)
    for (const EstimatorSummary& e : c.estimators)
      for (const StateSummary& s : e.states)
        if (std::find(states.begin(), states.end(), s.state) == states.end()) states.push_back(s.state);
  Table errors{"Errors", {{"case", false}, {"estimator", false}, {"runs"}, {"eta"}}, {}};
  for (const std::string& s : states) {
    errors.columns.push_back({fmt::format("RMSE {}", s), true});
    errors.columns.push_back({"eff.", true});
  }
  errors.columns.push_back({"worst run", true});
  Table consistency{"Consistency (95 % bands)",
                    {{"case", false}, {"estimator", false}, {"NEES"}, {"n"}, {"NIS"}, {"m"}, {"fell back"}, {"invalid"}},
                    {}};
  const std::span<const CaseSummary> shown(summary.cases.data(), std::min(kMostCases, summary.cases.size()));
  for (const CaseSummary& c : shown) {
    for (const EstimatorSummary& e : c.estimators) {
      std::vector<std::string> row{case_name(c), e.estimator, fmt::format("{}", c.runs), number_text(e.eta)};
      for (const std::string& name : states) {
        const auto found =
            std::find_if(e.states.begin(), e.states.end(), [&](const StateSummary& s) { return s.state == name; });
        row.push_back(found == e.states.end() ? "-" : number_text(found->rmse));
        row.push_back(found == e.states.end() || !found->efficiency ? "-" : efficiency_text(*found));
      }
      row.push_back(e.worst_run ? fmt::format("{}", *e.worst_run) : "-");
      errors.rows.push_back(std::move(row));
      consistency.rows.push_back({case_name(c), e.estimator, mean_and_band(e.nees), number_text(e.nees.dimension, 3),
                                  mean_and_band(e.nis), number_text(e.nis.dimension, 3), fmt::format("{}", e.tally.fallback),
                                  fmt::format("{}", e.tally.invalid)});
    }
  }
  std::string text = to_text(errors, 140) + "\n" + to_text(consistency, 140);
  if (summary.cases.size() > kMostCases)
    text += fmt::format("\nand {} further cases in results.json\n", summary.cases.size() - kMostCases);
  text +=
      "\neta: mean over runs and samples of the root mean square of the states' errors, in their units; a run in which an "
      "estimator\n"
      "was without an estimate has none. eff.: variance of the Cramer-Rao bound over mean squared error, with its 95 % "
      "interval\n"
      "over the runs; with ever more runs no estimator stays above 1.\n";
  for (const CaseSummary& c : shown)
    if (c.why_no_bound) text += fmt::format("no bound for {}: {}\n", case_name(c), *c.why_no_bound);
  text += "\nBy eta, run by run\n";
  for (const CaseSummary& c : shown)
    for (const Comparison& pair : c.comparisons) text += fmt::format("  {}: {}\n", case_name(c), pair.sentence());
  for (std::size_t index = 0; index < summary.cases.size(); ++index) {
    const CaseSummary& c = summary.cases[index];
    if (c.estimators.empty() || !c.estimators.front().worst_run) continue;
    const std::size_t item =
        index * static_cast<std::size_t>(study.runs) + static_cast<std::size_t>(*c.estimators.front().worst_run);
    text += fmt::format("\n{}'s worst run of {}, live, in the folder of the results:\n  {}\n", c.estimators.front().estimator,
                        case_name(c), replay_command(study, item));
    break;  // the others differ in their seed and settings only, which results.json has
  }
  return text;
}

}  // namespace slipstream
