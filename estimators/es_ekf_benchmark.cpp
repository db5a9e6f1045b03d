// The error-state filter's two halves with all 15 error states: a prediction, and an update with a position fix.
#include <benchmark/benchmark.h>

#include <limits>

#include "estimators/navigation.hpp"

namespace slipstream {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kStep_s = 0.005;

StrapdownTuning tuning(const benchmark::State& state) {
  StrapdownTuning t;
  t.biases = state.range(0) == 15;
  t.orientation_error = state.range(1) == 0 ? "global" : "local";
  return t;
}

// A drive in a circle, and noise that the compiler cannot foresee.
std::array<Inertial, 64> readings() {
  std::array<Inertial, 64> r;
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double noise = 0.01 * static_cast<double>(i % 7);
    r[i] = {{0.3 + noise, 2.0 - noise, 9.81 + noise}, {0.02 - noise, 0.01 + noise, 0.3}};
  }
  return r;
}

NavigationBelief start(const benchmark::State& state) {
  NavigationBelief b;
  b.x.v_WS = {6.6, 0.0, 0.0};
  ErrorVector variance;
  variance << Vector3::Constant(1.0), Vector3::Constant(0.1), Vector3::Constant(1e-3), Vector3::Constant(1e-2),
      Vector3::Constant(1e-4);
  b.P.diagonal().head(state.range(0)) = variance.head(state.range(0));
  return b;
}

// A session rewinds to a belief it has stored: every iteration begins with one, so the covariance neither grows nor vanishes.
void predict(benchmark::State& state) {
  const auto filter = make_es_ekf({}, tuning(state));
  const std::array<Inertial, 64> reading = readings();
  const NavigationBelief first = start(state);
  NavigationBelief belief = first;
  std::size_t k = 0;
  for (auto _ : state) {
    filter->predict(belief, reading[k % reading.size()], {1e-3, 1e-4, 1e-6, 1e-8}, kStep_s);
    benchmark::DoNotOptimize(belief);
    if (++k % 256 == 0) belief = first;
  }
}
BENCHMARK(predict)->ArgNames({"states", "local"})->ArgsProduct({{15, 9}, {0, 1}});

// arm: of the antenna, m.
void update(benchmark::State& state) {
  const auto filter = make_es_ekf({}, tuning(state));
  const NavigationBelief first = start(state);
  NavigationBelief belief = first;
  NavigationMeasurement fix;
  fix.R = Vector3(0.01, 0.01, 0.04).asDiagonal();
  fix.l = {static_cast<double>(state.range(2)), 0.0, 1.5 * static_cast<double>(state.range(2))};
  std::size_t k = 0;
  for (auto _ : state) {
    fix.z = {0.01 * static_cast<double>(k % 7), 0.0, 1.5};
    const NavigationInnovation i = filter->update(belief, fix, kNever);
    benchmark::DoNotOptimize(i.nis);
    benchmark::DoNotOptimize(belief);
    if (++k % 16 == 0) belief = first;
  }
}
BENCHMARK(update)->ArgNames({"states", "local", "arm"})->ArgsProduct({{15, 9}, {0, 1}, {0, 1}});

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
