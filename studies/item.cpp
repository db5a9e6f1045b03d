#include "studies/item.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "estimators/follower.hpp"
#include "estimators/registry.hpp"
#include "plant/simulated_drive.hpp"
#include "studies/indices.hpp"

namespace slipstream {
namespace {

const std::string& tuning_of(const StudyEstimator& e, const Scenario& belief) {
  return e.tuning.empty() ? belief.estimator.tuning : e.tuning;
}

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

NormalisedSum sum_of(const std::vector<double>& q, const std::vector<int>& dimension) {
  NormalisedSum result;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) continue;
    ++result.samples;
    result.sum += q[i];
    result.dimensions += dimension[i];
  }
  return result;
}

// The sum of the bound's variance of a state over the rows whose error is known; nothing if it is not known at all of them.
std::optional<double> bound_sum(const Bound& bound, const std::string& state, const std::vector<Utime>& utime,
                                const std::vector<double>& error) {
  const auto* const series = std::get_if<BoundSeries>(&bound);
  const std::vector<double>* const variance = series ? series->of(state) : nullptr;
  if (!variance) return std::nullopt;
  double sum = 0.0;
  for (std::size_t row = 0, at = 0; row < utime.size(); ++row) {
    if (!std::isfinite(error[row])) continue;
    while (at < series->utime.size() && series->utime[at] < utime[row]) ++at;
    if (at == series->utime.size() || series->utime[at] != utime[row]) return std::nullopt;
    sum += (*variance)[at];
  }
  return sum;
}

EstimatorRun errors_of(const Study& study, const Played& played, std::size_t k, const Bound& bound) {
  const Track& track = played.tracks[k];
  EstimatorRun run;
  run.estimator = study.estimators[k].name;
  run.tally = track.tally;
  std::vector<std::vector<double>> errors;
  for (const std::string& state : track.states) {
    if (!played.truth.contains(state) || !(study.states.empty() || contains(study.states, state))) continue;
    errors.push_back(played.error(k, state));
    StateErrors s{state, 0, 0.0, 0.0, {}, {}};
    for (const double e : errors.back()) {
      if (study.series) s.series.push_back(std::abs(e));
      if (!std::isfinite(e)) continue;
      ++s.samples;
      s.square_sum += e * e;
      s.most = std::max(s.most, std::abs(e));
    }
    s.bound_sum = bound_sum(bound, state, track.utime, errors.back());
    run.states.push_back(std::move(s));
  }
  RunIndices indices = errors.empty() || track.utime.empty() ? RunIndices{} : run_indices(errors);
  if (!indices.eps.empty() && track.utime.front() == 0)
    indices.eps.front() = std::nan("");  // k = 1 ... N_k: not the start itself
  for (const double norm : indices.eps) {
    if (!std::isfinite(norm)) continue;
    ++run.samples;
    run.norm_sum += norm;
  }
  if (study.series) run.norm_series = indices.eps;
  bool begun = false;
  for (const double x : track.mean.front()) {
    begun = begun || std::isfinite(x);
    run.missing += begun && !std::isfinite(x) ? 1 : 0;
  }
  run.nees = sum_of(track.nees, track.nees_dimension);
  run.nis = sum_of(track.nis, track.nis_dimension);
  if (study.series) {
    run.t_s = track.t_s;
    run.nees_series = track.nees;
  }
  return run;
}

}  // namespace

RunLine run_item(const Study& study, std::size_t item) {
  SLIPSTREAM_CHECK(item < study.items());
  RunLine line{study.key, item, study.seed_of(study.run_of(item)), {}, {}};
  StudyCase one = study.case_of(item);
  one.drive.run.seed = line.seed;
  std::vector<Follower> followers;
  for (std::size_t k = 0; k < study.estimators.size(); ++k) {
    one.beliefs[k].run.seed = line.seed;
    const StudyEstimator& e = study.estimators[k];
    followers.push_back({e.algorithm, tuning_of(e, one.beliefs[k]), e.name, &one.beliefs[k]});
  }
  const Played played = play(one.drive, followers, nullptr, study.states);
  const Bound bound = posterior_bound(one.drive, true_run(played));
  for (std::size_t k = 0; k < played.tracks.size(); ++k) {
    line.estimators.push_back(errors_of(study, played, k, bound));
    const std::vector<double>& times = played.tracks[k].step_time_us;
    line.step_time_us.push_back(std::accumulate(times.begin(), times.end(), 0.0));
  }
  return line;
}

void require_playable(const Study& study, const StudyCase& one, std::size_t estimator) {
  const StudyEstimator& e = study.estimators[estimator];
  const Scenario& belief = one.beliefs[estimator];
  const std::unique_ptr<RunFollower> follower =
      make_follower(e.algorithm, e.name, 1, belief, tuning_of(e, belief), {[](const Estimate&) {}, {}, {}});
  const std::vector<std::string> truth = make_simulated_drive(one.drive)->truth_names();
  std::vector<std::string> scored;
  for (const Quantity& q : follower->names().states)
    if (contains(truth, std::string(q.name))) scored.emplace_back(q.name);
  const std::string& scenario = study.scenarios[one.scenario].name;
  if (scored.empty()) throw Refusal(fmt::format("none of its states has a truth in scenario '{}'", scenario));
  for (const std::string& state : study.states)
    if (!contains(scored, state))
      throw Refusal(fmt::format("no state '{}' with a truth in scenario '{}', which `states` asks for; it has: {}", state,
                                scenario, fmt::join(scored, ", ")));
}

}  // namespace slipstream
