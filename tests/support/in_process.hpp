// A scenario played in process: the same drive, session and scores as the three programs, without a bus.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "estimators/registry.hpp"
#include "estimators/session.hpp"
#include "models/scenario.hpp"
#include "monitor/scores.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream::test {

struct Played {
  std::vector<Utime> utime;
  std::vector<std::vector<double>> truth;  // per instant
  std::vector<std::string> truth_names;
  std::vector<std::vector<double>> readings;  // per instant; NaN where there was none
  std::vector<std::string> reading_names;
  std::vector<Estimate> estimates;
  std::vector<std::vector<double>> inputs;    // per step: what the estimator was given
  std::vector<std::vector<double>> measured;  // per step and output

  std::vector<double> truth_of(const std::string& name) const { return column_of(name, truth_names, truth); }
  std::vector<double> reading_of(const std::string& name) const { return column_of(name, reading_names, readings); }
  std::vector<double> estimate_of(std::size_t state) const {
    std::vector<double> column;
    for (const Estimate& e : estimates) column.push_back(e.mean[state]);
    return column;
  }
  std::vector<double> nis() const {
    std::vector<double> values;
    for (const Estimate& e : estimates) values.push_back(normalised_square(e.innovation, e.innovation_covariance));
    return values;
  }
  std::vector<double> measured_of(std::size_t output) const {
    std::vector<double> column;
    for (const auto& row : measured) column.push_back(row[output]);
    return column;
  }
  std::size_t fallbacks() const {
    std::size_t count = 0;
    for (const Estimate& e : estimates) count += e.status != EstimateStatus::kValid ? 1U : 0U;
    return count;
  }

 private:
  static std::vector<double> column_of(const std::string& name, const std::vector<std::string>& names,
                                       const std::vector<std::vector<double>>& rows) {
    std::vector<double> column;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == name)
        for (const auto& row : rows) column.push_back(row[i]);
    return column;
  }
};

// Any estimator, with a record of what it is given.
class Overheard final : public Estimator {
 public:
  Overheard(std::unique_ptr<Estimator> estimator, Played& played) : estimator_(std::move(estimator)), played_(played) {}
  ModelNames names() const override { return estimator_->names(); }
  void start_given() override { estimator_->start_given(); }
  bool start_measured(int output, double z) override { return estimator_->start_measured(output, z); }
  void step(const StepInput& step) override {
    played_.inputs.emplace_back(step.input.begin(), step.input.end());
    played_.measured.emplace_back(step.measured_value.begin(), step.measured_value.end());
    estimator_->step(step);
  }
  Posterior posterior() const override { return estimator_->posterior(); }

 private:
  std::unique_ptr<Estimator> estimator_;
  Played& played_;
};

// Truth and measurements must have the same rate, as in the shipped simulated scenarios; inputs may have any. An instant
// without an estimate, while the first measurement is still on its way, is not scored.
inline Played play(const Scenario& scenario, const std::string& algorithm, const std::string& tuning,
                   std::unique_ptr<DriveSource> drive) {
  Played played;
  played.truth_names = drive->truth_names();
  played.reading_names = drive->quantities();
  EstimatorSession session("test", 1, scenario, scenario.estimator.tunings.at(tuning),
                           std::make_unique<Overheard>(make_estimator(algorithm, scenario, tuning), played),
                           [&](const Estimate& e) { played.estimates.push_back(e); });
  std::vector<std::int64_t> seq(drive->quantities().size(), 0);
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    for (const NamedValue& r : epoch.readings) {
      const auto channel = static_cast<std::size_t>(r.channel);
      session.on_reading({{r.utime, seq[channel]++, 1}, drive->quantities()[channel], r.value});
    }
    session.on_tick(epoch.utime);
    if (played.estimates.size() == played.utime.size()) continue;
    auto& row = played.readings.emplace_back(played.reading_names.size(), std::numeric_limits<double>::quiet_NaN());
    for (const NamedValue& r : epoch.readings) row[static_cast<std::size_t>(r.channel)] = r.value.scalar();
    played.utime.push_back(epoch.utime);
    played.truth.push_back(epoch.truth);
  }
  return played;
}

inline Played play(const Scenario& scenario, const std::string& algorithm, const std::string& tuning) {
  return play(scenario, algorithm, tuning, make_simulated_drive(scenario));
}

// h(x) after each update, one series per output, with the inputs that the estimator had.
template <ProcessModel M>
std::array<std::vector<double>, M::kOutputs> estimated_outputs(const M& model, const Played& played) {
  std::array<std::vector<double>, M::kOutputs> series;
  for (std::size_t k = 0; k < played.estimates.size(); ++k) {
    const auto z =
        model.output(Vector<double, M::kStates>(Eigen::Map<const Vector<double, M::kStates>>(played.estimates[k].mean.data())),
                     Vector<double, M::kInputs>(Eigen::Map<const Vector<double, M::kInputs>>(played.inputs[k].data())));
    for (int i = 0; i < M::kOutputs; ++i) series[static_cast<std::size_t>(i)].push_back(z[i]);
  }
  return series;
}

inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

}  // namespace slipstream::test
