// Particle filter with sampling importance resampling (SIR), for any process model.
//
//   predict   x_i = f(x_i, u, dt) + sqrt(Q(dt)) xi,  xi ~ N(0, I)          f: Runge-Kutta as in kalman.hpp; a random walk
//   weigh     w_i ~ w_i p(z | x_i),   -2 log p = sum_k (z_k - h_k)^2/R_k + log R_k,   R_k = rel^2 h_k^2 + abs^2, h_k = h_k(x_i)
//   estimate  mean and covariance of the weighted set, BEFORE resampling, which would only add its own variance; for each state
//             the interval between the weighted quantiles 0.5 % and 99.5 %
//   resample  systematically (particle_set.hpp) when N_eff < resample_below N; always where resample_below is 1
//
// Innovation: z minus the mean of h over the predicted set; its covariance is that of h plus the mean of R. Only states whose
// process variance is positive are drawn; sqrt(Q) is the standard deviation of one step's draw.
//
// When things go wrong. Where no particle is within 6 standard deviations of a measurement, the set has lost the state: it is
// drawn anew around its mean with the start's variance, and what the measurement fixes (start_from) is taken from it and
// counted once (kFallback; pf_recover = false leaves this out, for the plain algorithm). One wild measurement is enough for
// that, and states that are not measured are spread again with the others: who expects outliers gates them before. Weights
// cannot underflow (log-weights); when even their logarithms are lost, the measurement is left out and the predicted set stands
// (kFallback). When one particle carries all the weight the set has no spread: its variance is then that of one step's process
// noise (kFallback; kInvalid where that is 0 too). A particle that is no longer finite is replaced by the heaviest one, without
// weight; if there is no finite one, the estimate is kInvalid.
//
// Document 002, section 3.5.1 and Table 2; Arulampalam et al. (2002), algorithm 4. Cost grows with N n; the arrays are one per
// state.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "common/random.hpp"
#include "estimators/gaussian_estimator.hpp"
#include "estimators/particle_set.hpp"

namespace slipstream {

template <ProcessModel M>
class ParticleFilter final : public GaussianEstimator<M> {
  static constexpr int n = M::kStates;
  static constexpr int m = M::kOutputs;
  using State = Vector<double, n>;
  using Input = Vector<double, M::kInputs>;

 public:
  // resample_below: fraction of N in (0, 1].
  ParticleFilter(const Belief<M>& belief, int particles, double resample_below, bool recover, const RandomStream& random)
      : GaussianEstimator<M>(belief),
        random_(random),
        size_(static_cast<std::size_t>(particles)),
        resample_below_(resample_below),
        recover_(recover),
        x_(n * size_),
        moved_(n * size_),
        h_(m * size_),
        weight_(size_),
        log_weight_(size_),
        posterior_log_weight_(size_),
        normals_(size_),
        ancestor_(size_ + 1),
        interval_finder_(size_) {}

  void step(const StepInput& step) override {
    const Input u = this->input_of(step);
    if (step.dt_s > 0.0) {
      move(u, step.dt_s);
      disturb(step.dt_s);
    }
    if (!replace_lost()) {
      this->estimate_.mean.setConstant(std::numeric_limits<double>::quiet_NaN());
      this->settle(EstimateStatus::kInvalid);
      return;
    }
    EstimateStatus status = EstimateStatus::kValid;
    double effective = static_cast<double>(size_);
    observe(u, step);
    StepInput left = step;  // what is still to be weighed
    if (recover_ && is_set_lost(step)) {
      const Innovation<M> surprise = this->innovation_;  // what was measured against what was predicted stays the innovation
      left.measured &= ~scatter(step);
      observe(u, step);
      this->innovation_ = surprise;
      status = EstimateStatus::kFallback;
    }
    if (left.measured != 0U) {
      effective = weigh(left);
      if (effective == 0.0) status = EstimateStatus::kFallback;
    }
    summarise();
    for (int s = 0; s < n; ++s) {
      if (this->estimate_.covariance(s, s) > 0.0) continue;
      this->estimate_.covariance(s, s) = this->belief_.process_covariance(step.dt_s)[s];
      status = EstimateStatus::kFallback;
    }
    this->settle(status);
    const bool few = effective < resample_below_ * static_cast<double>(size_) || resample_below_ >= 1.0;
    if (left.measured != 0U && effective > 0.0 && few) resample();
  }

  Posterior posterior() const override {
    Posterior p = GaussianEstimator<M>::posterior();
    p.interval_low = {interval_low_.data(), n};
    p.interval_high = {interval_high_.data(), n};
    return p;
  }

