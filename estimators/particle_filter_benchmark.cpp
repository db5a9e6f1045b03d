// The particle filter's step through the process's own interface, resampling at every step: wheel and friction from the wheel
// speed alone (document 002, section 7.1). One iteration is 10 s at 100 Hz: 1000 steps.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "estimators/registry.hpp"

namespace slipstream {
namespace {

void pf_1000_steps(benchmark::State& state) {
  Scenario scenario;
  scenario.sensors = {{"wheel_speed", "wheel_speed_radps", 100.0, {0.05, 0.0}}};
  scenario.estimator.process = WheelFriction{};
  Tuning tuning;
  tuning.process_variance = {{"wheel_speed_radps", 1e-3}, {"friction", 5e-4}};
  tuning.initial_mean = {{"wheel_speed_radps", 9.0}, {"friction", 0.1}};
  tuning.initial_variance = {{"wheel_speed_radps", 0.01}, {"friction", 0.04}};
  tuning.pf_particles = static_cast<int>(state.range(0));
  tuning.pf_resample_below = 1.0;
  scenario.estimator.tunings["matched"] = tuning;
  const std::unique_ptr<Estimator> pf = make_estimator("pf", scenario, "matched");
  // A drive that goes on for ever: about the torque that keeps the speed, and noise that the compiler cannot foresee.
  std::array<std::array<double, 2>, 64> z{};
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = {9.0 + 0.1 * static_cast<double>(i % 7), 0.0};
  const std::array<double, 1> torque{1224.0};
  constexpr int kSteps = 1000;
  pf->start_given();
  std::size_t k = 0;
  for (auto _ : state)
    for (int i = 0; i < kSteps; ++i) {
      pf->step({0.01, torque, z[k++ % z.size()], 1U});
      benchmark::DoNotOptimize(pf->posterior().mean[0]);
    }
  const double per_step = kSteps;
  state.counters["ns_per_particle_and_step"] =
      benchmark::Counter(per_step * static_cast<double>(state.range(0)) * 1e-9,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(pf_1000_steps)->Arg(50)->Arg(1000)->Arg(5000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
