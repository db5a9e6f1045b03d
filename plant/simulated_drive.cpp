#include "plant/simulated_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

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
  struct Sample {
    Utime published;
    double value;
  };
  Schedule schedule;  // of taking a sample
  std::size_t truth_index;
  NoiseLaw noise;
  SensorErrors errors;
  Utime delay;
  RandomStream random;
  std::deque<Sample> on_the_way{};  // taken, not yet published

  Utime next_published() const { return on_the_way.empty() ? std::numeric_limits<Utime>::max() : on_the_way.front().published; }
  void take(Utime now, double h) {
    on_the_way.push_back({now + delay, errors.reading(h, std::sqrt(noise.variance(h)) * random.normal())});
  }
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
      sensors_.push_back({Schedule(s.rate_hz), static_cast<std::size_t>(found - truth_names_.begin()), s.noise, s.errors,
                          static_cast<Utime>(std::llround(s.errors.delay_s / kSecondsPerUtime)),
                          RandomStream(scenario.run.seed, 0, "sensor." + s.type)});
      quantities_.push_back(s.quantity);
    }
  }

  const std::vector<std::string>& quantities() const override { return quantities_; }
  const std::vector<std::string>& truth_names() const override { return truth_names_; }
  const std::vector<std::string>& truth_units() const override { return truth_units_; }

  bool next(DriveEpoch& epoch) override {
    do {
      if (!play_instant(epoch)) return false;
    } while (epoch.readings.empty() && epoch.truth.empty());  // samples were taken whose delay is not over yet
    return true;
  }

 private:
  bool play_instant(DriveEpoch& epoch) {
    Utime now = std::min(input_.next(), truth_.next());
    for (const Sensor& s : sensors_) now = std::min({now, s.schedule.next(), s.next_published()});
    if (now > end_) return false;
    simulation_.advance(seconds(now));
    const auto truth = simulation_.vehicle().truth(simulation_.state(), simulation_.mode());

    epoch.utime = now;
    epoch.readings.clear();
    epoch.truth.clear();
    if (input_.next() == now) {
      input_.pass();
      const auto inputs = simulation_.vehicle().inputs(simulation_.state(), simulation_.mode());
      for (std::size_t i = 0; i < inputs.size(); ++i) epoch.readings.push_back({static_cast<int>(i), inputs[i], now});
    }
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      Sensor& s = sensors_[i];
      if (s.schedule.next() == now) {
        s.schedule.pass();
        s.take(now, truth[s.truth_index]);
      }
      if (s.next_published() != now) continue;
      epoch.readings.push_back({static_cast<int>(V::kInputs.size() + i), s.on_the_way.front().value, now});
      s.on_the_way.pop_front();
    }
    if (truth_.next() == now) {
      truth_.pass();
      epoch.truth.assign(truth.begin(), truth.end());
    }
    return true;
  }

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
