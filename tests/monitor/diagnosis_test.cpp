#include "monitor/diagnosis.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "monitor/live_table.hpp"
#include "monitor/statistics.hpp"
#include "tests/monitor/drive.hpp"

namespace slipstream {
namespace {

std::vector<Finding> findings(const TestDrive& drive) { return score_run(*drive.session.run()).estimators.at(0).findings; }

std::string all(const std::vector<Finding>& found) {
  std::string text;
  for (const Finding& f : found) text += f.text + "\n";
  return text;
}

// The bounds of sensor_watch.hpp promise less than one false alarm in 1e3 runs of 1e5 measurements; here are 3e6 of them.
TEST(SensorWatch, ConsistentSensorsRaiseNoAlarm) {
  RandomStream random(1, 0, "chi");
  int alarms = 0;
  for (const int dimension : {1, 2, 3})
    for (const double rate_hz : {1.0, 10.0, 200.0})
      for (int run = 0; run < 300; ++run) {
        SensorWatch watch;
        for (int k = 0; k < 1000; ++k) {
          double q = 0.0;
          for (int i = 0; i < dimension; ++i) {
            const double x = random.normal();
            q += x * x;
          }
          watch.add(static_cast<Utime>(k * 1e6 / rate_hz), q, dimension);
        }
        alarms += watch.episodes();
      }
  EXPECT_EQ(alarms, 0);  // expected by design: at most 2.7e6 tests of 1e-8 each
}

TEST(SensorWatch, ThreeGrossOutliersOfTwentyAlarmAndOneDoesNot) {
  for (const int outliers : {1, 2, 3}) {
    SensorWatch watch;
    for (int k = 0; k < 40; ++k) watch.add(k * 1'000'000, k % 6 == 3 && k > 20 && (k - 21) / 6 < outliers ? 1e6 : 3.0, 3);
    EXPECT_EQ(watch.episodes(), outliers == 3 ? 1 : 0) << outliers;
    if (outliers == 3) {
      EXPECT_EQ(watch.episode()->since, 21'000'000);  // the first of them
    }
  }
}

TEST(SensorWatch, TooSmallANisNeverAlarms) {
  SensorWatch watch;
  for (int k = 0; k < 100'000; ++k) watch.add(k * 1000, 1e-6, 1);
  EXPECT_EQ(watch.episodes(), 0);
}

// A variance four times too small: q is 4 chi-square. The onset must be that of the change, within a few measurements.
TEST(SensorWatch, OnsetIsTheChangeAndNotTheAlarm) {
  RandomStream random(2, 0, "chi");
  std::vector<double> error_s;
  for (int run = 0; run < 200; ++run) {
    SensorWatch watch;
    Utime alarm = 0;
    for (int k = 0; k < 400; ++k) {
      double q = 0.0;
      for (int i = 0; i < 3; ++i) q += std::pow((k < 200 ? 1.0 : 2.0) * random.normal(), 2);
      watch.add(k * 100'000, q, 3);
      if (watch.episodes() > 0 && alarm == 0) alarm = k * 100'000;
    }
    ASSERT_EQ(watch.episodes(), 1);
    EXPECT_GT(alarm, 20'000'000);
    error_s.push_back(std::abs(seconds(watch.episode()->since) - 20.0));
  }
  EXPECT_LT(percentile(error_s, 0.5), 0.5);   // five measurements
  EXPECT_LT(percentile(error_s, 0.95), 2.0);  // the alarm needs twenty: the onset is never farther off than the alarm
}

TEST(SensorWatch, EndsWhenTheSensorIsConsistentAgain) {
  SensorWatch watch;
  for (int k = 0; k < 100; ++k) watch.add(k * 100'000, k >= 30 && k < 50 ? 50.0 : 3.0, 3);
  ASSERT_TRUE(watch.episode() && watch.episode()->until);
  EXPECT_EQ(watch.episode()->since, 3'000'000);
  EXPECT_EQ(*watch.episode()->until, 4'900'000);  // the last bad one
}

TEST(FitPairs, FindsTheRotationTheShiftAndTheLeverArm) {
  const Vector3 truth(0.02, -0.03, 0.05);
  for (const Cause cause : {Cause::kRotation, Cause::kShift, Cause::kLeverArm}) {
    RandomStream random(3, 0, "pairs");
    std::vector<PositionPair> pairs;
    for (double t = 3.0; t < 25.0; t += 0.2) {
      // An eight, because on a circle a lever arm ahead and a rotation are the same.
      const double s = 0.5 * (t - 3.0);
      PositionPair pair{{}, {40.0 * std::sin(s), 40.0 * std::sin(s) * std::cos(s), 2.0 * std::sin(2.0 * s)}, {}};
      pair.R_WB = from_rpy({0.0, 0.0, std::atan2(std::cos(2.0 * s), std::cos(s))}).toRotationMatrix();
      pair.d = cause == Cause::kRotation ? Vector3(truth.cross(pair.p) + Vector3(0.3, 0.0, 0.1))
               : cause == Cause::kShift  ? Vector3(20.0 * truth)
                                         : Vector3(pair.R_WB * truth * 20.0);
      for (int i = 0; i < 3; ++i) pair.d[i] += 0.1 * random.normal();
      pairs.push_back(pair);
    }
    const PairFit fit = fit_pairs(pairs);
    EXPECT_EQ(fit.cause, cause) << cause_name(fit.cause);
    const double scale = cause == Cause::kRotation ? 1.0 : 20.0;
    // Noise of 0.1 m over 110 pairs: 0.01 m on a shift, and over 28 m rms 0.4 mrad on an angle; four of those.
    EXPECT_LT((fit.value - scale * truth).norm(), cause == Cause::kRotation ? 0.0016 : 0.04);
  }
}

TEST(FitPairs, NoiseHasNoCause) {
  RandomStream random(4, 0, "pairs");
  for (int run = 0; run < 300; ++run) {
    std::vector<PositionPair> pairs;
    for (int k = 0; k < 8 + run; ++k) {
      PositionPair pair{{}, {random.normal() * 50.0, random.normal() * 50.0, 0.0}, Matrix3::Identity()};
      for (int i = 0; i < 3; ++i) pair.d[i] = random.normal();
      pairs.push_back(pair);
    }
    EXPECT_EQ(fit_pairs(pairs).cause, Cause::kUnknown);
  }
}

// Nobody is told anything about a consistent run: 60 of them, each of 1350 measurements of three sensors.
TEST(Diagnosis, AConsistentRunSaysNothing) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    DriveSetup setup;
    setup.seed = seed;
    TestDrive drive(setup);
    drive.play();
    EXPECT_EQ(all(findings(drive)), "") << seed;
    EXPECT_TRUE(drive.warnings().empty()) << seed;
  }
}

TEST(Diagnosis, ALidarMapThatIsTurned) {
  for (const double sigma_m : {0.1, 0.5}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Vector3 phi(0.0, 0.0, -0.05);
      TestFixes lidar{10.0, sigma_m, [&](double, const Vector3& p, const Matrix3&) { return phi.cross(p); }};
      DriveSetup setup;
      setup.lidar = lidar;
      setup.seed = seed;
      TestDrive drive(setup);
      drive.play();
      const std::vector<Finding> found = findings(drive);
      ASSERT_EQ(found.size(), 1u) << all(found);
      EXPECT_EQ(found[0].sensor, "lidar");
      EXPECT_EQ(found[0].other, "gnss");
      EXPECT_EQ(found[0].cause, Cause::kRotation) << found[0].text;
      EXPECT_NE(found[0].text.find("is its mounting angle right?"), std::string::npos) << found[0].text;
      EXPECT_NE(found[0].text.find(" degrees about up: NIS "), std::string::npos) << found[0].text;
      EXPECT_NEAR(found[0].value.at(2), -0.05, 0.004);  // the gain is that of the estimate before, 20 ms ago: 8 %
      EXPECT_GT(found[0].since_s, 3.0) << "the car stands until then";
      EXPECT_LT(found[0].since_s, 8.0);
      EXPECT_FALSE(found[0].until_s);
      const std::vector<std::string> lines = drive.warnings();
      ASSERT_FALSE(lines.empty());
      EXPECT_NE(lines.back().find("es_ekf: LIDAR fixes disagree with GNSS, as if turned by"), std::string::npos)
          << lines.back();
      EXPECT_LE(lines.size(), 4u);
    }
  }
}

// As the CARLA drive of the course: GNSS once a second, 0.1 m; LIDAR 0.5 m ten times a second.
TEST(Diagnosis, ATurnedLidarMapWithRareGnss) {
  const Vector3 phi(0.0, 0.0, -0.05);
  TestFixes lidar{10.0, 0.5, [&](double, const Vector3& p, const Matrix3&) { return phi.cross(p); }};
  DriveSetup setup;
  setup.duration_s = 55.0;
  setup.walk = 0.3;
  setup.gnss.rate_hz = 1.0;
  setup.lidar = lidar;
  TestDrive drive(setup);
  drive.play();
  const std::vector<Finding> found = findings(drive);
  ASSERT_EQ(found.size(), 1u) << all(found);
  EXPECT_EQ(found[0].cause, Cause::kRotation) << found[0].text;
  EXPECT_NE(found[0].text.find("LIDAR fixes disagree with GNSS"), std::string::npos) << found[0].text;
  EXPECT_NE(found[0].text.find("degrees about up"), std::string::npos) << found[0].text;
  RecordProperty("text", found[0].text);
}

TEST(Diagnosis, AMapThatIsShiftedAndALeverArmThatIsNotThere) {
  TestFixes shifted{10.0, 0.2, [](double, const Vector3&, const Matrix3&) { return Vector3(1.0, -0.5, 0.2); }};
  DriveSetup setup;
  setup.lidar = shifted;
  TestDrive shift(setup);
  shift.play();
  ASSERT_EQ(findings(shift).size(), 1u) << all(findings(shift));
  EXPECT_EQ(all(findings(shift)).find("LIDAR fixes disagree with GNSS, as if shifted by ("), 0u) << all(findings(shift));
  const std::vector<double> value = findings(shift)[0].value;
  EXPECT_LT((Vector3(value[0], value[1], value[2]) - Vector3(1.0, -0.5, 0.2)).norm(), 0.1);  // gains as above: 8 % of 1.1 m
  TestFixes levered{10.0, 0.2, [](double, const Vector3&, const Matrix3& R) { return Vector3(R * Vector3(0.2, 0.6, 1.0)); }};
  setup = {};
  setup.lidar = levered;
  TestDrive lever(setup);
  lever.play();
  EXPECT_EQ(all(findings(lever)).find("LIDAR fixes disagree with GNSS, as if"), 0u) << all(findings(lever));
}

TEST(Diagnosis, GnssThatJumpsNowAndThen) {
  int k = 0;
  TestFixes gnss{10.0, 0.1, [&](double t, const Vector3&, const Matrix3&) {
                   return t >= 20.0 && t < 25.0 && ++k % 4 == 1 ? Vector3(5.0, 5.0, 0.0) : Vector3(0.0, 0.0, 0.0);
                 }};
  DriveSetup setup;
  setup.gate = 16.27;
  setup.gnss = gnss;
  TestDrive drive(setup);  // chi-square of three at 0.999
  drive.play();
  const std::vector<Finding> found = findings(drive);
  ASSERT_EQ(found.size(), 1u) << all(found);
  EXPECT_EQ(found[0].sensor, "gnss");
  EXPECT_EQ(found[0].cause, Cause::kJump) << found[0].text;
  EXPECT_EQ(found[0].gated, 13);              // 50 fixes, every fourth
  EXPECT_NEAR(found[0].since_s, 20.0, 0.25);  // the first fix from 20 s on; chance may have one or two before it
  EXPECT_NE(found[0].text.find("GNSS fixes jump: 13 of "), std::string::npos) << found[0].text;
  EXPECT_NE(found[0].text.find("were left out (gated) from "), std::string::npos) << found[0].text;
  EXPECT_NEAR(found[0].until_s.value(), 24.8, 1e-9);  // the last of them
}

TEST(Diagnosis, GnssThatStaysAside) {
  TestFixes gnss{10.0, 0.1, [&](double t, const Vector3&, const Matrix3&) {
                   return t >= 20.0 && t < 25.0 ? Vector3(5.0, 5.0, 0.0) : Vector3(0.0, 0.0, 0.0);
                 }};
  for (const double gate : {16.27, static_cast<double>(INFINITY)}) {
    DriveSetup setup;
    setup.gate = gate;
    setup.gnss = gnss;
    TestDrive drive(setup);
    drive.play();
    const std::vector<Finding> found = findings(drive);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].text.find("GNSS fixes jump: "), 0u) << all(found);
    EXPECT_NEAR(found[0].since_s, 20.0, 0.25);  // the first fix from 20 s on; chance may have one or two before it
  }
}

