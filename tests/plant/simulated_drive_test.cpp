#include "plant/simulated_drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/random.hpp"
#include "common/refusal.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kWheel = 0, kAx = 3;  // places in the Unimog's truth

Scenario unimog(double duration_s = 1.0) {
  Scenario s;
  s.name = "test";
  s.run.duration_s = duration_s;
  s.sensors = {{"wheel_speed", "wheel_speed_radps", 100.0, {0.05, 0.0}}, {"accelerometer", "a_x_mps2", 100.0, {0.05, 0.0}}};
  return s;
}

struct Sample {
  Utime utime;
  double value;
  friend bool operator==(const Sample&, const Sample&) = default;
};

struct Played {
  std::vector<DriveEpoch> epochs;
  std::map<int, std::vector<Sample>> channel;  // of readings
  std::map<Utime, std::vector<double>> truth;
};

Played play(const Scenario& scenario) {
  const auto drive = make_simulated_drive(scenario);
  Played p;
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    p.epochs.push_back(epoch);
    for (const NamedValue& r : epoch.readings) p.channel[r.channel].push_back({epoch.utime, r.value.scalar()});
    if (!epoch.truth.empty()) p.truth[epoch.utime] = epoch.truth;
  }
  EXPECT_FALSE(drive->next(epoch)) << "the end stays the end";
  return p;
}

TEST(SimulatedDrive, NamesAreTheInputTheSensorsAndTheVehiclesTruth) {
  const auto drive = make_simulated_drive(unimog());
  EXPECT_EQ(drive->quantities(), (std::vector<std::string>{"drive_torque_nm", "wheel_speed_radps", "a_x_mps2"}));
  ASSERT_EQ(drive->truth_names().size(), 12u);
  EXPECT_EQ(drive->truth_names()[kWheel], "wheel_speed_radps");
  EXPECT_EQ(drive->truth_names()[kAx], "a_x_mps2");
  EXPECT_EQ(drive->truth_units()[kWheel], "rad/s");
  EXPECT_EQ(drive->truth_units()[kAx], "m/s^2");
}

TEST(SimulatedDrive, Refusals) {
  Scenario s = unimog();
  s.sensors.push_back({"gyroscope", "yaw_rate_radps", 100.0, {}});
  const auto message = [](const Scenario& scenario) -> std::string {
    try {
      make_simulated_drive(scenario);
    } catch (const Refusal& r) {
      return r.what();
    }
    return "(accepted)";
  };
  EXPECT_EQ(message(s), "sensor.gyroscope: the vehicle 'unimog' has no 'yaw_rate_radps' to measure");
  s = unimog();
  std::get<Unimog>(s.plant.vehicle).initial_gear = 9.0;
  EXPECT_EQ(message(s), "vehicle.initial_gear: expected a whole number from 1 to 8");
  EXPECT_EQ(message(unimog()), "(accepted)");
}

// The k-th sample of a channel is at k / rate, to the nearest microsecond (halves up), whatever the rates of the others.
TEST(SimulatedDrive, SampleTimesDoNotDrift) {
  Scenario s = unimog(10.0);
  const std::vector<std::int64_t> rates{30, 7, 128, 60};  // input, wheel speed, accelerometer, truth: few whole periods
  s.plant.input_rate_hz = 30.0;
  s.sensors[0].rate_hz = 7.0;
  s.sensors[1].rate_hz = 128.0;
  s.plant.truth_rate_hz = 60.0;
  const Played p = play(s);
  std::vector<std::vector<Utime>> times(4);
  for (int c = 0; c < 3; ++c)
    for (const Sample& x : p.channel.at(c)) times[static_cast<std::size_t>(c)].push_back(x.utime);
  for (const auto& [utime, values] : p.truth) times[3].push_back(utime);
  for (std::size_t c = 0; c < 4; ++c) {
    ASSERT_EQ(times[c].size(), static_cast<std::size_t>(10 * rates[c] + 1)) << rates[c] << " Hz, both ends included";
    for (std::size_t k = 0; k < times[c].size(); ++k)
      ASSERT_EQ(times[c][k], (2'000'000 * static_cast<std::int64_t>(k) + rates[c]) / (2 * rates[c])) << k << " at " << rates[c];
  }
}

