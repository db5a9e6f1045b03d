// Moving-horizon estimator, for any process model, in two forms (programs in mhe_window.hpp):
//
// Mhe                  multiple shooting with process noise; the arrival cost is the posterior of what left the window, carried
// on
//                      by a Kalman step linearised at the window's own solution. On a linear model without active bounds the
//                      estimate is the Kalman filter's.
// MheSingleShooting    the document's form: weights S and V, x+ = f(x^_{k-N-1|k-1}), no process noise (document 002,
// eqs 3.22-3.23).
//
// The window grows from one sample to N + 1. When the solver does not converge the Kalman update of the last posterior is
// published with status `fallback`, and the window goes on from there.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "estimators/gaussian_estimator.hpp"
#include "estimators/ipopt_solver.hpp"
#include "estimators/mhe_window.hpp"

namespace slipstream {

// The belief of the document's form: its weights V, taken for inverse variances wherever a Gaussian quantity is formed
// from them. Refuses a tuning without them.
template <ProcessModel M>
Belief<M> weights_as_noise(Belief<M> belief, const Tuning& tuning) {
  const auto v = belief_detail::by_name(tuning.measurement_weight, M::kOutputNames, 0.0);
  for (std::size_t k = 0; k < M::kOutputNames.size(); ++k) {
    const double weight = v[static_cast<int>(k)];
    if (weight <= 0.0)
      throw Refusal("tuning: measurement_weight." + std::string(M::kOutputNames[k].name) +
                    " is missing, expected a positive weight for single_shooting");
    belief.noise[k] = {0.0, 1.0 / std::sqrt(weight)};
  }
  return belief;
}

// What both forms share: the samples and the solver.
template <ProcessModel M>
class MovingHorizon : public GaussianEstimator<M> {
 protected:
  using State = Vector<double, M::kStates>;

  MovingHorizon(const Belief<M>& belief, int window) : GaussianEstimator<M>(belief), window_(static_cast<std::size_t>(window)) {
    samples_.reserve(window_ + 2);
  }

  // Prediction, innovation and Kalman update of the last posterior: first guess, published innovation and fallback in one.
  Gaussian<M> kalman_guess(const StepInput& step) {
    const Vector<double, M::kInputs> u = this->input_of(step);
    if (step.dt_s > 0.0) this->estimate_ = predict(this->belief_, this->estimate_, u, step.dt_s);
    this->innovation_ = innovate(this->belief_, this->estimate_, u, step.measured_value.data(), step.measured);
    WindowSample<M> sample;
    sample.dt_s = step.dt_s;
    sample.u = u;
    sample.z = Eigen::Map<const Vector<double, M::kOutputs>>(step.measured_value.data());
    sample.measured = step.measured;
    for (int k = 0; k < M::kOutputs; ++k)
      sample.weight[k] = (step.measured >> k & 1U) != 0U ? 1.0 / this->innovation_.noise[k] : 0.0;
    sample.process_sigma = this->belief_.process_covariance(step.dt_s).cwiseSqrt();
    samples_.push_back(sample);
    return update(this->estimate_, this->innovation_);
  }

  // The first solves of a process take many times what the later ones do: get them over before anything is live.
  void rehearse() {
    constexpr double kDt_s = 0.01;
    const std::array<double, M::kInputs> u{};
    const std::array<double, M::kOutputs> z{};
    this->start_given();
    for (int i = 0; i < 3; ++i) this->step({i == 0 ? 0.0 : kDt_s, u, z, 0U});
  }

  std::size_t window_;  // N
  std::vector<WindowSample<M>> samples_;
  IpoptSolver solver_;
};

template <ProcessModel M>
class Mhe final : public MovingHorizon<M> {
 public:
  static constexpr int n = M::kStates;
  using typename MovingHorizon<M>::State;

  // window: N, the number of intervals; every initial variance must be positive.
  Mhe(const Belief<M>& belief, int window) : MovingHorizon<M>(belief, window) {
    program_.belief = &this->belief_;
    program_.samples = &this->samples_;
    states_.reserve(this->window_ + 2);
    program_.reference.reserve(this->window_ + 2);
    variables_.reserve(static_cast<std::size_t>(n) * (2 * this->window_ + 3));
    this->rehearse();
  }

  void step(const StepInput& step) override {
    const Gaussian<M> guess = this->kalman_guess(step);
    states_.push_back(guess.mean);
    if (this->samples_.size() > this->window_ + 1) slide();
    const bool solved = solve(guess.covariance.diagonal().cwiseSqrt());
    if (solved) {
      this->estimate_ = newest();
    } else {
      this->estimate_ = guess;
      states_.back() = guess.mean;
    }
    this->settle(solved ? EstimateStatus::kValid : EstimateStatus::kFallback);
  }

 private:
  void on_start() override {
    this->samples_.clear();
    states_.clear();
    program_.arrival = this->estimate_;
  }