TEST(Diagnosis, AWheelOfTheWrongRadius) {
  DriveSetup setup;
  setup.speed_scale = 1.05;
  TestDrive drive(setup);
  drive.play();
  const std::vector<Finding> found = findings(drive);
  ASSERT_EQ(found.size(), 1u) << all(found);
  EXPECT_EQ(found[0].cause, Cause::kScale);
  EXPECT_EQ(found[0].text.find("forward speed reads 5.0 % too high: NIS 2"), 0u) << found[0].text;  // 1 + (0.5/0.1)^2 = 26
}

TEST(Diagnosis, ASensorThatFallsSilentAndComesBack) {
  TestFixes gnss{10.0, 0.1, {}, 20.0, 27.0};
  DriveSetup setup;
  setup.gnss = gnss;
  TestDrive drive(setup);
  drive.play();
  const std::vector<Finding> found = findings(drive);
  ASSERT_EQ(found.size(), 1u) << all(found);
  EXPECT_EQ(found[0].text, "GNSS silent from 19.9 s to 27.0 s");  // the last fix before the gap, the first after it
  EXPECT_EQ(drive.warnings(), (std::vector<std::string>{"es_ekf: GNSS silent since 19.9 s", "es_ekf: GNSS back at 27.0 s"}));
}

TEST(Diagnosis, StandsInEveryResult) {
  const Vector3 phi(0.0, 0.0, -0.05);
  TestFixes lidar{10.0, 0.2, [&](double, const Vector3& p, const Matrix3&) { return phi.cross(p); }};
  DriveSetup setup;
  setup.lidar = lidar;
  TestDrive drive(setup);
  drive.play();
  const TestResults r(drive.session);
  const nlohmann::json e = nlohmann::json::parse(scores_json(r.results))["estimators"]["es_ekf"];
  EXPECT_EQ(e["warnings"][0]["sensor"], "lidar");
  EXPECT_EQ(e["warnings"][0]["disagrees_with"], "gnss");
  EXPECT_EQ(e["warnings"][0]["cause"], "rotation");
  EXPECT_EQ(e["sensors"]["gnss"]["samples"], 300);
  EXPECT_EQ(e["sensors"]["gnss"]["gated"], 0);
  EXPECT_EQ(e["sensors"]["gnss"]["nis"]["dimension"], 3);
  const std::string sentence = "es_ekf: LIDAR fixes disagree with GNSS";
  EXPECT_NE(report_html(r.results, false).find("<p class=\"warning\">" + sentence), std::string::npos);
  EXPECT_NE(scoreboard_text(r.results).find(sentence), std::string::npos);
  LiveTable live;
  EXPECT_NE(live.lines(*drive.session.run(), 100).find("! " + sentence), std::string::npos);
}

}  // namespace
}  // namespace slipstream
