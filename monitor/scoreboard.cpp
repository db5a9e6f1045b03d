#include "monitor/scoreboard.hpp"

#include <algorithm>
#include <cmath>

#include "monitor/angles.hpp"
#include "monitor/health.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// NEES of every row in which the truth of all the `known` states is known; P's block of those states is used.
std::vector<double> nees_rows(const EstimatorRecord& r, const std::vector<StateColumn>& states,
                              const std::vector<std::size_t>& known) {
  std::vector<double> nees(r.utime.size(), kNan);
  if (known.empty()) return nees;
  std::vector<double> error(known.size()), P(known.size() * known.size());
  for (std::size_t row = 0; row < r.utime.size(); ++row) {
    for (std::size_t i = 0; i < known.size(); ++i) {
      error[i] = states[known[i]].estimate[row] - states[known[i]].truth[row];
      for (std::size_t j = 0; j < known.size(); ++j) P[i * known.size() + j] = r.variance(row, known[i], known[j]);
    }
    nees[row] = normalised_square(error, P);
  }
  return nees;
}

SensorScore score_sensor(const std::string& name, const SensorRecord& r) {
  std::vector<double> used = r.nis;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (r.gated[i] != 0) used[i] = kNan;
  return {name, score_consistency(used, r.dimension), std::ssize(r.nis), std::count(r.gated.begin(), r.gated.end(), 1)};
}

Bound bound_of(const RunRecord& run) {
  if (!run.info().setup) return std::string("the scenario is not known");
  return posterior_bound(*run.info().setup,
                         {run.truth().utime, [&run](const std::string& name) { return run.truth_column(name); }});
}

// The bound of a state at an estimator's instants; NaN where it is not known.
std::vector<double> bound_at(const Bound& bound, const std::string& state, const std::vector<Utime>& at) {
  std::vector<double> result(at.size(), kNan);
  const auto* series = std::get_if<BoundSeries>(&bound);
  const std::vector<double>* variance = series ? series->of(state) : nullptr;
  if (!variance) return result;
  for (std::size_t row = 0, k = 0; row < at.size(); ++row) {
    while (k < series->utime.size() && series->utime[k] < at[row]) ++k;
    if (k < series->utime.size() && series->utime[k] == at[row]) result[row] = (*variance)[k];
  }
  return result;
}

EstimatorScore score_estimator(const RunRecord& run, const Bound& bound, const std::string& name, const EstimatorRecord& r) {
  EstimatorScore s;
  s.name = name;
  s.record = &r;
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < r.state_names.size(); ++i) {
    const std::vector<double> none(r.utime.size(), kNan);
    StateColumn state{r.state_names[i], r.state_units[i], {}, kNan, none, r.states > 0 ? r.mean[i] : none, {kNan, kNan}};
    if (const std::vector<double>* truth = run.truth_column(state.name))
      state.truth = truth_at_all(run.truth().utime, *truth, r.utime);
    if (is_angle(state.unit)) state.estimate = on_turn_of(state.truth, state.estimate);
    state.score = score_state(state.truth, state.estimate);
    state.bound = score_bound(state.truth, state.estimate, bound_at(bound, state.name, r.utime));
    if (state.score.samples > 0) {
      state.max_error_s = seconds(r.utime[state.score.max_index]);
      known.push_back(i);
    }
    s.states.push_back(std::move(state));
  }
  s.nees = nees_rows(r, s.states, known);
  s.nees_score = score_consistency(s.nees, static_cast<int>(known.size()));

  std::vector<double> step_time_us;
  for (std::size_t row = 0; row < r.utime.size(); ++row)
    if (r.row_status[row] != EstimateStatus::kInitialising) step_time_us.push_back(r.step_time_us[row]);
  s.nis_score = score_consistency(r.nis, r.nis_dimension);
  s.nis_ratio = consistency_ratio(r.nis, r.nis_dimension);
  for (const auto& [sensor, record] : r.sensors) s.sensors.push_back(score_sensor(sensor, record));
  Health health;
  health.update(r);
  s.findings = health.findings(r);
  s.step_times = score_step_times(step_time_us, run.info().deadline_s);
  s.residuals = score_residuals(r.kkt_residual);

  const auto count = [&](EstimateStatus status) { return std::count(r.row_status.begin(), r.row_status.end(), status); };
  s.valid = count(EstimateStatus::kValid);
  s.fallback = count(EstimateStatus::kFallback);
  s.invalid = count(EstimateStatus::kInvalid);
  s.initialising = count(EstimateStatus::kInitialising);
  return s;
}

}  // namespace

Scoreboard score_run(const RunRecord& record) {
  Scoreboard board;
  board.complete = record.complete();
  board.bound = bound_of(record);
  for (const auto& [name, estimator] : record.estimators())
    board.estimators.push_back(score_estimator(record, board.bound, name, estimator));
  return board;
}

void RunningScore::update(const RunRecord& run, const EstimatorRecord& r) {
  square_sum_.resize(r.states, 0.0);
  count_.resize(r.states, 0.0);
  const std::vector<Utime>& truth_utime = run.truth().utime;
  // A row waits until the truth has passed it, at most until the run's clock is well past it.
  for (; next_row_ < r.utime.size(); ++next_row_) {
    const Utime t = r.utime[next_row_];
    if ((truth_utime.empty() || truth_utime.back() < t) && run.simulated() < t + kMaxTruthGap) return;
    if (std::isfinite(r.nis[next_row_])) {
      nis_sum_ += r.nis[next_row_];
      dimension_sum_ += r.nis_dimension[next_row_];
    }
    for (std::size_t i = 0; i < r.states && i < r.state_names.size(); ++i) {
      const std::vector<double>* truth = run.truth_column(r.state_names[i]);
      const double y = truth ? truth_at(truth_utime, *truth, t) : kNan, x = r.mean[i][next_row_];
      const double e = (i < r.state_units.size() && is_angle(r.state_units[i]) ? nearest_turn(x, y) : x) - y;
      if (!std::isfinite(e)) continue;
      square_sum_[i] += e * e;
      count_[i] += 1.0;
    }
  }
}

double RunningScore::rmse(std::size_t state) const {
  return state < count_.size() && count_[state] > 0.0 ? std::sqrt(square_sum_[state] / count_[state]) : kNan;
}

}  // namespace slipstream
