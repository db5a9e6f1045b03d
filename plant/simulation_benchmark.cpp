// The whole simulated drive of the Unimog with its default parameters, sensors and noise included: how many times faster than
// real time.
#include <benchmark/benchmark.h>

#include "models/sensors/all.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream {
namespace {

void unimog_drive(benchmark::State& state) {
  Scenario scenario;
  scenario.run.duration_s = 10.0;
  const auto rate_hz = static_cast<double>(state.range(0));
  for (const SensorType& type : kSensorTypes)
    scenario.sensors.push_back({std::string(type.name), std::string(type.quantity.name), rate_hz, {0.05, 0.0}});
  scenario.plant.input_rate_hz = scenario.plant.truth_rate_hz = rate_hz;
  for (auto _ : state) {
    const auto drive = make_simulated_drive(scenario);
    DriveEpoch epoch;
    while (drive->next(epoch)) benchmark::DoNotOptimize(epoch.readings.data());
  }
  state.counters["times_real_time"] =
      benchmark::Counter(scenario.run.duration_s * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(unimog_drive)->ArgName("sensor_hz")->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace slipstream

BENCHMARK_MAIN();
