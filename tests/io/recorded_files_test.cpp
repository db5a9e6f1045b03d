#include "io/recorded_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geodesy.hpp"
#include "common/rotation.hpp"
#include "io/scenario_reader.hpp"
#include "tests/io/temporary_folder.hpp"

namespace slipstream {
namespace {

class RecordedFiles : public testing::Test {
 protected:
  RecordedFiles() {
    folder.write("motor.csv", "t_s,erpm,amp\n0.5,10,1\n1.5,20,2\n");
    folder.write("pose.csv", "t_s,p_x_m,p_y_m,yaw_rad\n0,1,2,3\n");
    config.sensors = {{"wheel_speed_radps", "motor.csv", "erpm", 0.5, 1.0}};
    config.inputs = {{"drive_torque_nm", "motor.csv", "amp", 1.0, 0.0}};
    config.truth = {{"friction", "pose.csv", "p_x_m", 1.0, 0.0}};
    config.path_speed = RecordedPathSpeed{"pose.csv", "p_x_m", "p_y_m", "yaw_rad", 0.3, 0.07};
  }
  std::string refused() {
    return refusal_of([&] { load_recorded(scenario, folder.path()); });
  }

  TemporaryFolder folder;
  Scenario scenario;
  RecordedConfig& config = scenario.recorded.emplace();
};

TEST_F(RecordedFiles, ScalesColumnsToQuantities) {
  const RecordedStreams s = load_recorded(scenario, folder.path());
  ASSERT_EQ(s.sensors.size(), 1u);
  EXPECT_EQ(s.sensors[0].quantity, "wheel_speed_radps");
  EXPECT_EQ(s.sensors[0].unit, "rad/s");
  EXPECT_EQ(s.sensors[0].time_s, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(s.sensors[0].value, (std::vector<double>{6.0, 11.0}));
  EXPECT_EQ(s.inputs.at(0).value, (std::vector<double>{1.0, 2.0}));
  EXPECT_EQ(s.truth.at(0).unit, "1");
  ASSERT_TRUE(s.path);
  EXPECT_EQ(s.path->y_m, std::vector<double>{2.0});
  EXPECT_EQ(s.path->yaw_rad, std::vector<double>{3.0});
  EXPECT_EQ(s.path->window_s, 0.3);
  EXPECT_EQ(s.path->max_residual_m, 0.07);
}

TEST_F(RecordedFiles, RefusesWhatIsNotThere) {
  EXPECT_EQ(refusal_of([&] { load_recorded(scenario, folder.path("no")); }), folder.path("no") + ": no such data folder");
  config.sensors[0].column = "erm";
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":1: missing column 'erm'; did you mean 'erpm'?");
  config.sensors[0].column = "erpm";
  config.time_column = "time_s";
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":1: missing column 'time_s'; expected one of t_s, erpm, amp");
  config.time_column = "t_s";
  config.truth[0].file = "truth.csv";
  EXPECT_EQ(refused(), folder.path("truth.csv") + ": cannot read: No such file or directory");
}

TEST_F(RecordedFiles, RefusesTimesAndValuesThatCannotBe) {
  folder.write("motor.csv", "t_s,erpm,amp\n\n-0.5,10,1\n1.5,20,2\n");
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":3: t_s: found -0.5, expected a time from 0 to 1000000 s");
  folder.write("motor.csv", "t_s,erpm,amp\n0,10,1\n1e7,20,2\n");
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":3: t_s: found 1e+07, expected a time from 0 to 1000000 s");
  folder.write("motor.csv", "t_s,erpm,amp\n0,10,1e308\n1,20,2\n");
  config.inputs[0].scale = 100.0;
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":2: amp: not finite after scaling to drive_torque_nm");
}

TEST_F(RecordedFiles, AveragesColumnsAndSendsWhatLeadsLater) {
  config.sensors[0].mean_with = {"amp"};
  config.sensors[0].lead_s = 0.25;
  const RecordedStreams s = load_recorded(scenario, folder.path());
  EXPECT_EQ(s.sensors[0].value, (std::vector<double>{0.5 * 5.5 + 1.0, 0.5 * 11.0 + 1.0}));
  EXPECT_EQ(s.sensors[0].time_s, (std::vector<double>{0.75, 1.75}));
  EXPECT_EQ(s.inputs[0].time_s, (std::vector<double>{0.5, 1.5}));
  config.sensors[0].mean_with = {"apm"};
  EXPECT_EQ(refused(), folder.path("motor.csv") + ":1: missing column 'apm'; did you mean 'amp'?");
}

