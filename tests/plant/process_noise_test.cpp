// A plant that chance pushes: how much, when, and that nothing else changes.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "plant/simulated_drive.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kEast = 0, kNorth = 1, kSpeed = 2;  // places in the truth

Scenario pushed(double duration_s) {
  Scenario s;
  s.run.duration_s = duration_s;
  PointMass car;
  car.initial_heading_rad = 0.0;
  car.steering_rad = {0.0};
  car.accelerator = {0.0};
  s.plant.vehicle = car;
  s.plant.truth_rate_hz = 100.0;
  s.plant.process_noise_rate_hz = 50.0;
  s.plant.process_noise = {{"north_m", 0.5}};
  s.sensors = {{"north_position", "north_m", 100.0, {0.0, 2.0}}};
  return s;
}

struct Played {
  std::vector<std::vector<double>> truth;
  std::vector<double> measured;
};
Played play(const Scenario& scenario) {
  const auto drive = make_simulated_drive(scenario);
  Played run;
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    if (!epoch.truth.empty()) run.truth.push_back(epoch.truth);
    for (const NamedValue& r : epoch.readings)
      if (drive->quantities()[static_cast<std::size_t>(r.channel)] == "north_m") run.measured.push_back(r.value.scalar());
  }
  return run;
}

// It drives east, so that north is what chance makes of it.
TEST(ProcessNoise, PushesAtItsRateAndByItsDeviation) {
  const Played run = play(pushed(200.0));
  std::vector<double> pushes;
  for (std::size_t i = 1; i < run.truth.size(); ++i) {
    const double moved = run.truth[i][kNorth] - run.truth[i - 1][kNorth];
    if (i % 2 == 0) {
      pushes.push_back(moved);
    } else {
      EXPECT_EQ(moved, 0.0) << i;  // the odd hundredths of a second have no push
    }
  }
  ASSERT_EQ(pushes.size(), 10000u);
  double sum = 0.0, square = 0.0, lag = 0.0;
  for (std::size_t i = 0; i < pushes.size(); ++i) {
    sum += pushes[i];
    square += pushes[i] * pushes[i];
    if (i > 0) lag += pushes[i] * pushes[i - 1];
  }
  const double n = static_cast<double>(pushes.size());
  EXPECT_NEAR(sum / n, 0.0, 4.0 * 0.5 / std::sqrt(n));             // four standard errors
  EXPECT_NEAR(square / n, 0.25, 4.0 * 0.25 * std::sqrt(2.0 / n));  // of a normal deviate's square
  EXPECT_NEAR(lag / n, 0.0, 4.0 * 0.25 / std::sqrt(n));            // one after the other independent
}

// Coasting needs no randomness: speed and the way to the east are the undisturbed ones' to the integrator's tolerance.
TEST(ProcessNoise, LeavesOtherStatesAlone) {
  Scenario quiet = pushed(5.0);
  quiet.plant.process_noise.clear();
  quiet.plant.process_noise_rate_hz = 0.0;
  const Played with = play(pushed(5.0)), without = play(quiet);
  ASSERT_EQ(with.truth.size(), without.truth.size());
  for (std::size_t i = 0; i < with.truth.size(); ++i) {
    EXPECT_NEAR(with.truth[i][kSpeed], without.truth[i][kSpeed], 1e-5);
    EXPECT_NEAR(with.truth[i][kEast], without.truth[i][kEast],
                5e-4);  // 250 fresh starts, each within 1e-8 of 100 m or twice it
  }
}

TEST(ProcessNoise, LeavesTheSensorsDrawsAlone) {
  Scenario quiet = pushed(1.0);
  quiet.plant.process_noise.clear();
  quiet.plant.process_noise_rate_hz = 0.0;
  const Played with = play(pushed(1.0)), without = play(quiet);
  ASSERT_EQ(with.measured.size(), without.measured.size());
  for (std::size_t i = 0; i < with.measured.size(); ++i)
    EXPECT_NEAR(with.measured[i] - with.truth[i][kNorth], without.measured[i] - without.truth[i][kNorth], 1e-12);
}

TEST(ProcessNoise, IsTheSeeds) {
  Scenario other = pushed(1.0);
  other.run.seed = 2;
  EXPECT_EQ(play(pushed(1.0)).truth, play(pushed(1.0)).truth);
  EXPECT_NE(play(pushed(1.0)).truth, play(other).truth);
}

TEST(ProcessNoise, DrawsTheStart) {
  double square = 0.0;
  const int runs = 2000;
  for (int seed = 1; seed <= runs; ++seed) {
    Scenario s = pushed(0.01);
    s.run.seed = static_cast<std::uint64_t>(seed);
    s.plant.start_deviation = {{"speed_mps", 3.0}};
    const std::vector<double> first = play(s).truth.front();
    square += (first[kSpeed] - 20.0) * (first[kSpeed] - 20.0);
    EXPECT_EQ(first[kNorth], 0.0);
  }
  EXPECT_NEAR(square / runs, 9.0, 4.0 * 9.0 * std::sqrt(2.0 / runs));  // four standard errors of a normal deviate's square
}

}  // namespace
}  // namespace slipstream
