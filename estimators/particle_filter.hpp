// Particle filter with sampling importance resampling (SIR), for any process model.
//
//   predict   x_i = f(x_i, u, dt) + sqrt(Q(dt)) xi,  xi ~ N(0, I)
//   weigh     w_i ~ w_i p(z | x_i)
//   resample  when N_eff < resample_below N; always where resample_below is 1
//
// Each line's formulas are in particle_cloud.hpp and resampling.hpp, estimate and failures in particle_estimator.hpp.
// Document 002, section 3.5.1 and Table 2; Arulampalam et al. (2002), algorithm 4. Cost grows with N n.
#pragma once

#include "estimators/particle_estimator.hpp"

namespace slipstream {

template <ProcessModel M, typename Cloud = ParticleCloud<M>>
class SirFilter final : public ParticleEstimator<M, Cloud> {
 public:
  using ParticleEstimator<M, Cloud>::ParticleEstimator;

  void step(const StepInput& step) override {
    auto& cloud = this->cloud_;
    const auto u = this->input_of(step);
    auto seen = cloud.judge(u, step, this->estimate_.mean, {});
    if (!seen.finite) {
      if (!cloud.set().replace_lost()) return this->give_up();
      seen = cloud.judge(u, step, this->estimate_.mean, {false, false, nullptr});
    }
    const double effective = this->conclude(u, step, seen);
    if (effective > 0.0 && this->is_few(effective)) {
      cloud.resample();
    } else {
      cloud.set().normalise();
    }
  }
};

template <ProcessModel M>
using ParticleFilter = SirFilter<M>;

}  // namespace slipstream