TEST(SimulatedDrive, AFractionalRate) {
  Scenario s = unimog(10.0);
  s.sensors[0].rate_hz = 2.5;
  const Played p = play(s);
  ASSERT_EQ(p.channel.at(1).size(), 26u);
  for (std::size_t k = 0; k < 26; ++k) EXPECT_EQ(p.channel.at(1)[k].utime, 400'000 * static_cast<Utime>(k));
}

TEST(SimulatedDrive, EpochsIncreaseInputsComeFirstAndNothingIsEmpty) {
  Scenario s = unimog(3.0);
  s.plant.input_rate_hz = 50.0;
  s.sensors[0].rate_hz = 30.0;
  s.sensors[1].rate_hz = 7.0;
  s.plant.truth_rate_hz = 20.0;
  const Played p = play(s);
  Utime before = -1;
  for (const DriveEpoch& e : p.epochs) {
    EXPECT_GT(e.utime, before);
    EXPECT_LE(e.utime, 3'000'000);
    EXPECT_FALSE(e.readings.empty() && e.truth.empty());
    for (std::size_t i = 1; i < e.readings.size(); ++i) EXPECT_LT(e.readings[i - 1].channel, e.readings[i].channel);
    before = e.utime;
  }
  // At 0 and at 1 s all four meet: one epoch with everything.
  EXPECT_EQ(p.epochs.front().readings.size(), 3u);
  EXPECT_EQ(p.epochs.front().truth.size(), 12u);
  EXPECT_EQ(p.epochs.front().readings[0].channel, 0);
}

// Without noise every sensor tells the truth, and the input is the torque at the wheel.
TEST(SimulatedDrive, WithoutNoiseSensorsTellTheTruth) {
  Scenario s = unimog(5.0);
  for (SensorConfig& sensor : s.sensors) sensor.noise = {};
  const Played p = play(s);
  for (const Sample& x : p.channel.at(0)) EXPECT_EQ(x.value, p.truth.at(x.utime)[6]);
  for (const Sample& x : p.channel.at(1)) EXPECT_EQ(x.value, p.truth.at(x.utime)[kWheel]);
  for (const Sample& x : p.channel.at(2)) EXPECT_EQ(x.value, p.truth.at(x.utime)[kAx]);
  EXPECT_EQ(p.channel.at(1).size(), 501u);
}

// --- Noise ------------------------------------------------------------------------------------------------------------

// (z - h) / sigma(h) with the scenario's law, worked out here.
std::vector<double> deviates(const Played& p, int channel, std::size_t truth, double relative, double absolute) {
  std::vector<double> xi;
  for (const Sample& x : p.channel.at(channel)) {
    const double h = p.truth.at(x.utime)[truth];
    xi.push_back((x.value - h) / std::sqrt(relative * relative * h * h + absolute * absolute));
  }
  return xi;
}
double mean_of(const std::vector<double>& x, const std::function<double(double)>& f) {
  double sum = 0.0;
  for (const double v : x) sum += f(v);
  return sum / static_cast<double>(x.size());
}

TEST(SimulatedDrive, NoiseFollowsTheSensorsLaw) {
  Scenario s = unimog(10.0);
  s.plant.truth_rate_hz = 2000.0;
  for (SensorConfig& sensor : s.sensors) sensor.rate_hz = 2000.0;
  s.sensors[0].noise = {0.05, 0.4};
  s.sensors[1].noise = {0.1, 0.0};
  const Played p = play(s);
  const auto wheel = deviates(p, 1, kWheel, 0.05, 0.4), a_x = deviates(p, 2, kAx, 0.1, 0.0);
  ASSERT_EQ(wheel.size(), 20001u);
  const double n = 20001.0;
  // Fixed seed; 4 standard errors of the moments of N(0,1), whose variances are 1, 2 and 96.
  for (const auto& xi : {wheel, a_x}) {
    EXPECT_NEAR(mean_of(xi, [](double v) { return v; }), 0.0, 4.0 * std::sqrt(1.0 / n));
    EXPECT_NEAR(mean_of(xi, [](double v) { return v * v; }), 1.0, 4.0 * std::sqrt(2.0 / n));
    EXPECT_NEAR(mean_of(xi, [](double v) { return v * v * v * v; }), 3.0, 4.0 * std::sqrt(96.0 / n));
    double neighbours = 0.0;
    for (std::size_t k = 1; k < xi.size(); ++k) neighbours += xi[k] * xi[k - 1];
    EXPECT_NEAR(neighbours / n, 0.0, 4.0 * std::sqrt(1.0 / n));  // independent from sample to sample
  }
  double product = 0.0;
  for (std::size_t k = 0; k < wheel.size(); ++k) product += wheel[k] * a_x[k];
  EXPECT_NEAR(product / n, 0.0, 4.0 * std::sqrt(1.0 / n));  // and from sensor to sensor
}

// The deviates that a sensor draws, from noise of unit size: z - h.
std::vector<double> draws(Scenario s) {
  s.sensors[0].noise = {0.0, 1.0};
  const Played p = play(s);
  return deviates(p, 1, kWheel, 0.0, 1.0);
}

TEST(SimulatedDrive, ASecondSensorLeavesTheDrawsOfTheFirstAlone) {
  Scenario one = unimog(5.0);
  one.sensors.resize(1);
  const auto alone = draws(one);
  ASSERT_EQ(alone.size(), 501u);
  Scenario other_rate = unimog(5.0);
  other_rate.sensors[1].rate_hz = 333.0;
  Scenario other_noise = unimog(5.0);
  other_noise.sensors[1].noise = {0.5, 3.0};
  for (const Scenario& s : {unimog(5.0), other_rate, other_noise}) {
    const auto beside = draws(s);
    ASSERT_EQ(beside.size(), alone.size());
    // z - h loses digits of the wheel speed (20 rad/s * 1e-16); other sample times move an event by some last bits.
    for (std::size_t k = 0; k < alone.size(); ++k) ASSERT_NEAR(beside[k], alone[k], 1e-10) << k;
  }
}

TEST(SimulatedDrive, TheOrderOfSensorsDoesNotMatterToTheirDraws) {
  Scenario turned = unimog(2.0);
  std::swap(turned.sensors[0], turned.sensors[1]);
  const Played a = play(unimog(2.0)), b = play(turned);
  EXPECT_EQ(a.channel.at(1), b.channel.at(2));
  EXPECT_EQ(a.channel.at(2), b.channel.at(1));
}

TEST(SimulatedDrive, SameSeedSameBitsOtherSeedOtherNoiseSameTruth) {
  const Played a = play(unimog(5.0)), again = play(unimog(5.0));
  EXPECT_EQ(a.channel, again.channel);
  EXPECT_EQ(a.truth, again.truth);
  Scenario other = unimog(5.0);
  other.run.seed = 2;
  const Played b = play(other);
  EXPECT_EQ(a.truth, b.truth);
  EXPECT_EQ(a.channel.at(0), b.channel.at(0)) << "the input has no noise";
  int equal = 0;
  for (std::size_t k = 0; k < a.channel.at(1).size(); ++k) equal += a.channel.at(1)[k].value == b.channel.at(1)[k].value;
  EXPECT_EQ(equal, 0);  // two doubles of 53 random bits
}

// --- Other errors -----------------------------------------------------------------------------------------------------

// Without errors a reading is h + sigma(h) xi of the sensor's own stream, to the bit.
TEST(SimulatedDrive, WithoutErrorsOnlyTheNoiseIsAdded) {
  const Scenario s = unimog(5.0);
  const Played p = play(s);
  const std::size_t truth[]{kWheel, kAx};
  for (int c = 0; c < 2; ++c) {
    RandomStream random(s.run.seed, 0, "sensor." + s.sensors[static_cast<std::size_t>(c)].type);
    for (const Sample& x : p.channel.at(c + 1)) {
      const double h = p.truth.at(x.utime)[truth[c]];
      EXPECT_EQ(x.value, h + std::sqrt(0.05 * 0.05 * (h * h + 0.0) + 0.0) * random.normal());
    }
  }
}

TEST(SimulatedDrive, ScaleAndBiasOfANoiseFreeSensorAreExact) {
  Scenario s = unimog(2.0);
  s.sensors[0].noise = {};
  s.sensors[0].errors.scale = 1.5;
  s.sensors[0].errors.bias = -0.25;
  const Played p = play(s);
  for (const Sample& x : p.channel.at(1)) EXPECT_EQ(x.value, 1.5 * p.truth.at(x.utime)[kWheel] - 0.25);
}

TEST(SimulatedDrive, BiasIsTheMeanOfTheError) {
  Scenario s = unimog(10.0);
  s.plant.truth_rate_hz = s.sensors[0].rate_hz = 1000.0;
  s.sensors[0].noise = {0.0, 0.2};
  s.sensors[0].errors.bias = 0.7;
  const auto xi = deviates(play(s), 1, kWheel, 0.0, 0.2);
  ASSERT_EQ(xi.size(), 10001u);
  EXPECT_NEAR(mean_of(xi, [](double v) { return 0.2 * v; }), 0.7, 4.0 * 0.2 / 100.0);  // 4 standard errors
}

TEST(SimulatedDrive, AQuantisedSensorShowsTheNearestMultiples) {
  Scenario s = unimog(5.0);
  s.sensors[0].noise = {};
  s.sensors[0].errors.quantum = 0.25;
  const Played p = play(s);
  double worst = 0.0;
  for (const Sample& x : p.channel.at(1)) {
    EXPECT_EQ(x.value / 0.25, std::round(x.value / 0.25));  // a quarter is exact in binary
    worst = std::max(worst, std::abs(x.value - p.truth.at(x.utime)[kWheel]));
  }
  EXPECT_LE(worst, 0.125);  // half a quantum
  EXPECT_GT(worst, 0.1);    // which 501 values come close to
}

// A sample taken at k / rate is published a delay later, and nothing else moves.
TEST(SimulatedDrive, ADelayedSensorPublishesWhatItTook) {
  Scenario s = unimog(3.0);
  for (SensorConfig& sensor : s.sensors) sensor.noise = {};
  const Played prompt = play(s);
  for (const double delay_s : {0.02, 0.0035, 0.1}) {  // whole periods, between the samples, ten samples on the way
    s.sensors[0].errors.delay_s = delay_s;
    const Played p = play(s);
    const auto delay = static_cast<Utime>(std::llround(1e6 * delay_s));
    std::vector<Sample> expected;
    for (const Sample& x : prompt.channel.at(1))
      if (x.utime + delay <= 3'000'000) expected.push_back({x.utime + delay, x.value});
    EXPECT_EQ(p.channel.at(1), expected) << delay_s;
    EXPECT_EQ(p.channel.at(2), prompt.channel.at(2));
    EXPECT_EQ(p.truth, prompt.truth);
    for (const DriveEpoch& e : p.epochs) EXPECT_FALSE(e.readings.empty() && e.truth.empty()) << e.utime;
  }
}

// Samples may be taken at instants that have nothing to publish.
TEST(SimulatedDrive, ADelayedSensorAloneMakesNoEmptyEpochs) {
  Scenario s = unimog(1.0);
  s.sensors.resize(1);
  s.sensors[0].noise = {};
  s.sensors[0].rate_hz = 90.0;
  s.sensors[0].errors.delay_s = 0.0023;
  s.plant.input_rate_hz = s.plant.truth_rate_hz = 1.0;
  const Played p = play(s);
  EXPECT_EQ(p.channel.at(1).size(), 90u);  // the 91st is taken at the end and never arrives
  for (const DriveEpoch& e : p.epochs) EXPECT_FALSE(e.readings.empty() && e.truth.empty()) << e.utime;
}

// A disturbed plant is the undisturbed one, pushed at the instants k / rate by normal deviates of the given size.
TEST(SimulatedDrive, ProcessNoisePushesAtItsInstants) {
  Scenario s;
  s.name = "pushed";
  s.run.duration_s = 100.0;
  s.plant.vehicle = PointMass{};
  s.sensors = {{"forward_speed", "forward_speed_mps", 40.0, {}, {}}};
  s.plant.truth_rate_hz = 40.0;
  s.plant.input_rate_hz = 40.0;
  const Played plain = play(s);
  s.plant.process_noise_rate_hz = 20.0;
  s.plant.process_noise = {{"east_m", 0.5}};
  const Played pushed = play(s);
  ASSERT_EQ(pushed.truth.size(), plain.truth.size());
  double before = 0.0, squares = 0.0;
  int pushes = 0;
  for (const auto& [utime, truth] : pushed.truth) {
    // Nothing depends on where the car is: all but its east position stays as it was, to the bit.
    for (std::size_t i = 1; i < truth.size(); ++i) EXPECT_EQ(truth[i], plain.truth.at(utime)[i]) << utime << " " << i;
    const double pushed_by = truth[0] - plain.truth.at(utime)[0];
    const double step = pushed_by - before;
    before = pushed_by;
    if (utime % 50'000 == 0 && utime > 0) {
      ++pushes;
      squares += step * step / 0.25;
    } else {
      EXPECT_NEAR(step, 0.0, 1e-11) << utime;  // rounding of positions within 2 km
    }
  }
  EXPECT_EQ(pushes, 2000);
  EXPECT_NEAR(squares / pushes, 1.0, 4.0 * std::sqrt(2.0 / 2000.0));  // chi-square of 2000 degrees, 4 sigma
}

}  // namespace
}  // namespace slipstream
