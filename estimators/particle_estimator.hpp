// What every particle filter has in common at the process's interface: settings, recovery, estimate, credible interval.
//
//   estimate  mean and covariance of the weighted set, BEFORE it is resampled for the next step, which would only add its own
//             variance; for each state the interval between the weighted quantiles 0.5 % and 99.5 %
//
// When things go wrong. Where no particle is within 6 standard deviations of a measurement, the set has lost the state: it is
// drawn anew around its mean with the start's variance, and what the measurement fixes (start_from) is taken from it and
// counted once (kFallback; pf_recover = false leaves this out, for the plain algorithm). One wild measurement is enough for
// that, and states that are not measured are spread again with the others: who expects outliers gates them before. Weights
// cannot underflow (log-weights); when even their logarithms are lost, the measurement is left out and the predicted set stands
// (kFallback). When one particle carries all the weight the set has no spread: its variance is then that of one step's process
// noise (kFallback; kInvalid where that is 0 too). A particle that is no longer finite is replaced by the heaviest one, without
// weight; if there is no finite one, the estimate is kInvalid.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "estimators/gaussian_estimator.hpp"
#include "estimators/interval_finder.hpp"
#include "estimators/particle_cloud.hpp"

namespace slipstream {

struct ParticleSettings {
  int particles = 1000;  // N
  Resampling resampling = Resampling::kSystematic;
  double resample_below = 0.5;  // fraction of N in (0, 1]: resample where N_eff is below it; 1: always
  bool recover = true;
};
inline ParticleSettings particle_settings(const Tuning& tuning) {
  return {tuning.pf_particles, resampling_named(tuning.pf_resampling), tuning.pf_resample_below, tuning.pf_recover};
}

template <ProcessModel M, typename ParticleCloudOfM = ParticleCloud<M>>
class ParticleEstimator : public GaussianEstimator<M> {
 public:
  ParticleEstimator(const Belief<M>& belief, const ParticleSettings& settings, const RandomStream& random)
      : GaussianEstimator<M>(belief),
        settings_(settings),
        cloud_(belief, settings.particles, settings.resampling, random),
        interval_finder_(cloud_.set().size()) {}

  Posterior posterior() const final {
    Posterior p = GaussianEstimator<M>::posterior();
    if (Cloud::kIntervals) {
      p.interval_low = {interval_low_.data(), M::kStates};
      p.interval_high = {interval_high_.data(), M::kStates};
    }
    return p;
  }

 protected:
  using Cloud = ParticleCloudOfM;
  using State = typename Cloud::State;
  using Input = typename Cloud::Input;
  static constexpr int n = M::kStates;

  void on_start() override {
    cloud_.draw(this->estimate_);
    find_intervals();
  }

  void give_up() {
    this->estimate_.mean.setConstant(std::numeric_limits<double>::quiet_NaN());
    this->settle(EstimateStatus::kInvalid);
  }

  bool is_few(double effective) const {
    return settings_.resample_below >= 1.0 || effective < settings_.resample_below * static_cast<double>(settings_.particles);
  }

  // From the judged particles to the estimate: recovers a lost set, takes the weights over and publishes. Returns N_eff; 0
  // where nothing was weighed.
  double conclude(const Input& u, const StepInput& step, typename Cloud::Judgement& seen) {
    EstimateStatus status = EstimateStatus::kValid;
    StepInput left = step;  // what is still to be weighed
    if (settings_.recover && seen.lost != 0U) {
      left.measured &= ~scatter(step);
      const auto surprise = seen.innovation;  // what was measured against what was predicted stays the innovation
      seen = cloud_.judge(u, left, this->estimate_.mean, {false, false, nullptr});
      seen.innovation = surprise;
      status = EstimateStatus::kFallback;
    }
    double effective = 0.0;
    if (left.measured != 0U) {
      effective = cloud_.set().weigh(seen.greatest, this->estimate_.mean);
      if (effective == 0.0) status = EstimateStatus::kFallback;
      if constexpr (requires { cloud_.absorb(u, left); }) {
        if (effective > 0.0) cloud_.absorb(u, left);
      }
    }
    this->innovation_.value = seen.innovation.value;
    this->innovation_.covariance = seen.innovation.covariance;
    summarise();
    constexpr double kOthers = 1e-12;    // the weight of all but one particle: what they say of the spread is of no account
    constexpr double kRounding = 1e-13;  // of a mean, relative: equal particles may differ from it by so much
    const bool alone = Cloud::kIntervals && effective > 0.0 && effective < 1.0 + kOthers;
    for (int s = 0; s < n; ++s) {
      const double rounding = kRounding * this->estimate_.mean[s];
      if (!alone && this->estimate_.covariance(s, s) > rounding * rounding) continue;
      if (alone) this->estimate_.covariance.row(s).setZero(), this->estimate_.covariance.col(s).setZero();
      this->estimate_.covariance(s, s) = this->belief_.process_covariance(step.dt_s)[s];
      status = EstimateStatus::kFallback;
    }
    this->settle(status);
    return effective;
  }

  ParticleSettings settings_;
  Cloud cloud_;

 private:
  static constexpr double kTail = 0.005;  // of a 99 % interval, on each side

  // Draws the set anew around its mean, with the variance of the start and of what the measurements fix. Returns these.
  std::uint32_t scatter(const StepInput& step) {
    std::uint32_t used = 0;
    Gaussian<M> at{cloud_.moments(this->estimate_.mean).mean, this->belief_.initial_variance.asDiagonal()};
    for (int k = 0; k < M::kOutputs; ++k)
      if (cloud_.is_measured(step, static_cast<std::size_t>(k)) &&
          this->start_at(k, step.measured_value[static_cast<std::size_t>(k)], at))
        used |= 1U << k;
    this->estimate_ = at;
    cloud_.draw(at);
    return used;
  }

  void summarise() {
    const auto moments = cloud_.moments(this->estimate_.mean);
    this->estimate_.mean = moments.mean;
    this->estimate_.covariance = moments.covariance;
    find_intervals();
  }

  void find_intervals() {
    if constexpr (!Cloud::kIntervals) return;
    const auto& set = cloud_.set();
    for (int s = 0; s < n; ++s) {
      const auto [low, high] =
          interval_finder_.find({set.column(s), set.size()}, {set.weights(), set.size()}, set.total_weight(),
                                this->estimate_.mean[s], std::sqrt(this->estimate_.covariance(s, s)), kTail);
      interval_low_[s] = low;
      interval_high_[s] = high;
    }
  }

  IntervalFinder interval_finder_;
  State interval_low_ = State::Zero();
  State interval_high_ = State::Zero();
};

// Of the registry: Filter<M> for the scenario's process model, with a random stream of the algorithm's own.
template <template <typename> typename Filter>
std::unique_ptr<Estimator> make_particle_estimator(const Scenario& scenario, const Tuning& tuning, std::string_view algorithm) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        return std::make_unique<Filter<M>>(make_belief(model, scenario, tuning), particle_settings(tuning),
                                           RandomStream(scenario.run.seed, 0, "estimator." + std::string(algorithm)));
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
