// The steps of EKF, UKF, hierarchical EKF, real-time iteration, bank of models, particle filters and strapdown filters allocate
// nothing on the heap. The C library's allocator is counted in this whole test program.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>

#include "estimators/asir.hpp"
#include "estimators/ekf.hpp"
#include "estimators/hierarchical.hpp"
#include "estimators/imm.hpp"
#include "estimators/navigation.hpp"
#include "estimators/particle_filter.hpp"
#include "estimators/rbpf.hpp"
#include "estimators/rti.hpp"
#include "estimators/sqrt_ukf.hpp"
#include "estimators/ukf.hpp"

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SLIPSTREAM_COUNTS_ALLOCATIONS 1
namespace {
std::atomic<long> g_allocations{0};
}
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* malloc(std::size_t size) {
  ++g_allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++g_allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) {
  ++g_allocations;
  return __libc_realloc(p, size);
}
}
#endif

namespace slipstream::test {
namespace {

#ifdef SLIPSTREAM_COUNTS_ALLOCATIONS
Belief<LongitudinalFriction> belief() {
  Belief<LongitudinalFriction> b;
  b.noise = {{{0.05, 0.0}, {0.05, 0.0}}};
  b.process_variance = {1e-3, 1e-8, 5e-4};
  b.initial_mean = {0.5, 0.26, 0.0};
  b.initial_variance = {0.01, 0.001, 0.04};
  return b;
}

long allocations_of_steps(Estimator& estimator) {
  estimator.start_given();
  const std::array<double, 1> u{1400.0};
  const std::array<double, 2> z{0.5, 1.1};
  const long before = g_allocations;
  for (std::uint32_t k = 0; k < 1000; ++k) estimator.step({k % 100 == 99 ? 0.5 : 0.01, u, z, k % 4});
  return g_allocations - before;
}

long allocations_of_steps(const NavigationFilter& filter) {
  NavigationBelief b;
  b.P.diagonal().setConstant(0.01);
  NavigationMeasurement fix, speed;
  fix.l = {1.0, 0.0, 1.5};
  speed.kind = NavigationMeasurement::kBodyVelocity;
  speed.size = 2;
  const long before = g_allocations;
  for (int k = 0; k < 1000; ++k) {
    filter.predict(b, {{0.1, 0.2, 9.81}, {0.0, 0.0, 0.1}}, {0.01, 0.001, 1e-6, 1e-8}, 0.01);
    filter.update(b, k % 2 == 0 ? fix : speed, 100.0);
  }
  return g_allocations - before;
}
#endif

TEST(NoHeap, StepsAllocateNothing) {
#ifndef SLIPSTREAM_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "the allocator cannot be counted in this build";
#else
  const std::unique_ptr<Estimator> ekf = std::make_unique<Ekf<LongitudinalFriction> >(belief());
  EXPECT_EQ(allocations_of_steps(*ekf), 0);
  const SigmaPoints points = sigma_points(LongitudinalFriction::kStates, "states", 1.0, 2.0, 0.0);
  for (const bool redraw : {true, false}) {
    EXPECT_EQ(allocations_of_steps(*std::make_unique<Ukf<LongitudinalFriction> >(belief(), points, redraw)), 0);
    EXPECT_EQ(allocations_of_steps(*std::make_unique<SqrtUkf<LongitudinalFriction> >(belief(), points, redraw)), 0);
  }
  const Belief<WheelFriction> first{WheelFriction{}, belief().noise, {1e-3, 5e-4}, false, {0.5, 0.0}, {0.01, 0.04}};
  Hierarchical hierarchical(belief(), first, std::make_unique<Ekf<WheelFriction> >(first));
  EXPECT_EQ(allocations_of_steps(hierarchical), 0);
  Belief<LongitudinalFriction> bounded = belief();
  bounded.upper[2] = 0.1;
  for (const int window : {1, 4, 20}) {
    EXPECT_EQ(allocations_of_steps(*std::make_unique<RtiMhe<LongitudinalFriction> >(bounded, window)), 0);
    bounded.noise = {{{0.0, 0.05}, {0.0, 0.05}}};
    EXPECT_EQ(allocations_of_steps(
                  *std::make_unique<RtiSingleShooting<LongitudinalFriction> >(bounded, window, Eigen::Vector3d::Ones())),
              0);
  }
  const Belief<TyreFriction> road{TyreFriction{}, belief().noise,   {1e-4, 1e-6, 0.0},
                                  false,          {10.0, 5.2, 0.6}, {0.01, 0.001, 0.1}};
  EXPECT_EQ(allocations_of_steps(*std::make_unique<Imm<TyreFriction> >(road)), 0);
  for (const Resampling method : {Resampling::kSystematic, Resampling::kStratified, Resampling::kResidual}) {
    const ParticleSettings settings{100, method, 0.5, true};
    const RandomStream random(1, 0, "estimator.pf");
    EXPECT_EQ(allocations_of_steps(*std::make_unique<ParticleFilter<LongitudinalFriction> >(belief(), settings, random)), 0);
    EXPECT_EQ(
        allocations_of_steps(*std::make_unique<AuxiliaryParticleFilter<LongitudinalFriction> >(belief(), settings, random)), 0);
    EXPECT_EQ(
        allocations_of_steps(*std::make_unique<RaoBlackwellisedFilter<LongitudinalFriction> >(belief(), settings, random)), 0);
  }

  for (const bool biases : {true, false}) {
    StrapdownTuning tuning;
    tuning.biases = biases;
    EXPECT_EQ(allocations_of_steps(*make_es_ekf({}, tuning)), 0);
    EXPECT_EQ(allocations_of_steps(*make_navigation_ukf({}, tuning)), 0);
  }

  const long counted = g_allocations;
  const auto proof = std::make_unique<std::array<double, 8> >();
  EXPECT_GT(g_allocations - counted, 0) << "the counter must see an allocation: " << proof.get();
#endif
}

}  // namespace
}  // namespace slipstream::test
