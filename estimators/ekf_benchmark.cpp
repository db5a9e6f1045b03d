// The EKF's step through the process's own interface: dual-number Jacobians, both measurements, Joseph form.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "estimators/registry.hpp"
#include "models/sensors/all.hpp"

namespace slipstream {
namespace {

void ekf_step(benchmark::State& state) {
  Scenario scenario;
  for (const SensorType& type : kSensorTypes)
    scenario.sensors.push_back({std::string(type.name), std::string(type.quantity.name), 100.0, {0.05, 0.0}});
  Tuning tuning;
  tuning.process_variance = {{"wheel_speed_radps", 1e-3}, {"speed_mps", 1e-8}, {"friction", 5e-4}};
  tuning.initial_mean = {{"wheel_speed_radps", 9.0}, {"speed_mps", 4.6}, {"friction", 0.1}};
  tuning.initial_variance = {{"wheel_speed_radps", 0.01}, {"speed_mps", 0.001}, {"friction", 0.04}};
  scenario.estimator.tunings["matched"] = tuning;
  const std::unique_ptr<Estimator> ekf = make_estimator("ekf", scenario, "matched");
  ekf->start_given();
  // A drive that goes on for ever: the torque that keeps the speed, and noise that the compiler cannot foresee.
  std::array<std::array<double, 2>, 64> z{};
  for (std::size_t i = 0; i < z.size(); ++i)
    z[i] = {9.0 + 0.1 * static_cast<double>(i % 7), 0.5 + 0.01 * static_cast<double>(i % 5)};
  const std::array<double, 1> torque{715.0};
  std::size_t k = 0;
  for (auto _ : state) {
    ekf->step({0.01, torque, z[k++ % z.size()], 3U});
    benchmark::DoNotOptimize(ekf->posterior().mean[0]);
  }
}
BENCHMARK(ekf_step);

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
