#include "plant/simulated_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/random.hpp"
#include "common/refusal.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {

namespace {

// The instants 0, 1/rate, 2/rate, ...
class Schedule {
 public:
  explicit Schedule(double rate_hz) : rate_hz_(rate_hz) {}
  Utime next() const { return static_cast<Utime>(std::llround(static_cast<double>(k_) / rate_hz_ / kSecondsPerUtime)); }
  void pass() { ++k_; }

 private:
  double rate_hz_;
  std::int64_t k_ = 0;
};

struct Sensor {
  Schedule schedule;
  std::size_t truth_index;
  NoiseLaw noise;
  RandomStream random;
};

template <Vehicle V>
class SimulatedDrive final : public DriveSource {
 public:
  SimulatedDrive(const V& vehicle, const Scenario& scenario)
      : simulation_(vehicle, {scenario.plant.relative_tolerance, scenario.plant.absolute_tolerance}),
        input_(scenario.plant.input_rate_hz),
        truth_(scenario.plant.truth_rate_hz),
        end_(static_cast<Utime>(std::llround(scenario.run.duration_s / kSecondsPerUtime))) {
    for (const Quantity& q : V::kTruth) {
      truth_names_.emplace_back(q.name);
      truth_units_.emplace_back(q.unit);
    }
    for (const Quantity& q : V::kInputs) quantities_.emplace_back(q.name);
    for (const SensorConfig& s : scenario.sensors) {
      const auto found = std::find(truth_names_.begin(), truth_names_.end(), s.quantity);
      if (found == truth_names_.end())
        throw Refusal(fmt::format("sensor.{}: the vehicle '{}' has no '{}' to measure", s.type, V::kName, s.quantity));
      sensors_.push_back({Schedule(s.rate_hz), static_cast<std::size_t>(found - truth_names_.begin()), s.noise,
                          RandomStream(scenario.run.seed, 0, "sensor." + s.type)});
      quantities_.push_back(s.quantity);
    }
  }

  const std::vector<std::string>& quantities() const override { return quantities_; }
  const std::vector<std::string>& truth_names() const override { return truth_names_; }
  const std::vector<std::string>& truth_units() const override { return truth_units_; }

  bool next(DriveEpoch& epoch) override {
    Utime now = std::min(input_.next(), truth_.next());
    for (const Sensor& s : sensors_) now = std::min(now, s.schedule.next());
    if (now > end_) return false;
    simulation_.advance(seconds(now));
    const auto truth = simulation_.vehicle().truth(simulation_.state(), simulation_.mode());

    epoch.utime = now;
    epoch.readings.clear();
    epoch.truth.clear();
    if (input_.next() == now) {
      input_.pass();
      const auto inputs = simulation_.vehicle().inputs(simulation_.state(), simulation_.mode());
      for (std::size_t i = 0; i < inputs.size(); ++i) epoch.readings.push_back({static_cast<int>(i), inputs[i]});
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      Sensor& s = sensors_[i];
      if (s.schedule.next() != now) continue;
      s.schedule.pass();
      const double h = truth[s.truth_index];
      epoch.readings.push_back({static_cast<int>(V::kInputs.size() + i), h + std::sqrt(s.noise.variance(h)) * s.random.normal()});
    }
    if (truth_.next() == now) {
      truth_.pass();
      epoch.truth.assign(truth.begin(), truth.end());
    }
    return true;
  }

 private:
  VehicleSimulation<V> simulation_;
  Schedule input_, truth_;
  Utime end_;
  std::vector<Sensor> sensors_;
  std::vector<std::string> quantities_, truth_names_, truth_units_;
};

}  // namespace

std::unique_ptr<DriveSource> make_simulated_drive(const Scenario& scenario) {
  return std::visit(
      [&]<typename V>(V vehicle) -> std::unique_ptr<DriveSource> {
        vehicle.prepare();
        return std::make_unique<SimulatedDrive<V>>(vehicle, scenario);
      },
      scenario.plant.vehicle);
}

}  // namespace slipstream
