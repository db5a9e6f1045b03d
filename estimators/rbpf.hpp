// Rao-Blackwellised particle filter (RBPF): SIR over the states that a model does not declare conditionally linear, a Kalman
// filter in each particle for the others. Steps: particle_filter.hpp; particles: marginalised_cloud.hpp; failures:
// particle_estimator.hpp, where a set that has lost the state is drawn anew with each particle's Gaussian. There is no credible
// interval.
#pragma once

#include "estimators/marginalised_cloud.hpp"
#include "estimators/particle_filter.hpp"

namespace slipstream {

template <ProcessModel M>
using RaoBlackwellisedFilter = SirFilter<M, MarginalisedCloud<M>>;

}  // namespace slipstream
