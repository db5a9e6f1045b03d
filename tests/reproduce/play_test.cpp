// Scenarios played in process with a strapdown filter: what comes out fits the drive, angles go the short way round, readings
// can be lost or spoilt on their way.
#include "studies/play.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/readings.hpp"
#include "io/scenario_reader.hpp"
#include "reproduce/localisation.hpp"

namespace slipstream {
namespace {

Scenario document(const std::vector<std::string>& overrides = {}) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/city_document.toml", overrides).scenario;
}
const std::vector<Follower> kFilter{{"es_ekf", "document", ""}};

TEST(Bench, AStrapdownFilterIsFollowedAtEveryReading) {
  const Played p = play(document(), kFilter);
  const Track& t = p.tracks[0];
  EXPECT_NEAR(static_cast<double>(t.t_s.size()), 2.2 * 500.0, 2.0);  // one estimate a reading; the ends
  EXPECT_EQ(t.states.size(), 9U);
  EXPECT_TRUE(t.outputs.empty());
  // 25 Hz from 0 to 2.2 s inclusive makes 56; the one at 0 comes before the filter has begun.
  EXPECT_NEAR(static_cast<double>(t.sensors.at("gnss").nis.size()), 55.0, 1.0);
  EXPECT_EQ(t.sensors.at("gnss").dimension[0], 3);
  EXPECT_EQ(t.sensors.at("gnss").gated, 0);
  EXPECT_EQ(p.measured.at("height_m").value.size(), 56U);
  EXPECT_TRUE(t.findings.empty());
}

// The yaw of this drive crosses 180 degrees: unwrapped it stays within 0.3 rad of its start at 3.1, and no error is near 2 pi.
TEST(Bench, AnglesGoTheShortWayRound) {
  const Played p = play(document(), kFilter);
  bool crosses = false;
  for (const double yaw : p.truth_of("yaw_rad")) {
    EXPECT_NEAR(yaw, 3.1, 0.3);
    crosses |= yaw > kPi;
  }
  EXPECT_TRUE(crosses);
  EXPECT_LT(largest(p.error(0, "yaw_rad")), 0.01);  // 0.01 rad/s a sample over 2.2 s: 0.0007 rad, fifteen of them
}

TEST(Bench, AReadingCanBeLost) {
  const Played p = play(document(), kFilter, nullptr, {}, [](Reading& r) { return r.quantity != kGnss; });
  EXPECT_FALSE(p.tracks[0].sensors.contains("gnss"));
  EXPECT_TRUE(p.measured.at("height_m").value.empty());
}

// A sample of 1000 m/s^2 for 2 ms is 2 m/s, which no fix of 1 m corrects within a tenth of a second.
TEST(Bench, AReadingCanBeSpoilt) {
  const Played p = play(document(), kFilter, nullptr, {}, [](Reading& r) {
    if (r.quantity != kImu || r.header.utime != 2'000'000) return true;
    std::array<double, 6> value{};
    std::copy(r.value.begin(), r.value.end(), value.begin());
    value[2] += 1000.0;
    r.value = Values(std::span<const double>(value));
    return true;
  });
  EXPECT_NEAR(p.error(0, "up_m").back(), 0.2 * 2.0, 0.05);  // fixes and noise take centimetres
}

// Drawn from N(0, P0): the normalised square of the whole start is chi-square with 15 degrees of freedom. Over 200 seeds its
// mean has a standard deviation of sqrt(30/200) = 0.39.
TEST(Localisation, StartsAreDrawnFromWhatTheFilterBelieves) {
  double sum = 0.0;
  constexpr int kSeeds = 200;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Scenario s = document({"run.duration_s=0.1", "run.seed=" + std::to_string(seed)});
    const StrapdownTuning before = s.estimator.tunings.at("matched").strapdown;
    draw_navigation_start(s, "matched");
    const StrapdownTuning& t = s.estimator.tunings.at("matched").strapdown;
    for (int i = 0; i < 3; ++i) {
      const auto add = [&sum](double difference, double deviation) { sum += std::pow(difference / deviation, 2); };
      add(t.initial_position_m[i] - before.initial_position_m[i], t.position_deviation_m[i]);
      add(t.initial_velocity_mps[i] - before.initial_velocity_mps[i], t.velocity_deviation_mps[i]);
      add(t.initial_rpy_rad[i] - before.initial_rpy_rad[i], t.rpy_deviation_rad[i]);
      add(s.imu->bias_mps2[i], t.accelerometer_bias_deviation_mps2);
      add(s.imu->bias_radps[i], t.gyro_bias_deviation_radps);
    }
  }
  EXPECT_NEAR(sum / kSeeds, 15.0, 4.0 * 0.39);  // four standard deviations
}

// Against closed forms: a constant NEES of the dimension is inside at every instant, ten times it at none.
TEST(Localisation, NeesOverRuns) {
  NeesOverRuns good, bad;
  for (int run = 0; run < 5; ++run) {
    Track t;
    t.t_s = {0.0, 1.0};
    t.nees_dimension = {9, 9};
    t.nees = {9.0, 9.0};
    good.add(t);
    t.nees = {90.0, 90.0};
    bad.add(t);
  }
  EXPECT_EQ(good.percent_inside(), 100.0);
  EXPECT_EQ(bad.percent_inside(), 0.0);
  EXPECT_EQ(good.at_the_end("x", "y").verdict, "inside the 95 % band");
  EXPECT_EQ(bad.at_the_end("x", "y", "it rains").verdict,
            "above the 95 % band: the model does not match the plant, because it rains");
}

}  // namespace
}  // namespace slipstream