 private:
  static constexpr double kTail = 0.005;  // of a 99 % interval, on each side
  static constexpr double kReach = 6.0;   // standard deviations: nothing Gaussian of this bench is further off in its lifetime

  double* state(int s) { return x_.data() + static_cast<std::size_t>(s) * size_; }
  double* output(int k) { return h_.data() + static_cast<std::size_t>(k) * size_; }
  static bool is_measured(const StepInput& step, int k) { return (step.measured >> k & 1U) != 0U; }

  State particle(const double* x, std::size_t i) const {
    State at;
    for (int s = 0; s < n; ++s) at[s] = x[static_cast<std::size_t>(s) * size_ + i];
    return at;
  }
  static void put(const State& to, double* x, std::size_t i, std::size_t size) {
    for (int s = 0; s < n; ++s) x[static_cast<std::size_t>(s) * size + i] = to[s];
  }

  // Draws the set from the start's mean and covariance, P = L D L'.
  void on_start() override {
    const Eigen::LDLT<Matrix<double, n>> factor(this->estimate_.covariance);
    const Matrix<double, n> root = factor.transpositionsP().transpose() * Matrix<double, n>(factor.matrixL()) *
                                   factor.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    for (int s = 0; s < n; ++s) random_.normals({state(s), size_});
    for (std::size_t i = 0; i < size_; ++i) put(this->estimate_.mean + root * particle(x_.data(), i), x_.data(), i, size_);
    forget_weights();
    find_intervals();
  }

  void forget_weights() {
    std::fill(weight_.begin(), weight_.end(), 1.0 / static_cast<double>(size_));
    std::fill(log_weight_.begin(), log_weight_.end(), 0.0);
  }

  [[gnu::flatten]] void move(const Input& u, double dt_s) {
    const M model = this->belief_.model;
    const std::size_t size = size_;
    double* const x = x_.data();
    bool single = true;
    for (std::size_t i = 0; i < size; ++i) single &= transition_steps(model, particle(x, i), dt_s) == 1;
    if (single) {
      for (std::size_t i = 0; i < size; ++i) put(single_transition(model, particle(x, i), u, dt_s), x, i, size);
    } else {
      for (std::size_t i = 0; i < size; ++i) put(transition(model, particle(x, i), u, dt_s), x, i, size);
    }
  }

  void disturb(double dt_s) {
    const State variance = this->belief_.process_covariance(dt_s);
    for (int s = 0; s < n; ++s) {
      if (variance[s] <= 0.0) continue;
      disturb_normally(random_, std::sqrt(variance[s]), {state(s), size_}, normals_);
    }
  }

  // False if no particle with weight is finite.
  bool replace_lost() {
    const double* const all = x_.data();
    if (lane_sum(x_.size(), [&](std::size_t i) { return 0.0 * all[i]; }) == 0.0) return true;
    const auto is_lost = [&](std::size_t i) { return !particle(all, i).allFinite(); };
    std::size_t heaviest = size_;
    for (std::size_t i = 0; i < size_; ++i)
      if (!is_lost(i) && weight_[i] > (heaviest == size_ ? 0.0 : weight_[heaviest])) heaviest = i;
    if (heaviest == size_) return false;
    const State spare = particle(all, heaviest);
    for (std::size_t i = 0; i < size_; ++i) {
      if (!is_lost(i)) continue;
      put(spare, x_.data(), i, size_);
      log_weight_[i] = -std::numeric_limits<double>::infinity();
    }
    return normalise(log_weight_, weight_) > 0.0;
  }

  // h of each particle; innovation and its covariance under the predicted weights.
  [[gnu::flatten]] void observe(const Input& u, const StepInput& step) {
    const M model = this->belief_.model;
    const std::size_t size = size_;
    const double* const x = x_.data();
    double* const h = h_.data();
    for (std::size_t i = 0; i < size; ++i) {
      const Vector<double, m> z = model.output(particle(x, i), u);
      for (int k = 0; k < m; ++k) h[static_cast<std::size_t>(k) * size + i] = z[k];
    }
    Innovation<M>& to = this->innovation_;
    to.value.setZero();
    to.covariance.setIdentity();
    Vector<double, m> mean = Vector<double, m>::Zero();
    for (int k = 0; k < m; ++k) {
      if (!is_measured(step, k)) continue;
      mean[k] = weighted_mean(output(k));
      to.value[k] = step.measured_value[static_cast<std::size_t>(k)] - mean[k];
      for (int j = 0; j <= k; ++j)
        if (is_measured(step, j))
          to.covariance(k, j) = to.covariance(j, k) = weighted_product(output(k), mean[k], output(j), mean[j]);
      to.covariance(k, k) += this->belief_.noise[static_cast<std::size_t>(k)].variance(mean[k], to.covariance(k, k));
    }
  }

