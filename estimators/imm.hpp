// Interacting multiple models: one extended Kalman filter per regime of a model, and how probable each regime is.
//
//   There are three ways into regime j in a time dt, with Pi_jj = exp(-rate dt) and the rest shared alike by the others:
//     stayed  share Pi_jj p_j                       from (x_j, P_j), predicted in j
//     early   share 1/2 sum_{i/=j} Pi_ij p_i        from the mixture of the others, predicted in j: it came at the beginning of
//     dt, late    the same                              the mixture of the others' predictions: it came at the end of dt
//   judge     each is updated (kalman.hpp) and weighed with its likelihood N(nu; 0, S); p_j is the sum of its ways' weights
//   merge     the ways into j become one: x_j = sum_k w_k x_k,  P_j = sum_k w_k [P_k + (x_k - x_j)(x_k - x_j)']
//   publish   mean and covariance of the mixture of all j, then the p_j, with the covariance of "it is j": p_j (delta_jk - p_k)
//
// In regime j one state has the regime's value, without variance. Blom and Bar-Shalom (IEEE Trans. Automatic Control 33 (1988)
// 780-783) mix before the update; here as in the generalised pseudo-Bayesian filter of second order (Bar-Shalom, Li and
// Kirubarajan (2001), section 11.6.5) after it, since the spread of what came in would blur the prediction of a stiff regime
// and count against it; and a regime that changes within dt leaves a state anywhere between early and late. A regime's value is
// known to kRegimeVariance, which is added to what is published. Interval of the regime's state: the values that leave at most
// half a per cent of probability outside on each side, and that deviation; of the others 2.58 standard deviations. At the start
// all regimes are alike. A way whose update or likelihood is not finite keeps its prior and counts for nothing; where that is
// so of all, the shares stay as predicted. The estimate is then finite and kFallback.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimators/gaussian_estimator.hpp"

namespace slipstream {

// A process model that says what its regimes are: models/processes/tyre_friction.hpp.
template <typename M>
concept SwitchingModel = ProcessModel<M> && requires(const M model) {
  M::kRegimeNames;
  { M::kRegimeState } -> std::convertible_to<int>;
  { M::regime_value(0) } -> std::convertible_to<double>;
  { M::kRegimeVariance } -> std::convertible_to<double>;
  { model.regime_rate_hz } -> std::convertible_to<double>;
};

template <SwitchingModel M>
class Imm final : public GaussianEstimator<M> {
 public:
  static constexpr int n = M::kStates;
  static constexpr int m = M::kOutputs;
  static constexpr std::size_t kRegimes = M::kRegimeNames.size();
  static constexpr int kPublished = n + static_cast<int>(kRegimes);
  using Input = Vector<double, M::kInputs>;

  explicit Imm(const Belief<M>& belief) : GaussianEstimator<M>(belief) {
    this->belief_.process_variance[M::kRegimeState] = 0.0;
    for (std::size_t i = 0; i < n; ++i) names_[i] = M::kStateNames[i];
    for (std::size_t j = 0; j < kRegimes; ++j) names_[n + j] = M::kRegimeNames[j];
  }

  ModelNames names() const override { return {M::kName, names_, M::kInputNames, M::kOutputNames, inputs_at_end<M>()}; }

  void step(const StepInput& step) override {
    const Input u = this->input_of(step);
    if (step.dt_s > 0.0) {
      predict_all(u, step.dt_s);
    } else {
      for (std::size_t j = 0; j < kRegimes; ++j) {
        way_[j].fill(filter_[j]);
        share_[j] = {probability_[j], 0.0, 0.0};
      }
    }
    bool all_judged = true;
    const double greatest = judge_all(u, step, all_judged);
    if (std::isfinite(greatest))
      for (std::size_t j = 0; j < kRegimes; ++j)
        for (std::size_t k = 0; k < kWays; ++k) share_[j][k] = std::exp(log_share_[j][k] - greatest);
    merge();
    publish(all_judged ? EstimateStatus::kValid : EstimateStatus::kFallback);
  }

  Posterior posterior() const override {
    Posterior p = GaussianEstimator<M>::posterior();
    p.mean = {mean_.data(), kPublished};
    p.covariance = {covariance_.data(), kPublished * kPublished};
    p.interval_low = {low_.data(), kPublished};
    p.interval_high = {high_.data(), kPublished};
    return p;
  }

