// The steps of the EKF and of the hierarchical EKF allocate nothing on the heap. The C library's allocator is counted in this
// whole test program.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>

#include "estimators/ekf.hpp"
#include "estimators/hierarchical.hpp"

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

TEST(NoHeap, EkfAndHierarchicalEkfStepsAllocateNothing) {
#ifndef SLIPSTREAM_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "the allocator cannot be counted in this build";
#else
  Belief<LongitudinalFriction> belief;
  belief.noise = {{{0.05, 0.0}, {0.05, 0.0}}};
  belief.process_variance = {1e-3, 1e-8, 5e-4};
  belief.initial_mean = {0.5, 0.26, 0.0};
  belief.initial_variance = {0.01, 0.001, 0.04};
  const Belief<WheelFriction> first{WheelFriction{}, belief.noise, {1e-3, 5e-4}, false, {0.5, 0.0}, {0.01, 0.04}};
  const std::array<double, 1> u{1400.0};
  const std::array<double, 2> z{0.5, 1.1};
  const std::array<std::unique_ptr<Estimator>, 2> estimators{
      std::make_unique<Ekf<LongitudinalFriction> >(belief),
      std::make_unique<Hierarchical>(belief, first, std::make_unique<Ekf<WheelFriction> >(first))};
  for (const std::unique_ptr<Estimator>& estimator : estimators) {
    estimator->start_given();
    const long before = g_allocations;
    for (std::uint32_t k = 0; k < 1000; ++k) estimator->step({k % 100 == 99 ? 0.5 : 0.01, u, z, k % 4});
    EXPECT_EQ(g_allocations - before, 0);
  }

  const long counted = g_allocations;
  const auto proof = std::make_unique<std::array<double, 8> >();
  EXPECT_GT(g_allocations - counted, 0) << "the counter must see an allocation: " << proof.get();
#endif
}

}  // namespace
}  // namespace slipstream::test
