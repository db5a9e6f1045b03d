// The unscented filters' steps, predict and update, four states: a mass in the plane with a constant velocity, two outputs, by
// the class itself; and the point-mass car, three outputs and a sine and cosine in each of four Runge-Kutta stages, through the
// registry. Both through the process's own interface. The EKF's beside them, for the ratio.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "estimators/ekf.hpp"
#include "estimators/registry.hpp"
#include "estimators/sqrt_ukf.hpp"
#include "estimators/ukf.hpp"
#include "tests/estimators/linear_model.hpp"

namespace slipstream {
namespace {

void run(benchmark::State& state, Estimator& estimator, const std::array<double, 2>& u, double speed_mps,
         std::uint32_t measured) {
  estimator.start_given();
  // Noise that the compiler cannot foresee, around where the start is.
  std::array<std::array<double, 3>, 64> z{};
  for (std::size_t i = 0; i < z.size(); ++i)
    z[i] = {0.1 * static_cast<double>(i % 7), 0.05 * static_cast<double>(i % 5), speed_mps + 0.1 * static_cast<double>(i % 3)};
  std::size_t k = 0;
  for (auto _ : state) {
    estimator.step({0.025, u, z[k++ % z.size()], measured});
    benchmark::DoNotOptimize(estimator.posterior().mean[0]);
  }
}

template <typename Filter, typename... Form>
void plane(benchmark::State& state, const Form&... form) {
  Belief<test::PlaneModel> b;
  b.noise = {{{0.0, 0.3}, {0.0, 0.3}}};
  b.process_variance = {1e-3, 1e-3, 1e-2, 1e-2};
  b.initial_variance = {1.0, 1.0, 1.0, 1.0};
  const std::unique_ptr<Estimator> filter = std::make_unique<Filter>(b, form...);
  run(state, *filter, {0.1, 0.01}, 0.0, 3U);
}
const SigmaPoints kPoints = sigma_points(test::PlaneModel::kStates, "states", 1.0, 2.0, 0.0);
void plane_ukf(benchmark::State& state) { plane<Ukf<test::PlaneModel>>(state, kPoints, true); }
void plane_ukf_reused(benchmark::State& state) { plane<Ukf<test::PlaneModel>>(state, kPoints, false); }
void plane_sqrt_ukf(benchmark::State& state) { plane<SqrtUkf<test::PlaneModel>>(state, kPoints, true); }
void plane_ekf(benchmark::State& state) { plane<Ekf<test::PlaneModel>>(state); }
BENCHMARK(plane_ukf);
BENCHMARK(plane_ukf_reused);
BENCHMARK(plane_sqrt_ukf);
BENCHMARK(plane_ekf);

void point_mass(benchmark::State& state, const char* algorithm, bool redraw) {
  Scenario scenario;
  scenario.sensors = {{"east_position", "east_m", 40.0, {0.0, 10.0}},
                      {"north_position", "north_m", 40.0, {0.0, 10.0}},
                      {"forward_speed", "forward_speed_mps", 40.0, {0.0, 10.0}}};
  scenario.estimator.process = PointMassMotion{};
  Tuning tuning;
  tuning.process_noise = "step";
  tuning.process_variance = {{"east_m", 0.016}, {"north_m", 0.016}, {"speed_mps", 1e-3}, {"heading_rad", 1e-6}};
  tuning.initial_mean = {{"speed_mps", 60.0}};
  tuning.initial_variance = {{"east_m", 1.0}, {"north_m", 1.0}, {"speed_mps", 1.0}, {"heading_rad", 1e-4}};
  tuning.ukf_redraw = redraw;
  scenario.estimator.tunings["matched"] = tuning;
  run(state, *make_estimator(algorithm, scenario, "matched"), {1.0, 0.01}, 60.0, 7U);
}
BENCHMARK_CAPTURE(point_mass, ukf, "ukf", true);
BENCHMARK_CAPTURE(point_mass, ukf_reused, "ukf", false);
BENCHMARK_CAPTURE(point_mass, sqrt_ukf, "sqrt_ukf", true);
BENCHMARK_CAPTURE(point_mass, ekf, "ekf", true);

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