TEST_F(RecordedFiles, ReadsReadingsOfSeveralNumbers) {
  folder.write("imu.csv", "t_s,ax,ay,az,wx,wy,wz\n0.1,1,2,3,4,5,6\n0.2,1,2,9.8,0,0,0.5\n");
  folder.write("gnss.csv", "t_s,e,n,u\n0,0,0,0\n1,1000,0,5\n2,0,-2000,7\n3,1,1,1\n");
  folder.write("fix.csv", "t_s,lat,lon,h\n1,49.5,8.25,100\n2,95,8,0\n");
  scenario.imu.emplace(), scenario.gnss.emplace(), scenario.lidar.emplace();
  scenario.world.origin = {49.0, 8.0, 110.0};
  config.groups = {{"imu", "imu.csv", {"ax", "ay", "az", "wx", "wy", "wz"}, {1, -1, -1, 1, -1, -1}, "geodetic", 0.0},
                   {"gnss", "gnss.csv", {"e", "n", "u"}, {}, "enu", 0.25},
                   {"lidar", "gnss.csv", {"u", "e", "n"}, {2, 1, 1}, "geodetic", 0.0}};
  scenario.gnss->outages_s = {2.5, 2.76};
  scenario.lidar->outages_s = {0.0, 2.0};
  const RecordedStreams s = load_recorded(scenario, folder.path());
  ASSERT_EQ(s.groups.size(), 3u);
  EXPECT_EQ(s.groups[0].quantity, "imu");
  EXPECT_EQ(s.groups[0].time_s, (std::vector<double>{0.1, 0.2}));
  const auto numbers = [](const Values& v) { return std::vector<double>(v.begin(), v.end()); };
  EXPECT_EQ(numbers(s.groups[0].value[0]), (std::vector<double>{1, -2, -3, 4, -5, -6}));  // right and down became left and up
  EXPECT_EQ(s.groups[1].time_s, (std::vector<double>{0, 1, 2})) << "the fix sent at 3 s was measured at 2.75 s, in the outage";
  EXPECT_EQ(s.groups[1].lag_s, 0.25);
  EXPECT_NEAR(s.groups[1].value[0][0], 49.0, 1e-13);                     // rounding of degrees
  EXPECT_NEAR(s.groups[1].value[0][2], 110.0, 1e-8);                     // and of 6.4e6 m
  EXPECT_NEAR(s.groups[1].value[1][1], 8.0 + 1000.0 / 73170.0, 1e-5);    // a degree of longitude there: 73.2 km
  EXPECT_NEAR(s.groups[1].value[2][0], 49.0 - 2000.0 / 111213.0, 1e-5);  // of latitude: 111.2 km
  EXPECT_EQ(s.groups[2].time_s, (std::vector<double>{2, 3}));
  EXPECT_EQ(numbers(s.groups[2].value[0]), (std::vector<double>{14, 0, -2000}));

  config.groups[1] = {"gnss", "fix.csv", {"lat", "lon", "h"}, {}, "geodetic", 0.0};
  EXPECT_EQ(refused(), folder.path("fix.csv") + ":3: gnss: its latitude is not from -90 to 90 degrees");
  folder.write("fix.csv", "t_s,lat,lon,h\n1,49.5,8.25,1e308\n");
  config.groups[1].scale = {1, 1, 100};
  EXPECT_EQ(refused(), folder.path("fix.csv") + ":2: gnss: its value is not finite");
  folder.write("imu.csv", "t_s,ax,ay,az,wx,wy,wz\n0.1,1,2,3,4,5,6\n0.1,1,2,9.8,0,0,0.5\n");
  EXPECT_EQ(refused(), folder.path("imu.csv") + ":3: t_s: found 0.1, expected more than the row before it");
}

