// The EKF's step through the process's own interface: dual-number Jacobians, both measurements, Joseph form.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "estimators/ekf.hpp"
#include "models/processes/longitudinal_friction.hpp"

namespace slipstream {
namespace {

void ekf_step(benchmark::State& state) {
  Belief<LongitudinalFriction> belief;
  belief.noise = {{{0.05, 0.0}, {0.05, 0.0}}};
  belief.process_variance = {1e-3, 1e-8, 5e-4};
  belief.initial_mean = {9.0, 4.6, 0.1};
  belief.initial_variance = {0.01, 0.001, 0.04};
  const std::unique_ptr<Estimator> ekf = std::make_unique<Ekf<LongitudinalFriction>>(belief);
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
