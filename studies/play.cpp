#include "studies/play.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "common/check.hpp"
#include "common/readings.hpp"
#include "estimators/follower.hpp"
#include "estimators/registry.hpp"
#include "estimators/session.hpp"
#include "monitor/angles.hpp"
#include "monitor/health.hpp"
#include "plant/recorded_drive.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::map<std::string, StepTally>& tally() {
  static std::map<std::string, StepTally> all;
  return all;
}

bool is_usable(EstimateStatus s) { return s == EstimateStatus::kValid || s == EstimateStatus::kFallback; }

// Any estimator, with a record of the input of its last step: h(x^, u) belongs to that.
class Overheard final : public Estimator {
 public:
  Overheard(std::unique_ptr<Estimator> estimator, std::vector<double>& input)
      : estimator_(std::move(estimator)), input_(input) {}
  ModelNames names() const override { return estimator_->names(); }
  void start_given() override { estimator_->start_given(); }
  bool start_measured(int output, double z) override { return estimator_->start_measured(output, z); }
  void step(const StepInput& step) override {
    input_.assign(step.input.begin(), step.input.end());
    estimator_->step(step);
  }
  Posterior posterior() const override { return estimator_->posterior(); }

 private:
  std::unique_ptr<Estimator> estimator_;
  std::vector<double>& input_;
};

// One estimator with its session, writing into its track.
class Listener {
 public:
  Listener(const Scenario& scenario, const Follower& follower, const std::vector<std::string>& nees_states)
      : tuning_(scenario.estimator.tunings.at(follower.tuning)),
        process_(tuning_.process ? *tuning_.process : scenario.estimator.process),
        nees_states_(nees_states),
        tally_(tally()[scenario.name + ", " + follower.algorithm + ", tuning " + follower.tuning]),
        is_strapdown_(scenario.estimator.strapdown.has_value()),
        session_(follow(scenario, follower)) {
    track_.label = follower.label.empty() ? follower.algorithm : follower.label;
    const ModelNames names = session_->names();
    Announcement announcement;
    announcement.name = name_ = follower.algorithm;
    for (const Quantity& q : names.states) {
      track_.states.emplace_back(q.name);
      is_angle_.push_back(is_angle(q.unit));
      announcement.state_names.emplace_back(q.name);
      announcement.state_units.emplace_back(q.unit);
    }
    record_.add(announcement);
    if (!is_strapdown_)
      for (const Quantity& q : names.outputs) track_.outputs.emplace_back(q.name);
    track_.mean.resize(track_.states.size());
    track_.sigma.resize(track_.states.size());
    track_.interval_low.resize(track_.states.size());
    track_.interval_high.resize(track_.states.size());
    track_.output.resize(track_.outputs.size());
  }

  void on_reading(const Reading& r) { session_->on_reading(r); }
  void on_tick(Utime utime) { session_->on_tick(utime); }

  // Truth at the track's instants decides the NEES.
  Track finish(const Played& played) {
    std::vector<std::vector<double>> truth;
    std::vector<std::size_t> states;
    for (std::size_t i = 0; i < track_.states.size(); ++i) {
      const auto found = played.truth.find(track_.states[i]);
      const bool wanted =
          nees_states_.empty() || std::find(nees_states_.begin(), nees_states_.end(), track_.states[i]) != nees_states_.end();
      if (found == played.truth.end() || !(wanted || is_angle_[i])) continue;
      std::vector<double> here = truth_at_all(played.truth_utime, found->second, track_.utime);
      if (is_angle_[i]) track_.mean[i] = on_turn_of(here, track_.mean[i]);
      if (!wanted) continue;
      states.push_back(i);
      truth.push_back(std::move(here));
    }
    const std::size_t n = track_.states.size();
    for (std::size_t row = 0; row < track_.utime.size(); ++row) {
      std::vector<double> e;
      std::vector<std::size_t> keep;
      for (std::size_t k = 0; k < states.size(); ++k) {
        const double difference = track_.mean[states[k]][row] - truth[k][row];
        if (std::isnan(difference)) continue;
        e.push_back(difference);
        keep.push_back(states[k]);
      }
      const std::span<const double> covariance(covariance_.data() + row * n * n, n * n);
      track_.nees.push_back(e.empty() ? kNan : normalised_square(e, sub_block(covariance, n, keep)));
      track_.nees_dimension.push_back(static_cast<int>(e.size()));
    }
    if (is_strapdown_) listen_to_sensors();
    return std::move(track_);
  }

