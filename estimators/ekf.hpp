// Extended Kalman filter, for any process model: predict over the time that passed, update with what was measured
// (equations in kalman.hpp; document 002, eqs 3.18-3.21, with the Joseph form in place of P - W S W').
#pragma once

#include "estimators/gaussian_estimator.hpp"

namespace slipstream {

template <ProcessModel M>
class Ekf final : public GaussianEstimator<M> {
 public:
  using GaussianEstimator<M>::GaussianEstimator;

  void step(const StepInput& step) override {
    const Vector<double, M::kInputs> u = this->input_of(step);
    Gaussian<M> prior;
    if (step.dt_s > 0.0) {
      predict_into(this->belief_, this->estimate_, u, step.dt_s, prior);
    } else {
      prior = this->estimate_;
    }
    innovate_into(this->belief_, prior, u, step.measured_value.data(), step.measured, this->innovation_);
    update_into(prior, this->innovation_, this->estimate_);
    this->settle(EstimateStatus::kValid);
  }
};

}  // namespace slipstream
