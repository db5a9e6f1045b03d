#include "estimators/identification/particle_swarm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slipstream {
namespace {

double rosenbrock(const std::vector<double>& x) { return 100.0 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1.0 - x[0], 2); }

TEST(ParticleSwarm, FindsTheMinimumOfRosenbrocksValley) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const SwarmResult r =
        minimise(rosenbrock, {-5.0, -5.0}, {5.0, 5.0}, {.max_iterations = 300, .tolerance = 1e-12, .seed = seed});
    EXPECT_TRUE(r.converged);
    EXPECT_LT(r.iterations, 300);
    EXPECT_NEAR(r.best[0], 1.0, 1e-3) << seed;  // the valley is flat: 1e-12 of value is 1e-6 along it; thousand times that
    EXPECT_NEAR(r.best[1], 1.0, 2e-3) << seed;  // twice, along x1 = x0^2
    EXPECT_EQ(r.value, rosenbrock(r.best));
  }
}

TEST(ParticleSwarm, FindsAMinimumOnTheEdgeOfTheBox) {
  const SwarmResult r = minimise([](const std::vector<double>& x) { return x[0] + (x[1] - 2.0) * (x[1] - 2.0); }, {1.0, 0.0},
                                 {3.0, 5.0}, {.tolerance = 1e-12});
  EXPECT_NEAR(r.best[0], 1.0, 1e-9);  // particles that cross the bound are put on it
  EXPECT_NEAR(r.best[1], 2.0, 1e-4);  // square root of a value of 1e-8
}

TEST(ParticleSwarm, SameSeedSameBitsOtherSeedOtherPath) {
  const auto run = [](std::uint64_t seed) { return minimise(rosenbrock, {-5.0, -5.0}, {5.0, 5.0}, {.seed = seed}); };
  const SwarmResult a = run(1), again = run(1), other = run(2);
  EXPECT_EQ(a.best, again.best);
  EXPECT_EQ(a.history, again.history);
  EXPECT_NE(a.history, other.history);
}

TEST(ParticleSwarm, StopsByItsRule) {
  int calls = 0;
  const auto flat = [&](const std::vector<double>&) { return ++calls, 3.0; };
  const SwarmResult r = minimise(flat, {0.0}, {1.0}, {.particles = 10, .max_iterations = 50, .patience = 7});
  EXPECT_TRUE(r.converged);
  EXPECT_EQ(r.iterations, 7);  // nothing has improved over 7 iterations at the first chance to say so
  EXPECT_EQ(calls, 10 * 8);    // the start and 7 iterations
  EXPECT_EQ(r.history.size(), 8u);

  double value = 1e3;
  const auto falling = [&](const std::vector<double>&) { return value -= 1e-3; };
  const SwarmResult s = minimise(falling, {0.0}, {1.0}, {.particles = 10, .max_iterations = 30});
  EXPECT_FALSE(s.converged);
  EXPECT_EQ(s.iterations, 30);
  for (std::size_t k = 1; k < s.history.size(); ++k) EXPECT_LT(s.history[k], s.history[k - 1]);
}

TEST(ParticleSwarm, WhatIsNotFiniteIsWorst) {
  const auto f = [](const std::vector<double>& x) {
    return x[0] < 0.5 ? std::numeric_limits<double>::quiet_NaN() : (x[0] - 0.7) * (x[0] - 0.7);
  };
  const SwarmResult r = minimise(f, {0.0}, {1.0}, {.tolerance = 1e-12});
  EXPECT_NEAR(r.best[0], 0.7, 1e-4);  // square root of a value of 1e-8
}

}  // namespace
}  // namespace slipstream
