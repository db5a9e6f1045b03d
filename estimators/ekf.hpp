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
    if (step.dt_s > 0.0) this->estimate_ = predict(this->belief_, this->estimate_, u, step.dt_s);
    this->innovation_ = innovate(this->belief_, this->estimate_, u, step.measured_value.data(), step.measured);
    this->estimate_ = update(this->estimate_, this->innovation_);
    this->settle(EstimateStatus::kValid);
  }
};

}  // namespace slipstream