  // Whether for some measurement no particle is within kReach standard deviations of its noise.
  bool is_set_lost(const StepInput& step) const {
    for (int k = 0; k < m; ++k) {
      if (!is_measured(step, k)) continue;
      const NoiseLaw& law = this->belief_.noise[static_cast<std::size_t>(k)];
      const double z = step.measured_value[static_cast<std::size_t>(k)];
      const double* const h = h_.data() + static_cast<std::size_t>(k) * size_;
      bool any = false;
      for (std::size_t i = 0; i < size_ && !any; ++i) {
        const double square = (z - h[i]) * (z - h[i]);
        any = square <= kReach * kReach * law.variance(h[i]) || !std::isfinite(square);  // beyond all numbers: left out below
      }
      if (!any) return true;
    }
    return false;
  }

  // Draws the set anew around its mean, with the variance of the start and of what the measurements fix. Returns these.
  std::uint32_t scatter(const StepInput& step) {
    std::uint32_t used = 0;
    Gaussian<M> at{State::Zero(), this->belief_.initial_variance.asDiagonal()};
    for (int s = 0; s < n; ++s) at.mean[s] = weighted_mean(state(s));
    for (int k = 0; k < m; ++k)
      if (is_measured(step, k) && this->start_at(k, step.measured_value[static_cast<std::size_t>(k)], at)) used |= 1U << k;
    this->estimate_ = at;
    on_start();
    return used;
  }

  // Multiplies the likelihood in. N_eff; 0 if all weights have vanished, and then they are as before.
  double weigh(const StepInput& step) {
    posterior_log_weight_ = log_weight_;
    for (int k = 0; k < m; ++k) {
      if (!is_measured(step, k)) continue;
      const auto at = static_cast<std::size_t>(k);
      weigh_by_normal(step.measured_value[at], this->belief_.noise[at], {output(k), size_}, posterior_log_weight_);
    }
    const double effective = normalise(posterior_log_weight_, weight_);
    if (effective > 0.0) log_weight_.swap(posterior_log_weight_);
    return effective;
  }

  double weighted_mean(const double* a) const {
    const double* const w = weight_.data();
    return lane_sum(size_, [&](std::size_t i) { return w[i] * a[i]; });
  }
  double weighted_product(const double* a, double mean_a, const double* b, double mean_b) const {
    const double* const w = weight_.data();
    return lane_sum(size_, [&](std::size_t i) { return w[i] * ((a[i] - mean_a) * (b[i] - mean_b)); });
  }

  void summarise() {
    Gaussian<M>& to = this->estimate_;
    for (int s = 0; s < n; ++s) to.mean[s] = weighted_mean(state(s));
    for (int s = 0; s < n; ++s)
      for (int t = 0; t <= s; ++t)
        to.covariance(s, t) = to.covariance(t, s) = weighted_product(state(s), to.mean[s], state(t), to.mean[t]);
    find_intervals();
  }

  void find_intervals() {
    for (int s = 0; s < n; ++s) {
      const double sigma = std::sqrt(this->estimate_.covariance(s, s));
      const auto [low, high] = interval_finder_.find({state(s), size_}, weight_, this->estimate_.mean[s], sigma, kTail);
      interval_low_[s] = low;
      interval_high_[s] = high;
    }
  }

  void resample() {
    resample_systematic(weight_, random_.uniform(), ancestor_);
    for (int s = 0; s < n; ++s) {
      const double* const from = state(s);
      double* const to = moved_.data() + static_cast<std::size_t>(s) * size_;
      for (std::size_t j = 0; j < size_; ++j) to[j] = from[ancestor_[j]];
    }
    x_.swap(moved_);
    forget_weights();
  }

  RandomStream random_;
  std::size_t size_;  // N
  double resample_below_;
  bool recover_;
  std::vector<double> x_;      // n arrays of N
  std::vector<double> moved_;  // as x_, while resampling
  std::vector<double> h_;      // m arrays of N
  std::vector<double> weight_;
  std::vector<double> log_weight_;
  std::vector<double> posterior_log_weight_;
  std::vector<double> normals_;
  std::vector<std::int32_t> ancestor_;
  IntervalFinder interval_finder_;
  State interval_low_ = State::Zero();
  State interval_high_ = State::Zero();
};

}  // namespace slipstream
