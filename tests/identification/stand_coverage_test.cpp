// Does the 95 % interval hold what it promises, over many synthetic runs?
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "tests/identification/synthetic_stand.hpp"

namespace slipstream {
namespace {

struct Repetitions {
  int inertia_inside = 0, friction_inside = 0;
  std::vector<double> inertia, friction, inertia_half_width, friction_half_width, r2, iterations;
};

Repetitions repeat(Method method, std::uint64_t first_seed, int count, int particles) {
  const Scenario scenario = test::stand_scenario();
  const auto& truth = std::get<SuspendedWheel>(scenario.plant.vehicle);
  Repetitions all;
  for (int k = 0; k < count; ++k) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(k);
    StandSettings settings;
    settings.swarm.seed = seed;
    settings.swarm.particles = particles;
    const StandFit fit = identify_stand(test::record_of(scenario, seed), settings, {method}).fits[0];
    all.inertia_inside += fit.inertia_kgm2.contains(truth.wheel_inertia_kgm2);
    all.friction_inside += fit.friction_nms.contains(truth.viscous_friction_nms);
    all.inertia.push_back(fit.inertia_kgm2.value);
    all.friction.push_back(fit.friction_nms.value);
    all.inertia_half_width.push_back(fit.inertia_kgm2.half_width);
    all.friction_half_width.push_back(fit.friction_nms.half_width);
    all.r2.push_back(fit.r2);
    all.iterations.push_back(fit.iterations);
  }
  return all;
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
}
double mean(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}
double deviation(const std::vector<double>& v) {
  double sum = 0.0;
  for (const double x : v) sum += (x - mean(v)) * (x - mean(v));
  return std::sqrt(sum / static_cast<double>(v.size() - 1));
}

// A 95 % interval holds in 38 of 40 on average; with the bar of 90 % it may miss 4 times. The swarm is smaller than the
// document's to save time: in two dimensions it finds the same minimum.
TEST(StandCoverage, IntervalsHoldTheTruthInNineOfTen) {
  const Repetitions r = repeat(Method::kExact, 1, 40, 60);
  EXPECT_GE(r.inertia_inside, 36);
  EXPECT_GE(r.friction_inside, 36);
  EXPECT_GE(median(r.r2), 0.989);  // the document's 0.98892, to its third digit
  // Intervals are neither generous nor mean: their half width is 1.96 standard deviations of the estimates, which 40 runs tell
  // to 11 % (one standard error); the lag's price is up to 30 %.
  EXPECT_NEAR(median(r.inertia_half_width) / (1.96 * deviation(r.inertia)), 1.0, 0.45);
  EXPECT_NEAR(median(r.friction_half_width) / (1.96 * deviation(r.friction)), 1.0, 0.45);
  // The noise of the current enters the response: were its bias large, the mean of 40 would be off by more than 3 standard
  // errors and this share of an interval, 3 / sqrt(40) / 1.96 = 0.24.
  EXPECT_LT(std::abs(mean(r.inertia) - 3.2e-3), 0.24 * median(r.inertia_half_width));
  EXPECT_LT(std::abs(mean(r.friction) - 0.01), 0.24 * median(r.friction_half_width));
}

void print(const char* name, const Repetitions& r) {
  std::printf("%-5s inside: J %d b %d of %zu; medians: iterations %g, J %.4e +- %.1e, b %.4e +- %.1e, R2 %.5f", name,
              r.inertia_inside, r.friction_inside, r.r2.size(), median(r.iterations), median(r.inertia),
              median(r.inertia_half_width), median(r.friction), median(r.friction_half_width), median(r.r2));
  if (r.r2.size() > 1)
    std::printf("; mean J %.5e s %.1e, mean b %.5e s %.1e", mean(r.inertia), deviation(r.inertia), mean(r.friction),
                deviation(r.friction));
  std::printf("\n");
}

// The figures of Table 6 rather than a test: --gtest_also_run_disabled_tests --gtest_filter=*Figures
TEST(StandCoverage, DISABLED_Figures) {
  for (const auto& [name, method] : {std::pair{"RK", Method::kRungeKutta}, std::pair{"LSIM", Method::kExact}})
    for (const int count : {1, 20, 100}) {
      const Repetitions r = repeat(method, 1, count, 200);
      print(name, r);
      EXPECT_GE(r.inertia_inside, count * 9 / 10);
      EXPECT_GE(r.friction_inside, count * 9 / 10);
    }
}

}  // namespace
}  // namespace slipstream
