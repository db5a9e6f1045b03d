#include "plant/recorded_drive.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/refusal.hpp"
#include "plant/path_speed.hpp"

namespace slipstream {
namespace {

RecordedStreams small_drive() {
  RecordedStreams s;
  s.inputs = {{"drive_torque_nm", "N m", {0.0, 0.1, 0.3}, {10, 11, 12}}};
  s.sensors = {{"wheel_speed_radps", "rad/s", {0.1, 0.2}, {1, 2}}, {"a_x_mps2", "m/s^2", {0.1, 0.25}, {-1, -2}}};
  s.truth = {{"friction", "1", {0.1, 0.4}, {0.5, 0.6}}, {"slip", "1", {0.1000004}, {0.05}}};
  return s;
}

struct Played {
  Utime utime;
  std::vector<std::pair<int, double>> readings;
  std::vector<double> truth;
};

std::vector<Played> play(RecordedDrive& drive) {
  std::vector<Played> all;
  DriveEpoch epoch;
  while (drive.next(epoch)) {
    all.push_back({epoch.utime, {}, epoch.truth});
    for (const NamedValue& r : epoch.readings) all.back().readings.emplace_back(r.channel, r.value.scalar());
  }
  return all;
}

TEST(RecordedDrive, MergesStreamsByInstantInputsFirst) {
  RecordedDrive drive(small_drive(), 0.0);
  EXPECT_EQ(drive.quantities(), (std::vector<std::string>{"drive_torque_nm", "wheel_speed_radps", "a_x_mps2"}));
  EXPECT_EQ(drive.truth_names(), (std::vector<std::string>{"friction", "slip"}));
  EXPECT_EQ(drive.truth_units(), (std::vector<std::string>{"1", "1"}));
  const auto played = play(drive);
  ASSERT_EQ(played.size(), 6u);
  const std::vector<Utime> expected{0, 100000, 200000, 250000, 300000, 400000};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(played[i].utime, expected[i]);
  using Readings = std::vector<std::pair<int, double>>;
  EXPECT_EQ(played[0].readings, (Readings{{0, 10}}));
  EXPECT_TRUE(played[0].truth.empty());
  EXPECT_EQ(played[1].readings, (Readings{{0, 11}, {1, 1}, {2, -1}}));
  EXPECT_EQ(played[1].truth, (std::vector<double>{0.5, 0.05}));  // 0.1000004 s rounds to the same microsecond
  EXPECT_TRUE(played[5].readings.empty());
  ASSERT_EQ(played[5].truth.size(), 2u);
  EXPECT_EQ(played[5].truth[0], 0.6);
  EXPECT_TRUE(std::isnan(played[5].truth[1]));
  EXPECT_DOUBLE_EQ(drive.duration_s(), 0.4);
}

TEST(RecordedDrive, StopsAtTheDurationInclusive) {
  RecordedDrive drive(small_drive(), 0.25);
  EXPECT_EQ(play(drive).back().utime, 250000);
  DriveEpoch epoch;
  EXPECT_FALSE(drive.next(epoch));
}

TEST(RecordedDrive, ReadingsOfSeveralNumbersCarryTheTimeOfTheirMeasurement) {
  RecordedStreams s = small_drive();
  const auto fix = [](double x) { return Values(std::array{x, 8.0, 100.0}); };
  s.groups = {{"gnss", {0.05, 0.1, 0.2, 0.3}, {fix(1), fix(2), fix(3), fix(4)}, 0.0600004},
              {"imu", {0.1}, {Values(std::array{1.0, 2.0, 3.0, 4.0, 5.0, 6.0})}, 0.0}};
  RecordedDrive drive(s, 0.0);
  EXPECT_EQ(drive.quantities(), (std::vector<std::string>{"drive_torque_nm", "wheel_speed_radps", "a_x_mps2", "gnss", "imu"}));
  std::vector<std::pair<Utime, Utime>> sent_and_taken;
  std::vector<double> values;
  DriveEpoch epoch;
  while (drive.next(epoch))
    for (const NamedValue& r : epoch.readings) {
      if (r.channel == 3) {
        sent_and_taken.emplace_back(epoch.utime, r.utime);
        EXPECT_EQ(r.value.size(), 3u);
        values.push_back(r.value[0]);
      } else {
        EXPECT_EQ(r.utime, epoch.utime);
      }
      if (r.channel == 4) {
        EXPECT_EQ(std::vector<double>(r.value.begin(), r.value.end()), (std::vector<double>{1, 2, 3, 4, 5, 6}));
        EXPECT_EQ(epoch.utime, 100000);
      }
    }
  // The fix of 0.05 s was measured before the start.
  EXPECT_EQ(sent_and_taken, (std::vector<std::pair<Utime, Utime>>{{100000, 40000}, {200000, 140000}, {300000, 240000}}));
  EXPECT_EQ(values, (std::vector<double>{2, 3, 4}));
}

TEST(RecordedDrive, RefusesTimesThatCannotBe) {
  const auto refused = [](std::vector<double> time_s) {
    RecordedStreams s;
    s.sensors = {{"a_x_mps2", "m/s^2", std::move(time_s), {1, 2}}};
    try {
      RecordedDrive drive(s, 0.0);
    } catch (const Refusal& refusal) {
      return std::string(refusal.what());
    }
    return std::string("(not refused)");
  };
  EXPECT_EQ(refused({-0.5, 1.0}), "recorded a_x_mps2: time of sample 1: found -0.5 s, expected from 0 to 1000000 s");
  EXPECT_EQ(refused({0.0, 1e30}), "recorded a_x_mps2: time of sample 2: found 1e+30 s, expected from 0 to 1000000 s");
  EXPECT_EQ(refused({0.0, std::nan("")}), "recorded a_x_mps2: time of sample 2: found nan s, expected from 0 to 1000000 s");
  EXPECT_EQ(refused({1.0, 1.0}),
            "recorded a_x_mps2: time of sample 2: found 1 s after 1 s, expected at least a microsecond more");
  EXPECT_THROW(RecordedDrive(RecordedStreams{}, 0.0), Refusal);
}

// A circle of radius R at speed v, sampled every 50 ms with the jitter of a logger.
RecordedPath circle(double radius_m, double speed_mps, double heading_offset_rad) {
  RecordedPath path;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.05 * i + 0.01 * std::sin(1.7 * i);
    if (t < 0.0) continue;
    const double angle = speed_mps * t / radius_m;
    path.time_s.push_back(t);
    path.x_m.push_back(1000.0 + radius_m * std::sin(angle));
    path.y_m.push_back(-500.0 - radius_m * std::cos(angle));
    path.yaw_rad.push_back(angle + heading_offset_rad);
  }
  return path;
}

TEST(PathSpeed, OfACircleAtConstantSpeed) {
  const RecordedPath path = circle(5.0, 2.0, 0.0);  // turning at w = 0.4 rad/s
  const std::vector<double> v = path_speed_mps(path);
  int known = 0;
  for (const double speed : v) {
    if (std::isnan(speed)) continue;
    ++known;
    // w^2 h^2 / 10 of 2 m/s is 1.3 mm/s for an even window; the jitter of 10 ms may double it.
    EXPECT_NEAR(speed, 2.0, 3e-3);
  }
  EXPECT_EQ(known, static_cast<int>(v.size()) - 4);  // two at either end have no window
}

TEST(PathSpeed, IsSignedByTheHeadingAndElseTheMagnitude) {
  RecordedPath path = circle(5.0, 2.0, kPi);  // the car looks backwards
  EXPECT_NEAR(path_speed_mps(path)[100], -2.0, 3e-3);
  path.yaw_rad.clear();
  EXPECT_NEAR(path_speed_mps(path)[100], 2.0, 3e-3);
}

TEST(PathSpeed, FollowsConstantAccelerationExactlyOnUnevenSamples) {
  RecordedPath path;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.05 * i + 0.02 * std::sin(2.3 * i) + 0.02;
    path.time_s.push_back(t);
    path.x_m.push_back(1.0 * t + 0.5 * 3.0 * t * t);
    path.y_m.push_back(0.0);
    path.yaw_rad.push_back(0.0);
  }
  const std::vector<double> v = path_speed_mps(path);
  for (std::size_t i = 3; i < 97; ++i) EXPECT_NEAR(v[i], 1.0 + 3.0 * path.time_s[i], 1e-10);  // rounding of the fit
}

