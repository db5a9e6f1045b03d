// A particle filter's step through the process's own interface, resampling at every step: wheel and friction from the wheel
// speed alone (document 002, section 7.1), and with the vehicle's speed as a third state. One iteration is 10 s at 100 Hz: 1000
// steps. The figure to compare is us_per_step.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "estimators/registry.hpp"

namespace slipstream {
namespace {

void steps(benchmark::State& state, const char* algorithm, const AnyProcess& process) {
  Scenario scenario;
  scenario.sensors = {{"wheel_speed", "wheel_speed_radps", 100.0, {0.05, 0.0}}};
  scenario.estimator.process = process;
  Tuning tuning;
  tuning.process_variance = {{"wheel_speed_radps", 1e-3}, {"speed_mps", 1e-4}, {"friction", 5e-4}};
  tuning.initial_mean = {{"wheel_speed_radps", 9.0}, {"speed_mps", 4.68}, {"friction", 0.1}};
  tuning.initial_variance = {{"wheel_speed_radps", 0.01}, {"speed_mps", 0.01}, {"friction", 0.04}};
  tuning.pf_particles = static_cast<int>(state.range(0));
  tuning.pf_resample_below = 1.0;
  scenario.estimator.tunings["matched"] = tuning;
  const std::unique_ptr<Estimator> pf = make_estimator(algorithm, scenario, "matched");
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
  state.counters["us_per_step"] =
      benchmark::Counter(kSteps * 1e-6, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

#define SLIPSTREAM_STEPS(algorithm, model, process) \
  BENCHMARK_CAPTURE(steps, algorithm##_##model, #algorithm, process)->Unit(benchmark::kMillisecond)
SLIPSTREAM_STEPS(pf, wheel_friction, WheelFriction{})->Arg(50)->Arg(1000)->Arg(5000);
SLIPSTREAM_STEPS(pf, longitudinal_friction, LongitudinalFriction{})->Arg(1000)->Arg(5000);
SLIPSTREAM_STEPS(asir, wheel_friction, WheelFriction{})->Arg(1000)->Arg(5000);
SLIPSTREAM_STEPS(rbpf, wheel_friction, WheelFriction{})->Arg(50)->Arg(1000);
#undef SLIPSTREAM_STEPS

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
