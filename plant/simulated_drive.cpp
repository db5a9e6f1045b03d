#include "plant/simulated_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "common/random.hpp"
#include "common/readings.hpp"
#include "common/refusal.hpp"
#include "common/schedule.hpp"
#include "models/strapdown.hpp"
#include "plant/mounted_sensors.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {

namespace {

// Readings that were taken and are not yet published.
class OnTheWay {
 public:
  explicit OnTheWay(double delay_s) : delay_(utime_of(delay_s)) {}
  void send(Utime now, const Values& value) { readings_.push_back({now, value}); }
  Utime next() const { return readings_.empty() ? std::numeric_limits<Utime>::max() : readings_.front().taken + delay_; }
  // The one whose time has come. A reading carries the time at which it was taken, or that at which it is published.
  NamedValue arrive(int channel, bool as_taken) {
    const Reading reading = readings_.front();
    readings_.pop_front();
    return {channel, reading.value, as_taken ? reading.taken : reading.taken + delay_};
  }

 private:
  struct Reading {
    Utime taken;
    Values value;
  };
  Utime delay_;
  std::deque<Reading> readings_{};
};

// A sensor of one number.
struct Sensor {
  Schedule schedule;  // of taking a sample
  std::size_t truth_index;
  NoiseLaw noise;
  SensorErrors errors;
  RandomStream random;
  OnTheWay on_the_way{errors.delay_s};

  double sample(double h) { return errors.reading(h, std::sqrt(noise.variance(h)) * random.normal()); }
};

// A sensor of position fixes.
struct Receiver {
  FixSensor sensor;
  RandomStream random;
  std::function<Values(const RigidMotion&, RandomStream&)> fix;
  Schedule schedule{sensor.rate_hz};
  OnTheWay on_the_way{sensor.delay_s};
};

// What pushes a stochastic plant (models/scenario.hpp, process_noise).
template <Vehicle V>
struct Disturbance {
  using State = Vector<double, V::kStates>;

  Disturbance(const std::map<std::string, double>& by_name, std::uint64_t seed, std::string_view stream)
      : random(seed, 0, stream) {
    if constexpr (requires { V::kStateNames; })
      for (std::size_t i = 0; i < V::kStateNames.size(); ++i)
        if (const auto found = by_name.find(std::string(V::kStateNames[i])); found != by_name.end())
          deviation[static_cast<Eigen::Index>(i)] = found->second;
  }
  State draw() {
    State by = State::Zero();
    for (int i = 0; i < V::kStates; ++i)
      if (deviation[i] > 0.0) by[i] = deviation[i] * random.normal();
    return by;
  }