TEST_F(RecordedFiles, TurnsQuaternionsIntoRollPitchYawOfTheBody) {
  // Nose to the north and 0.1 rad up. Forward-left-up: yaw pi/2, pitch -0.1. Forward-right-down is that, turned by pi about the
  // nose.
  const Rotation flu = from_rpy({0.0, -0.1, kPi / 2.0}), frd = flu * Rotation(0.0, 1.0, 0.0, 0.0);
  const auto row = [](const Rotation& q) {
    char text[120];
    std::snprintf(text, sizeof text, "1,%.17g,%.17g,%.17g,%.17g\n", q.w(), q.x(), q.y(), q.z());
    return std::string("t_s,qw,qx,qy,qz\n") + text;
  };
  const auto expect = [&](const Vector3& rpy) {
    const RecordedStreams s = load_recorded(scenario, folder.path());
    ASSERT_EQ(s.truth.size(), 4u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(s.truth[i + 1].quantity, (std::array{"roll_rad", "pitch_rad", "yaw_rad"}[i]));
      EXPECT_EQ(s.truth[i + 1].unit, "rad");
      EXPECT_EQ(s.truth[i + 1].time_s, std::vector<double>{1.0});
      EXPECT_NEAR(s.truth[i + 1].value.at(0), rpy[static_cast<Eigen::Index>(i)], 1e-15);
    }
  };
  config.attitude.emplace().file = "attitude.csv";
  folder.write("attitude.csv", row(flu));
  expect({0.0, -0.1, kPi / 2.0});
  folder.write("attitude.csv", row(frd));
  config.attitude->axes = "frd";
  expect({0.0, -0.1, kPi / 2.0});
  config.attitude->rpy_rad = {0.0, -0.04, 0.0};  // what was recorded looks 0.04 rad above the body's nose
  expect({0.0, -0.06, kPi / 2.0});
  folder.write("attitude.csv", "t_s,qw,qx,qy,qz\n1,1,0,0,0\n2,1,0.3,0,0\n");
  EXPECT_EQ(refused(), folder.path("attitude.csv") + ":3: found a quaternion of length 1.044031, expected 1");
}

// --- What is shipped --------------------------------------------------------------------------------------------------

Scenario shipped(const std::string& name) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml").scenario;
}

const RecordedStream& truth_of(const RecordedStreams& streams, const std::string& quantity) {
  for (const RecordedStream& s : streams.truth)
    if (s.quantity == quantity) return s;
  throw std::runtime_error(quantity);
}

// The README's conventions: row k of the IMU takes the truth's velocity from t_k to t_k+1, v += dt (R f - g z), with white
// noise of 0.0316 m/s^2; the fixes lie about the truth by 0.07 ... 0.10 m, and by 0.50 m after C_li and t_i_li.
TEST(ShippedRecordings, TheCourserasDriveKeepsItsConventions) {
  const std::string data = std::string(SLIPSTREAM_DATA_DIR) + "/coursera_carla_pt1";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << "no recorded drives: configure with -DSLIPSTREAM_DATA=FOLDER";
  const Scenario scenario = shipped("coursera_carla");
  const RecordedStreams s = load_recorded(scenario, data);
  ASSERT_EQ(s.groups.size(), 3u);
  EXPECT_EQ(s.groups[0].value.size(), 10918u);
  const std::vector<double>& time_s = truth_of(s, "up_m").time_s;
  ASSERT_EQ(time_s.size(), 8734u);
  const auto at = [&](const std::array<const char*, 3>& names, std::size_t k) -> Vector3 {
    return {truth_of(s, names[0]).value[k], truth_of(s, names[1]).value[k], truth_of(s, names[2]).value[k]};
  };
  const std::array p{"east_m", "north_m", "up_m"}, v{"v_east_mps", "v_north_mps", "v_up_mps"},
      rpy{"roll_rad", "pitch_rad", "yaw_rad"};
  double square = 0.0;
  for (std::size_t k = 0; k + 1 < time_s.size(); ++k) {
    ASSERT_EQ(s.groups[0].time_s[k], time_s[k]);
    const Vector3 f(s.groups[0].value[k][0], s.groups[0].value[k][1], s.groups[0].value[k][2]);
    const Vector3 missed = (at(v, k + 1) - at(v, k)) / 0.005 - (from_rpy(at(rpy, k)) * f - 9.81 * Vector3::UnitZ());
    square += missed.squaredNorm() / 3.0;
  }
  // 0.0316 is rounded to 1 %, and its own error is 0.4 %; seven digits of velocity / dt add 1e-4 m/s^2.
  EXPECT_NEAR(std::sqrt(square / 8733.0), 0.0316, 0.0005);

  const LocalFrame world(scenario.world.origin);
  const Rotation c = from_rpy(scenario.lidar->map_rpy_rad);
  for (std::size_t g : {1u, 2u}) {
    double sum = 0.0;
    int n = 0;
    for (std::size_t i = 0; i < s.groups[g].time_s.size(); ++i) {
      const auto row = std::lower_bound(time_s.begin(), time_s.end(), s.groups[g].time_s[i] - 1e-6) - time_s.begin();
      if (row == static_cast<std::ptrdiff_t>(time_s.size())) break;
      const Values& z = s.groups[g].value[i];
      const Vector3 fix =
          g == 1 ? world.to_enu({z[0], z[1], z[2]}) : Vector3(c * Vector3(z[0], z[1], z[2]) + scenario.lidar->map_offset_m);
      sum += (fix - at(p, static_cast<std::size_t>(row))).squaredNorm() / 3.0;
      ++n;
    }
    EXPECT_GE(n, g == 1 ? 40 : 400);
    EXPECT_NEAR(std::sqrt(sum / n), g == 1 ? std::sqrt((0.07 * 0.07 + 2 * 0.01) / 3.0) : 0.5, g == 1 ? 0.025 : 0.05)
        << "4 standard errors, sigma / sqrt(6 n)";
  }
}

