// Does the 95 % interval hold what it promises, over many synthetic runs?
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/identification/synthetic_stand.hpp"

namespace slipstream {
namespace {

struct Repetitions {
  int inertia_inside = 0, friction_inside = 0;
  std::vector<double> inertia, friction, inertia_half_width, friction_half_width, r2, iterations;
};

Repetitions repeat(Method method, std::uint64_t first_seed, int count) {
  const Scenario scenario = test::stand_scenario();
  const auto& truth = std::get<SuspendedWheel>(scenario.plant.vehicle);
  Repetitions all;
  for (int k = 0; k < count; ++k) {
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(k);
    StandSettings settings;
    settings.swarm.seed = seed;
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

// Not a test but the figures: --gtest_also_run_disabled_tests --gtest_filter=*Figures*
TEST(StandCoverage, DISABLED_Figures) {
  for (const Method method : {Method::kRungeKutta, Method::kExact})
    for (const auto& [first, count] : {std::pair{1001, 20}, std::pair{1001, 1}}) {
      const Repetitions r = repeat(method, static_cast<std::uint64_t>(first), count);
      std::printf("%s seeds %d..%d: inside J %d b %d; median iterations %g J %.4e +- %.1e b %.4e +- %.1e R2 %.5f", method == Method::kExact ? "LSIM" : "RK",
                  first, first + count - 1, r.inertia_inside, r.friction_inside, median(r.iterations), median(r.inertia),
                  median(r.inertia_half_width), median(r.friction), median(r.friction_half_width), median(r.r2));
      if (count > 1)
        std::printf("; mean J %.5e s %.1e b %.5e s %.1e", mean(r.inertia), deviation(r.inertia), mean(r.friction), deviation(r.friction));
      std::printf("\n");
    }
}

}  // namespace
}  // namespace slipstream