TEST(PathSpeed, IsUnknownAtJumpsAndGaps) {
  RecordedPath path = circle(5.0, 2.0, 0.0);
  for (std::size_t i = 100; i < path.x_m.size(); ++i) path.x_m[i] += 1.0;  // a relocalisation by 1 m
  std::vector<double> v = path_speed_mps(path);
  EXPECT_TRUE(std::isnan(v[99]));
  EXPECT_TRUE(std::isnan(v[100]));
  for (std::size_t i = 10; i < 190; ++i)
    EXPECT_TRUE(std::isnan(v[i]) || std::abs(v[i] - 2.0) < 0.15 * 2.0) << i;  // what is left is no wild speed

  path = circle(5.0, 2.0, 0.0);
  for (std::size_t i = 100; i < path.time_s.size(); ++i) path.time_s[i] += 2.0;
  v = path_speed_mps(path);
  EXPECT_TRUE(std::isnan(v[99]));
  EXPECT_TRUE(std::isnan(v[101]));
  EXPECT_NEAR(v[90], 2.0, 3e-3);
}

TEST(RecordedDrive, ShowsThePathSpeedAsTruth) {
  RecordedStreams s;
  s.path = circle(5.0, 2.0, 0.0);
  RecordedDrive drive(s, 0.0);
  EXPECT_EQ(drive.truth_names(), (std::vector<std::string>{"speed_mps"}));
  EXPECT_EQ(drive.truth_units(), (std::vector<std::string>{"m/s"}));
  const auto played = play(drive);
  EXPECT_NEAR(played[50].truth.at(0), 2.0, 3e-3);
  EXPECT_TRUE(std::isnan(played.front().truth.at(0)));
}

}  // namespace
}  // namespace slipstream