// The README: wheels 0.9 % low with a residual of 0.045 m/s, the body moves along its own x axis once the camera's 3.8 and 0.8
// deg are taken out, and gravity is up.
TEST(ShippedRecordings, TheCivicKeepsItsConventions) {
  const std::string data = std::string(SLIPSTREAM_DATA_DIR) + "/comma2k19_civic";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << "no recorded drives: configure with -DSLIPSTREAM_DATA=FOLDER";
  const Scenario scenario = shipped("comma_civic");
  const RecordedStreams s = load_recorded(scenario, data);
  const std::vector<double>& time_s = truth_of(s, "up_m").time_s;
  ASSERT_EQ(time_s.size(), 1200u);
  ASSERT_EQ(truth_of(s, "roll_rad").value.size(), 1200u);
  Vector3 along = Vector3::Zero();
  double square = 0.0;
  int n = 0;
  const RecordedStream& wheels = s.sensors.at(0);
  for (std::size_t k = 60; k < 1180; ++k) {  // 3 to 59 s
    const Vector3 v(truth_of(s, "v_east_mps").value[k], truth_of(s, "v_north_mps").value[k], truth_of(s, "v_up_mps").value[k]);
    const Rotation q =
        from_rpy({truth_of(s, "roll_rad").value[k], truth_of(s, "pitch_rad").value[k], truth_of(s, "yaw_rad").value[k]});
    const Vector3 v_B = q.conjugate() * v;
    along += v_B / 1120.0;
    const auto after = std::upper_bound(wheels.time_s.begin(), wheels.time_s.end(), time_s[k]);
    const auto i = static_cast<std::size_t>(after - wheels.time_s.begin());
    const double part = (time_s[k] - wheels.time_s[i - 1]) / (wheels.time_s[i] - wheels.time_s[i - 1]);
    const double missed = wheels.value[i - 1] + part * (wheels.value[i] - wheels.value[i - 1]) - v.norm();
    square += missed * missed;
    ++n;
  }
  EXPECT_GT(along[0], 8.0);
  EXPECT_NEAR(along[1] / along[0], 0.0, 0.002);  // 0.1 deg: the README's angles are rounded to that
  EXPECT_NEAR(along[2] / along[0], 0.0, 0.002);
  EXPECT_NEAR(std::sqrt(square / n), 0.045, 0.01);  // the README's residual, at other instants
  Vector3 f = Vector3::Zero();
  for (const Values& z : s.groups.at(0).value) f += Vector3(z[0], z[1], z[2]) / static_cast<double>(s.groups[0].value.size());
  const Vector3 f_B = from_rpy(scenario.imu->rpy_rad) * f;
  EXPECT_NEAR(f_B[2], 9.81, 0.2);    // gravity, up; an uncalibrated phone
  EXPECT_LT(std::abs(f_B[1]), 0.4);  // level to 2 deg
}

// The README of the drive says: path 83.0 m by the motor's speed.
TEST(ShippedRecordings, TheScaleCarRollsItsPublishedPath) {
  const std::string data = std::string(SLIPSTREAM_DATA_DIR) + "/f1tenth_friction/ds5a";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << "no recorded drives: configure with -DSLIPSTREAM_DATA=FOLDER";
  const Scenario s = shipped("f1tenth_ds5a");
  const RecordedStreams streams = load_recorded(s, data);
  const RecordedStream& wheel = streams.sensors.at(0);
  double path_m = 0.0;
  for (std::size_t i = 1; i < wheel.value.size(); ++i)
    path_m += 0.5 * std::abs(wheel.value[i] + wheel.value[i - 1]) * (wheel.time_s[i] - wheel.time_s[i - 1]) * 0.319 / (2 * kPi);
  EXPECT_NEAR(path_m, 83.0, 0.83);  // 1 %: theirs sums another topic of the same motor, at other instants
}

}  // namespace
}  // namespace slipstream