 private:
  std::unique_ptr<RunFollower> follow(const Scenario& scenario, const Follower& follower) {
    const auto publish = [this](const Estimate& e) { add(e); };
    if (is_strapdown_)
      return make_follower(follower.algorithm, follower.algorithm, 1, scenario, follower.tuning, {publish, {}});
    return std::make_unique<EstimatorSession>(
        follower.algorithm, 1, scenario, tuning_,
        std::make_unique<Overheard>(make_estimator(follower.algorithm, scenario, follower.tuning), input_), publish);
  }

  void listen_to_sensors() {
    const EstimatorRecord& record = record_.estimators().at(name_);
    track_.nis = record.nis;  // without what was gated
    track_.nis_dimension = record.nis_dimension;
    for (const auto& [sensor, r] : record.sensors)
      track_.sensors[sensor] = {r.nis, r.dimension, static_cast<int>(std::count(r.gated.begin(), r.gated.end(), 1))};
    Health health;
    health.update(record);
    track_.findings = health.findings(record);
  }

  void add(const Estimate& e) {
    const std::size_t n = track_.states.size();
    const bool usable = is_usable(e.status);
    for (StepTally* tally : {&tally_, &track_.tally}) {
      ++tally->steps;
      tally->fallback += e.status == EstimateStatus::kFallback ? 1 : 0;
      tally->invalid += e.status == EstimateStatus::kInvalid ? 1 : 0;
    }
    track_.utime.push_back(e.header.utime);
    track_.t_s.push_back(seconds(e.header.utime));
    for (std::size_t i = 0; i < n; ++i) {
      track_.mean[i].push_back(usable ? e.mean[i] : kNan);
      track_.sigma[i].push_back(usable ? std::sqrt(e.covariance[i * n + i]) : kNan);
      if (e.interval_low.size() != n) continue;
      track_.interval_low[i].push_back(usable ? e.interval_low[i] : kNan);
      track_.interval_high[i].push_back(usable ? e.interval_high[i] : kNan);
    }
    covariance_.insert(covariance_.end(), e.covariance.begin(), e.covariance.end());
    track_.step_time_us.push_back(e.step_time_us);
    track_.kkt_residual.push_back(e.kkt_residual);
    if (is_strapdown_) return record_.add(e);  // the record knows the NIS
    track_.nis.push_back(usable && !e.innovation.empty() ? normalised_square(e.innovation, e.innovation_covariance) : kNan);
    track_.nis_dimension.push_back(static_cast<int>(e.innovation.size()));
    std::visit(
        [&]<typename M>(const M& model) {
          Vector<double, M::kStates> x;
          Vector<double, M::kInputs> u;
          if (n != M::kStates || input_.size() != M::kInputs || !usable) {
            for (auto& column : track_.output) column.push_back(kNan);
            return;
          }
          for (std::size_t i = 0; i < n; ++i) x[static_cast<int>(i)] = e.mean[i];
          for (std::size_t i = 0; i < input_.size(); ++i) u[static_cast<int>(i)] = input_[i];
          const Vector<double, M::kOutputs> z = model.output(x, u);
          for (std::size_t i = 0; i < track_.output.size(); ++i) track_.output[i].push_back(z[static_cast<int>(i)]);
        },
        process_);
  }

  Tuning tuning_;
  AnyProcess process_;
  std::vector<std::string> nees_states_;
  StepTally& tally_;
  std::string name_;
  bool is_strapdown_;
  std::vector<bool> is_angle_;  // of the states
  std::vector<double> input_;   // of the last step
  RunRecord record_{{}};        // as the monitor keeps it, for what it says of sensors
  std::unique_ptr<RunFollower> session_;
  Track track_;
  std::vector<double> covariance_;  // rows of n * n
};

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  SLIPSTREAM_CHECK(found != names.end());
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

std::size_t Track::index(const std::string& state) const { return index_of(states, state); }
const std::vector<double>& Track::of(const std::string& state) const { return mean[index(state)]; }
const std::vector<double>& Track::sigma_of(const std::string& state) const { return sigma[index(state)]; }

const std::vector<double>& Played::truth_of(const std::string& name) const {
  const auto found = truth.find(name);
  SLIPSTREAM_CHECK(found != truth.end());
  return found->second;
}