  State deviation = State::Zero();
  RandomStream random;
};

bool has_mounted_sensors(const Scenario& scenario) { return scenario.imu || scenario.gnss || scenario.lidar; }

template <Vehicle V>
class SimulatedDrive final : public DriveSource {
 public:
  SimulatedDrive(const V& vehicle, const Scenario& scenario)
      : simulation_(vehicle, tolerances(scenario)),
        input_(scenario.plant.input_rate_hz),
        truth_(scenario.plant.truth_rate_hz),
        disturbance_(scenario.plant.process_noise, scenario.run.seed, "plant.process_noise"),
        end_(utime_of(scenario.run.duration_s)) {
    if (!scenario.plant.process_noise.empty()) {
      disturbed_.emplace(scenario.plant.process_noise_rate_hz);
      disturbed_->pass();  // from the first period's end
    }
    if (!scenario.plant.start_deviation.empty())
      simulation_.push(Disturbance<V>(scenario.plant.start_deviation, scenario.run.seed, "plant.start").draw());
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
                          RandomStream(scenario.run.seed, 0, "sensor." + s.type)});
      quantities_.push_back(s.quantity);
    }
    if constexpr (MovingVehicle<V>) {
      mount(scenario);
    } else if (has_mounted_sensors(scenario)) {
      throw Refusal(
          fmt::format("sensor: the vehicle '{}' has no motion in three dimensions for an IMU, GNSS or LIDAR", V::kName));
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
  using Simulation = VehicleSimulation<V>;

  // An IMU's reading needs the motion at both ends of its interval: a second integration of the vehicle runs one period ahead.
  struct Inertial {
    Inertial(const V& vehicle, const Scenario& scenario)
        : ahead(vehicle, tolerances(scenario)),
          schedule(scenario.imu->rate_hz),
          imu(*scenario.imu, scenario.world.gravity_mps2, RandomStream(scenario.run.seed, 0, "sensor.imu")),
          motion(ahead.motion()) {}
    Values read() {
      const Utime from = schedule.next();
      schedule.pass();
      const Utime to = schedule.next();
      ahead.advance(seconds(to));
      const RigidMotion first = std::exchange(motion, ahead.motion());
      return imu.read(from, first, to, motion);
    }
    Simulation ahead;
    Schedule schedule;
    MountedImu imu;
    RigidMotion motion;  // at the schedule's next instant
  };

  void mount(const Scenario& scenario) {
    if (scenario.imu) {
      inertial_.emplace(simulation_.vehicle(), scenario);
      quantities_.emplace_back(kImu);
      for (std::size_t i = Strapdown::kStatesWithoutBiases; i < Strapdown::kStates; ++i) {
        truth_names_.emplace_back(Strapdown::kStateNames[i].name);
        truth_units_.emplace_back(Strapdown::kStateNames[i].unit);
      }
    }
    if (scenario.gnss) {
      quantities_.emplace_back(kGnss);
      receivers_.push_back({*scenario.gnss, RandomStream(scenario.run.seed, 0, "sensor.gnss"),
                            [gnss = *scenario.gnss, world = std::make_shared<LocalFrame>(scenario.world.origin)](
                                const RigidMotion& m, RandomStream& r) { return gnss_reading(gnss, *world, m, r); }});
    }
    if (scenario.lidar) {
      quantities_.emplace_back(kLidar);
      receivers_.push_back(
          {*scenario.lidar, RandomStream(scenario.run.seed, 0, "sensor.lidar"),
           [lidar = *scenario.lidar](const RigidMotion& m, RandomStream& r) { return lidar_reading(lidar, m, r); }});
    }
  }

  bool play_instant(DriveEpoch& epoch) {
    Utime now = std::min(input_.next(), truth_.next());
    for (const Sensor& s : sensors_) now = std::min({now, s.schedule.next(), s.on_the_way.next()});
    if (inertial_) now = std::min(now, inertial_->schedule.next());
    for (const Receiver& r : receivers_) now = std::min({now, r.schedule.next(), r.on_the_way.next()});
    if (disturbed_) now = std::min(now, disturbed_->next());
    if (now > end_) return false;
    simulation_.advance(seconds(now));
    if (disturbed_ && disturbed_->next() == now) {
      disturbed_->pass();
      simulation_.push(disturbance_.draw());
    }
    const auto truth = simulation_.vehicle().truth(simulation_.state(), simulation_.mode());

    epoch.utime = now;
    epoch.readings.clear();
    epoch.truth.clear();
    if (input_.next() == now) {
      input_.pass();
      const auto inputs = simulation_.vehicle().inputs(simulation_.state(), simulation_.mode());
      for (std::size_t i = 0; i < inputs.size(); ++i) epoch.readings.push_back({static_cast<int>(i), inputs[i], now});
    }
    int channel = static_cast<int>(V::kInputs.size());
    for (Sensor& s : sensors_) {
      if (s.schedule.next() == now) {
        s.schedule.pass();
        s.on_the_way.send(now, s.sample(truth[s.truth_index]));
      }
      if (s.on_the_way.next() == now) epoch.readings.push_back(s.on_the_way.arrive(channel, false));
      ++channel;
    }
    if constexpr (MovingVehicle<V>) play_mounted(epoch, channel);
    if (truth_.next() == now) {
      truth_.pass();
      epoch.truth.assign(truth.begin(), truth.end());
      if (inertial_)
        for (const Vector3* bias : {&inertial_->imu.bias_mps2(), &inertial_->imu.bias_radps()})
          epoch.truth.insert(epoch.truth.end(), bias->begin(), bias->end());
    }
    return true;
  }

  void play_mounted(DriveEpoch& epoch, int channel) {
    const Utime now = epoch.utime;
    if (inertial_) {
      if (inertial_->schedule.next() == now) epoch.readings.push_back({channel, inertial_->read(), now});
      ++channel;
    }
    for (Receiver& r : receivers_) {
      if (r.schedule.next() == now) {
        r.schedule.pass();
        const Values fix = r.fix(simulation_.motion(), r.random);  // also drawn in an outage: what follows it stays the same
        if (!r.sensor.is_out(seconds(now))) r.on_the_way.send(now, fix);
      }
      if (r.on_the_way.next() == now) epoch.readings.push_back(r.on_the_way.arrive(channel, true));
      ++channel;
    }
  }

  static CvodeTolerances tolerances(const Scenario& scenario) {
    return {scenario.plant.relative_tolerance, scenario.plant.absolute_tolerance};
  }

  Simulation simulation_;
  Schedule input_, truth_;
  Disturbance<V> disturbance_;
  std::optional<Schedule> disturbed_;
  Utime end_;
  std::vector<Sensor> sensors_;
  std::optional<Inertial> inertial_;
  std::vector<Receiver> receivers_;
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
