// Auxiliary particle filter (ASIR): looks at the measurement before it draws, so that few particles are drawn in vain.
//
//   first stage    mu_i = f(x_i, u, dt),   lambda_i ~ w_i p(z | mu_i)
//   resample       ancestors a_j by lambda, when N_eff of lambda < resample_below N; always where resample_below is 1. Where
//   not,
//                  a_j = j and the weights stay
//   draw           x_j = mu_{a_j} + sqrt(Q(dt)) xi,  xi ~ N(0, I)
//   second stage   w_j ~ p(z | x_j) / p(z | mu_{a_j})    (times w_j where it was not resampled)
//
// Better than SIR where a measurement is precise beside the spread of the set, and the process noise small beside that; with
// much process noise mu says little of where x will be, and the weights vary more than SIR's. The innovation is that of the
// points mu_i under the weights before z; the process noise adds H Q H', H at their mean. Without a measurement, or over no
// time, a step is SIR's without resampling. Estimate and failures: particle_estimator.hpp.
//
// Pitt and Shephard, J. American Statistical Association 94 (1999), section 3; Arulampalam et al. (2002), algorithm 5.
#pragma once

#include <vector>

#include "estimators/particle_estimator.hpp"

namespace slipstream {

template <ProcessModel M>
class AuxiliaryParticleFilter final : public ParticleEstimator<M> {
 public:
  AuxiliaryParticleFilter(const Belief<M>& belief, const ParticleSettings& settings, const RandomStream& random)
      : ParticleEstimator<M>(belief, settings, random), likelihood_(this->cloud_.set().padded()) {}

  void step(const StepInput& step) override {
    auto& cloud = this->cloud_;
    const auto u = this->input_of(step);
    const bool in_two_stages = step.measured != 0U && step.dt_s > 0.0;
    auto seen = cloud.judge(u, step, this->estimate_.mean, {true, !in_two_stages, nullptr});
    if (!seen.finite) {
      if (!cloud.set().replace_lost()) return this->give_up();
      seen = cloud.judge(u, step, this->estimate_.mean, {false, false, nullptr});
    }
    if (in_two_stages) {
      auto innovation = seen.innovation;
      add_process_noise(u, step, innovation);
      const double* const relief = first_stage(seen.greatest);
      seen = cloud.judge(u, step, this->estimate_.mean, {false, true, relief});
      seen.innovation = innovation;
    }
    this->conclude(u, step, seen);
    cloud.set().normalise();
  }

 private:
  // Resamples by what is seen at mu. Log-likelihoods at mu, to be taken off again; none where all have vanished.
  const double* first_stage(double greatest) {
    auto& set = this->cloud_.set();
    const double *const before = set.log_weights(), *const after = set.new_log_weights();
    for (std::size_t i = 0; i < set.padded(); ++i) likelihood_[i] = after[i] - before[i];
    const double effective = set.weigh(greatest, this->estimate_.mean);
    if (effective == 0.0) return nullptr;
    if (this->is_few(effective)) {
      this->cloud_.resample(&likelihood_);
    } else {
      set.normalise();
    }
    return likelihood_.data();
  }

  void add_process_noise(const typename ParticleEstimator<M>::Input& u, const StepInput& step, Innovation<M>& to) const {
    Vector<double, M::kOutputs> h;
    Matrix<double, M::kOutputs, M::kStates> jacobian;
    const auto mean = this->cloud_.moments(this->estimate_.mean).mean;
    value_and_jacobian<M::kOutputs>([&](const auto& x) { return this->belief_.model.output(x, u); }, mean, h, jacobian);
    const Matrix<double, M::kOutputs> more =
        jacobian * this->belief_.process_covariance(step.dt_s).asDiagonal() * jacobian.transpose();
    for (int k = 0; k < M::kOutputs; ++k)
      for (int j = 0; j < M::kOutputs; ++j)
        if ((step.measured >> k & step.measured >> j & 1U) != 0U) to.covariance(k, j) += more(k, j);
    for (std::size_t k = 0; k < M::kOutputs; ++k)  // R of what varies more is more, too
      if ((step.measured >> k & 1U) != 0U)
        to.covariance(static_cast<int>(k), static_cast<int>(k)) +=
            this->belief_.noise[k].relative * this->belief_.noise[k].relative * more(static_cast<int>(k), static_cast<int>(k));
  }

  std::vector<double> likelihood_;
};

}  // namespace slipstream