StateScore Played::score(std::size_t k, const std::string& state) const {
  return score_state(truth_at_all(truth_utime, truth_of(state), tracks[k].utime), tracks[k].of(state));
}
StateScore Played::score_output(std::size_t k, const std::string& output) const {
  const Track& track = tracks[k];
  return score_state(truth_at_all(truth_utime, truth_of(output), track.utime), track.output[index_of(track.outputs, output)]);
}
StateScore Played::score_measured(std::size_t k, const std::string& output) const {
  const Track& track = tracks[k];
  const Series& z = measured.at(output);
  const std::vector<double>& h = track.output[index_of(track.outputs, output)];
  std::vector<double> measured_at(track.t_s.size(), kNan);
  for (std::size_t row = 0, i = 0; row < track.t_s.size(); ++row) {
    while (i < z.t_s.size() && z.t_s[i] < track.t_s[row]) ++i;
    if (i < z.t_s.size() && z.t_s[i] == track.t_s[row]) measured_at[row] = z.value[i];
  }
  return score_state(measured_at, h);
}
std::vector<double> Played::error(std::size_t k, const std::string& state) const {
  std::vector<double> e = truth_at_all(truth_utime, truth_of(state), tracks[k].utime);
  for (std::size_t i = 0; i < e.size(); ++i) e[i] = tracks[k].of(state)[i] - e[i];
  return e;
}

TrueRun true_run(const Played& played) {
  return {played.truth_utime, [&played](const std::string& name) {
            const auto found = played.truth.find(name);
            return found == played.truth.end() ? nullptr : &found->second;
          }};
}

const std::map<std::string, StepTally>& step_tally() { return tally(); }

Played play(const Scenario& scenario, const std::vector<Follower>& followers, const RecordedStreams* streams,
            const std::vector<std::string>& nees_states, const Tamper& tamper) {
  SLIPSTREAM_CHECK(scenario.recorded.has_value() == (streams != nullptr));
  const std::unique_ptr<DriveSource> drive =
      streams ? std::make_unique<RecordedDrive>(*streams, scenario.run.duration_s) : make_simulated_drive(scenario);
  Played played;
  const std::vector<std::string>& names = drive->truth_names();
  std::vector<std::vector<double>*> columns;
  for (const std::string& name : names) columns.push_back(&played.truth[name]);
  std::vector<std::vector<Series*>> series;  // of every quantity, by component
  for (const std::string& quantity : drive->quantities()) {
    series.emplace_back();
    for (const Component& c : components_of(quantity)) series.back().push_back(&played.measured[std::string(c.name)]);
    if (series.back().empty()) series.back().push_back(&played.measured[quantity]);
  }
  std::vector<std::unique_ptr<Listener>> listeners;
  for (const Follower& f : followers)
    listeners.push_back(std::make_unique<Listener>(f.belief ? *f.belief : scenario, f, nees_states));

  std::vector<double> newest(names.size(), kNan);  // of each truth, known: angles go on from there
  std::vector<std::int64_t> seq(drive->quantities().size(), 0);
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    for (const NamedValue& r : epoch.readings) {
      const auto channel = static_cast<std::size_t>(r.channel);
      Reading reading{{r.utime, seq[channel]++, 1}, drive->quantities()[channel], r.value};
      if (tamper && !tamper(reading)) continue;
      for (std::size_t i = 0; i < series[channel].size(); ++i) {
        series[channel][i]->t_s.push_back(seconds(epoch.utime));
        series[channel][i]->value.push_back(reading.value[i]);
      }
      for (auto& l : listeners) l->on_reading(reading);
    }
    for (auto& l : listeners) l->on_tick(epoch.utime);
    if (epoch.truth.empty()) continue;
    played.truth_utime.push_back(epoch.utime);
    played.truth_t_s.push_back(seconds(epoch.utime));
    for (std::size_t i = 0; i < names.size(); ++i) {
      double value = epoch.truth[i];
      if (is_angle(drive->truth_units()[i])) value = nearest_turn(value, newest[i]);
      if (std::isfinite(value)) newest[i] = value;
      columns[i]->push_back(value);
    }
  }
  for (auto& l : listeners) played.tracks.push_back(l->finish(played));
  return played;
}

}  // namespace slipstream