 private:
  static constexpr std::size_t kWays = 3;  // into a regime: stayed, came early, came late
  static constexpr double kLeast = 1e-30;  // of a probability: its logarithm stays finite

  void on_start() override {
    for (std::size_t j = 0; j < kRegimes; ++j) {
      filter_[j] = this->estimate_;
      hold(filter_[j], j);
    }
    probability_.fill(1.0 / static_cast<double>(kRegimes));
    publish(EstimateStatus::kValid);
  }

  // The regime's value in its state, without variance.
  static void hold(Gaussian<M>& g, std::size_t j) {
    g.mean[M::kRegimeState] = M::regime_value(j);
    g.covariance.row(M::kRegimeState).setZero();
    g.covariance.col(M::kRegimeState).setZero();
  }

  void predict_all(const Input& u, double dt_s) {
    const double stay = std::exp(-this->belief_.model.regime_rate_hz * dt_s);
    const double leave = (1.0 - stay) / static_cast<double>(kRegimes - 1);
    std::array<Gaussian<M>, kRegimes> stayed;
    for (std::size_t j = 0; j < kRegimes; ++j) predict_into(this->belief_, filter_[j], u, dt_s, stayed[j]);
    for (std::size_t j = 0; j < kRegimes; ++j) {
      double others = 0.0;
      for (std::size_t i = 0; i < kRegimes; ++i) others += i == j ? 0.0 : probability_[i];
      std::array<double, kRegimes> from{};
      for (std::size_t i = 0; i < kRegimes; ++i) from[i] = i == j ? 0.0 : probability_[i] / others;
      auto& [stayed_here, early, late] = way_[j];
      stayed_here = stayed[j];
      Gaussian<M> begin = mixture(filter_, from);
      hold(begin, j);
      predict_into(this->belief_, begin, u, dt_s, early);
      late = mixture(stayed, from);
      hold(late, j);
      share_[j] = {stay * probability_[j], 0.5 * leave * others, 0.5 * leave * others};
    }
  }

  static bool finite(const Gaussian<M>& g) { return g.mean.allFinite() && g.covariance.allFinite(); }

  // Updates every way and puts the logarithm of its new share, not yet normalised, into log_share_; minus infinity where that
  // is not possible, which `all_judged` tells. Returns the greatest.
  double judge_all(const Input& u, const StepInput& step, bool& all_judged) {
    constexpr double kImpossible = -std::numeric_limits<double>::infinity();
    double greatest = kImpossible, judged = 0.0;
    Vector<double, m>& mean = this->innovation_.value;
    Matrix<double, m>& covariance = this->innovation_.covariance;
    mean.setZero(), covariance.setZero();
    for (std::size_t j = 0; j < kRegimes; ++j)
      for (std::size_t k = 0; k < kWays; ++k) {
        Gaussian<M>& way = way_[j][k];
        const bool predicted = finite(way);
        const Gaussian<M> prior = predicted ? way : filter_[j];  // the regime's last estimate, which is finite
        Innovation<M> seen;
        innovate_into(this->belief_, prior, u, step.measured_value.data(), step.measured, seen);
        update_into(prior, seen, way);
        const double log_l = log_likelihood(seen);
        if (!predicted || !finite(way) || !std::isfinite(log_l)) {
          way = prior, log_share_[j][k] = kImpossible;
          all_judged = all_judged && share_[j][k] <= 0.0;
          continue;
        }
        log_share_[j][k] = std::log(share_[j][k]) + log_l;
        greatest = std::max(greatest, log_share_[j][k]);
        judged += share_[j][k];
        mean += share_[j][k] * seen.value;
        covariance += share_[j][k] * (seen.covariance + seen.value * seen.value.transpose());
      }
    if (!all_judged) settle_innovation(judged);
    covariance -= mean * mean.transpose();
    return greatest;
  }

  // Of the ways that could be judged; as if nothing had been measured where none could.
  void settle_innovation(double judged) {
    if (judged > 0.0) {
      this->innovation_.value /= judged;
      this->innovation_.covariance /= judged;
    } else {
      this->innovation_.value.setZero();
      this->innovation_.covariance.setIdentity();
    }
  }