  // Linearised at sample i of the present solution.
  Innovation<M> measurement_at(std::size_t i, const State& mean) const {
    const WindowSample<M>& s = this->samples_[i];
    Innovation<M> inn =
        innovate(this->belief_, Gaussian<M>{states_[i], Matrix<double, n>::Zero()}, s.u, s.z.data(), s.measured);
    inn.value -= inn.h * (mean - states_[i]);
    for (int k = 0; k < M::kOutputs; ++k) inn.noise[k] = s.weight[k] > 0.0 ? 1.0 / s.weight[k] : 1.0;
    return inn;
  }
  Gaussian<M> updated(std::size_t i, const Gaussian<M>& prior) const {
    Innovation<M> inn = measurement_at(i, prior.mean);
    inn.ph.noalias() = prior.covariance * inn.h.transpose();
    inn.covariance.noalias() = inn.h * inn.ph;
    inn.covariance.diagonal() += inn.noise;
    return update(prior, inn);
  }
  // From sample i, where the state is distributed as `at`, to sample i + 1, linearised at the present solution.
  Gaussian<M> carried(std::size_t i, const Gaussian<M>& at) const {
    const WindowSample<M>& next = this->samples_[i + 1];
    Gaussian<M> to;
    Matrix<double, n> f;
    transition_and_jacobian(this->belief_.model, states_[i], next.u, next.dt_s, to.mean, f);
    to.mean += f * (at.mean - states_[i]);
    to.covariance.noalias() = f * at.covariance * f.transpose();
    to.covariance.diagonal() += next.process_sigma.cwiseAbs2();
    return to;
  }

  // The oldest sample leaves; what it said stays in the arrival cost.
  void slide() {
    program_.arrival = carried(0, updated(0, program_.arrival));
    this->samples_.erase(this->samples_.begin());
    states_.erase(states_.begin());
  }

  bool solve(const State& sigma) {
    program_.scale = sigma.cwiseMax(1e-12);
    program_.reference = states_;
    program_.prepare();
    variables_.assign(static_cast<std::size_t>(program_.variables()), 0.0);
    clip_to_bounds();
    const SolveResult result = this->solver_.solve(program_, variables_);
    this->kkt_residual_ = result.kkt_residual;
    if (!result.converged) return false;
    for (std::size_t i = 0; i < states_.size(); ++i) states_[i] = program_.state(variables_, static_cast<int>(i));
    return true;
  }
  void clip_to_bounds() {
    for (auto& x : program_.reference) x = x.cwiseMax(this->belief_.lower).cwiseMin(this->belief_.upper);
  }

  // The newest state, with the covariance that the window's own linearisation gives it.
  Gaussian<M> newest() const {
    Gaussian<M> at = updated(0, program_.arrival);
    for (std::size_t i = 0; i + 1 < states_.size(); ++i) at = updated(i + 1, carried(i, at));
    at.mean = states_.back();
    return at;
  }

  MultipleShooting<M> program_;
  std::vector<State> states_;  // the present solution, one per sample
  std::vector<double> variables_;
};

template <ProcessModel M>
class MheSingleShooting final : public MovingHorizon<M> {
 public:
  static constexpr int n = M::kStates;
  using typename MovingHorizon<M>::State;

  // The belief's measurement noise must be 1/V. arrival_weight: the diagonal of S.
  MheSingleShooting(const Belief<M>& belief, int window, const State& arrival_weight) : MovingHorizon<M>(belief, window) {
    program_.belief = &this->belief_;
    program_.samples = &this->samples_;
    program_.arrival_weight = arrival_weight;
    this->rehearse();
  }

  void step(const StepInput& step) override {
    const Gaussian<M> guess = this->kalman_guess(step);
    if (this->samples_.size() > this->window_ + 1) {
      const WindowSample<M>& second = this->samples_[1];
      program_.arrival = transition(this->belief_.model, first_, second.u, second.dt_s);
      this->samples_.erase(this->samples_.begin());
    }
    const Matrix<double, n> information = program_.information(program_.arrival);
    program_.scale = information.diagonal().cwiseMax(1e-12).cwiseInverse().cwiseSqrt();
    const State start = program_.arrival.cwiseMax(this->belief_.lower).cwiseMin(this->belief_.upper);
    State y = (start - program_.arrival).cwiseQuotient(program_.scale);
    const SolveResult result = this->solver_.solve(program_, {y.data(), n});
    this->kkt_residual_ = result.kkt_residual;
    if (!result.converged) {
      first_ = program_.arrival;
      this->estimate_ = guess;
      this->settle(EstimateStatus::kFallback);
      return;
    }
    first_ = program_.state({y.data(), n});
    // The covariance that the weights imply if they are taken for inverse variances: that of x_0, carried to the newest sample.
    Matrix<double, n> phi;
    value_and_jacobian<n>([&](const auto& x) { return program_.roll_out(x); }, first_, this->estimate_.mean, phi);
    this->estimate_.covariance = phi * program_.information(first_).llt().solve(Matrix<double, n>(phi.transpose()));
    symmetrise(this->estimate_.covariance);
    this->settle(EstimateStatus::kValid);
  }

 private:
  void on_start() override {
    this->samples_.clear();
    program_.arrival = first_ = this->estimate_.mean;
  }

  SingleShooting<M> program_;
  State first_ = State::Zero();  // x^_{k-N|k}
};

}  // namespace slipstream
