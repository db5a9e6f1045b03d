// What all algorithms with a Gaussian posterior have in common at the process's interface: names, start, status.
#pragma once

#include <cmath>

#include "estimators/estimator.hpp"
#include "estimators/kalman.hpp"

namespace slipstream {

template <ProcessModel M>
class GaussianEstimator : public Estimator {
 public:
  explicit GaussianEstimator(const Belief<M>& belief) : belief_(belief) {}

  ModelNames names() const override { return {M::kName, M::kStateNames, M::kInputNames, M::kOutputNames, inputs_at_end<M>()}; }

  void start_given() override { start({belief_.initial_mean, belief_.initial_variance.asDiagonal()}); }

  bool start_measured(int output, double z) override {
    Gaussian<M> at{belief_.initial_mean, belief_.initial_variance.asDiagonal()};
    if (!start_at(output, z, at)) return false;
    start(at);
    return true;
  }

  Posterior posterior() const override {
    return {status_,
            {estimate_.mean.data(), M::kStates},
            {estimate_.covariance.data(), M::kStates * M::kStates},  // symmetric: column-major is row-major
            {innovation_.value.data(), M::kOutputs},
            {innovation_.covariance.data(), M::kOutputs * M::kOutputs},
            {},
            {},
            kkt_residual_};
  }

 protected:
  virtual void on_start() {}

  // Puts into `at` what a measured output fixes of a start, with its noise; false if it fixes nothing.
  bool start_at(int output, double z, Gaussian<M>& at) const {
    // The start is linear in z, so a unit step shows its slope.
    Vector<double, M::kStates> further = at.mean;
    if (!belief_.model.start_from(output, z, at.mean)) return false;
    belief_.model.start_from(output, z + 1.0, further);
    const Vector<double, M::kStates> slope = further - at.mean;
    at.covariance += slope * belief_.noise[static_cast<std::size_t>(output)].variance(z) * slope.transpose();
    return true;
  }

  static Vector<double, M::kInputs> input_of(const StepInput& step) {
    return Eigen::Map<const Vector<double, M::kInputs>>(step.input.data());
  }

  // Valid when finite with positive variances.
  void settle(EstimateStatus status_if_sound) {
    const bool sound =
        estimate_.mean.allFinite() && estimate_.covariance.allFinite() && (estimate_.covariance.diagonal().array() > 0.0).all();
    status_ = sound ? status_if_sound : EstimateStatus::kInvalid;
  }

  Belief<M> belief_;
  Gaussian<M> estimate_{};
  Innovation<M> innovation_{};
  double kkt_residual_ = -1.0;  // of who solves a program

 private:
  void start(const Gaussian<M>& at) {
    estimate_ = at;
    status_ = EstimateStatus::kInitialising;
    on_start();
  }

  EstimateStatus status_ = EstimateStatus::kInitialising;
};

}  // namespace slipstream