  // p_j and the one Gaussian of each regime. Where all ways into one are out of the question the likeliest is kept whole.
  void merge() {
    double total = 0.0;
    for (std::size_t j = 0; j < kRegimes; ++j) {
      double sum = 0.0;
      for (const double share : share_[j]) sum += share;
      probability_[j] = std::max(sum, kLeast);
      total += probability_[j];
      std::array<double, kWays> within{};
      if (sum > kLeast)
        for (std::size_t k = 0; k < kWays; ++k) within[k] = share_[j][k] / sum;
      else
        within[static_cast<std::size_t>(std::max_element(log_share_[j].begin(), log_share_[j].end()) - log_share_[j].begin())] =
            1.0;
      const Gaussian<M> merged = mixture(way_[j], within);
      const auto likeliest = static_cast<std::size_t>(std::max_element(within.begin(), within.end()) - within.begin());
      filter_[j] = finite(merged) ? merged : way_[j][likeliest];  // a spread beyond the range of numbers is let go
    }
    for (double& p : probability_) p /= total;
  }

  // What has no share is left out: it may be anything.
  template <std::size_t K>
  static Gaussian<M> mixture(const std::array<Gaussian<M>, K>& of, const std::array<double, K>& share) {
    Gaussian<M> to{Vector<double, n>::Zero(), Matrix<double, n>::Zero()};
    for (std::size_t i = 0; i < K; ++i)
      if (share[i] > 0.0) to.mean += share[i] * of[i].mean;
    for (std::size_t i = 0; i < K; ++i) {
      if (!(share[i] > 0.0)) continue;
      const Vector<double, n> off = of[i].mean - to.mean;
      to.covariance += share[i] * (of[i].covariance + off * off.transpose());
    }
    return to;
  }

  // But for a constant.
  static double log_likelihood(const Innovation<M>& i) {
    const Eigen::LLT<Matrix<double, m>> factor(i.covariance);
    double log_l = -0.5 * factor.matrixL().solve(i.value).squaredNorm();
    for (int k = 0; k < m; ++k) log_l -= std::log(factor.matrixLLT()(k, k));
    return log_l;
  }

  void publish(EstimateStatus status) {
    this->estimate_ = mixture(filter_, probability_);
    this->estimate_.covariance(M::kRegimeState, M::kRegimeState) += M::kRegimeVariance;
    mean_.template head<n>() = this->estimate_.mean;
    covariance_.template topLeftCorner<n, n>() = this->estimate_.covariance;
    for (std::size_t j = 0; j < kRegimes; ++j) {
      const int row = n + static_cast<int>(j);
      const double p = probability_[j];
      mean_[row] = p;
      const Vector<double, n> with = p * (filter_[j].mean - this->estimate_.mean);
      covariance_.template block<1, n>(row, 0) = with.transpose();
      covariance_.template block<n, 1>(0, row) = with;
      for (std::size_t k = 0; k < kRegimes; ++k)
        covariance_(row, n + static_cast<int>(k)) = (j == k ? p : 0.0) - p * probability_[k];
    }
    find_intervals();
    this->settle(status);
  }

  void find_intervals() {
    constexpr double kTail = 0.005, kDeviations = 2.5758293035489004;  // of a normal variable: 99 %
    for (int s = 0; s < kPublished; ++s) {
      const double reach = kDeviations * std::sqrt(std::max(covariance_(s, s), 0.0));
      low_[s] = mean_[s] - reach, high_[s] = mean_[s] + reach;
    }
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t j = 0; j < kRegimes; ++j) {
      double not_above = 0.0, not_below = 0.0;
      for (std::size_t k = 0; k < kRegimes; ++k) {
        if (M::regime_value(k) <= M::regime_value(j)) not_above += probability_[k];
        if (M::regime_value(k) >= M::regime_value(j)) not_below += probability_[k];
      }
      if (not_above > kTail) low = std::min(low, M::regime_value(j));
      if (not_below > kTail) high = std::max(high, M::regime_value(j));
    }
    const double reach = kDeviations * std::sqrt(M::kRegimeVariance);
    low_[M::kRegimeState] = low - reach, high_[M::kRegimeState] = high + reach;
  }

  std::array<Quantity, kPublished> names_{};
  std::array<Gaussian<M>, kRegimes> filter_{};
  std::array<double, kRegimes> probability_{};
  std::array<std::array<Gaussian<M>, kWays>, kRegimes> way_{};
  std::array<std::array<double, kWays>, kRegimes> share_{}, log_share_{};
  Vector<double, kPublished> mean_, low_, high_;
  Matrix<double, kPublished> covariance_;
};

}  // namespace slipstream
