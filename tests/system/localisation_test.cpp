// A car with IMU, GNSS and LIDAR through the real programs, and a user's own CSV files through slipstream-import.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "common/geodesy.hpp"
#include "tests/system/doors.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

std::string scenario(const std::string& name) { return std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml"; }

void expect_same_estimates(const std::string& log, const std::string& again, const std::string& name, std::size_t count) {
  const std::vector<Estimate> first = estimates_in(log, name), second = estimates_in(again, name);
  EXPECT_EQ(first.size(), count);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) ASSERT_EQ(bits(first[i]), bits(second[i])) << "estimate " << i;
}

TEST(Localisation, LiveInLockstepAndAgainFromTheLog) {
  Bench bench;
  {
    Process plant = bench.plant({scenario("city"), "--set", "run.duration_s=4", "--wait-for", "es_ekf,ukf,monitor"}),
            monitor = bench.monitor(), es_ekf = bench.estimator({"--algorithm", "es_ekf", "--once"}),
            ukf = bench.estimator({"--algorithm", "ukf", "--once"});
    for (Process* p : {&plant, &es_ekf, &ukf, &monitor}) expect_success(*p);
  }
  const nlohmann::json scores = bench.scores();
  for (const std::string name : {"es_ekf", "ukf"}) {
    const nlohmann::json& estimator = scores["estimators"][name];
    EXPECT_EQ(estimator["valid"], 2001) << name << ": 4 s at 500 Hz, both ends";
    EXPECT_LT(estimator["states"]["east_m"]["rmse"], 0.15) << name << ": the sensors' 0.1 m, and a margin";
    EXPECT_TRUE(estimator["warnings"].empty()) << name << estimator["warnings"];
    Process again = bench.from_log(bench.path("out/run.lcm"), {"--algorithm", name, "--out", bench.path(name + ".lcm")});
    expect_success(again);
    expect_same_estimates(bench.path("out/run.lcm"), bench.path(name + ".lcm"), name, 2001);
  }
}

TEST(Localisation, AnAlgorithmThatDoesNotFitIsRefused) {
  Bench bench;
  Process plant = bench.plant({scenario("city"), "--set", "run.duration_s=60", "--wait-for", "nobody"});
  Process ekf = bench.estimator({"--algorithm", "ekf"});
  EXPECT_EQ(ekf.wait(), 1);
  EXPECT_EQ(
      ekf.err(),
      "slipstream-estimator: algorithm 'ekf' does not work on the model of scenario 'city' ('strapdown'); expected one of: "
      "es_ekf, ukf\n");
  plant.signal(SIGTERM);
  plant.wait();
}

// --- A user's own files ---------------------------------------------------------------------------------------------------

constexpr Geodetic kOrigin{-22.0, -47.9, 850.0};  // Sao Carlos

// A car that drives a circle of 20 m at 5 m/s for 20 s: closed form, without noise.
struct OwnFiles {
  std::vector<std::string> imu{"t_s,f_x_mps2,f_y_mps2,f_z_mps2,w_x_radps,w_y_radps,w_z_radps"},
      gnss{"t_s,latitude_deg,longitude_deg,height_m"}, speed{"t_s,forward_speed_mps"};

  OwnFiles() {
    constexpr double kRadius = 20.0, kSpeed = 5.0, kRate = kSpeed / kRadius;
    const LocalFrame frame(kOrigin);
    char row[200];
    for (int k = 0; k <= 2000; ++k) {
      std::snprintf(row, sizeof row, "%.2f,0,%.9f,9.81,0,0,%.9f", 0.01 * k, kSpeed * kRate, kRate);
      imu.emplace_back(row);
      if (k % 5 == 0) speed.push_back(std::to_string(0.01 * k) + ",5");
      if (k % 20 != 0) continue;
      const double angle = kRate * 0.01 * k;
      const Geodetic at = frame.to_geodetic({kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), 0.0});
      std::snprintf(row, sizeof row, "%.2f,%.12f,%.12f,%.6f", 0.01 * k, at.latitude_deg, at.longitude_deg, at.height_m);
      gnss.emplace_back(row);
    }
  }
  void write(const std::string& folder) const {
    std::filesystem::create_directories(folder);
    for (const auto& [name, rows] : {std::pair{"imu", &imu}, std::pair{"gnss", &gnss}, std::pair{"speed", &speed}}) {
      std::ofstream out(folder + "/" + name + ".csv");
      for (const std::string& row : *rows) out << row << "\n";
    }
  }
};

Arguments import_of(const Bench& bench) {
  return {scenario("own_car"),        "--data", bench.path("csv"),           "--out", bench.path("my.lcm"), "--set",
          "world.latitude_deg=-22.0", "--set",  "world.longitude_deg=-47.9", "--set", "world.height_m=850"};
}

TEST(Import, AUsersOwnFilesBecomeALogThatIsEstimatedAndScored) {
  Bench bench;
  OwnFiles().write(bench.path("csv"));
  Process import = bench.run(Arguments{Bench::program("import")} + import_of(bench));
  expect_success(import);
  // A descriptor, 2001 + 101 + 401 readings, 2001 instants with a tick each, and the end.
  EXPECT_EQ(import.out(), "slipstream-import: " + bench.path("my.lcm") + ": 4506 messages up to 20.000 s\n");
  Process estimator =
      bench.from_log(bench.path("my.lcm"), {"--algorithm", "es_ekf", "--out", bench.path("e.lcm"), "--with-input"});
  expect_success(estimator);
  const std::vector<Estimate> estimates = estimates_in(bench.path("e.lcm"), "es_ekf");
  ASSERT_EQ(estimates.size(), 2001U);
  ASSERT_EQ(estimates.back().status, EstimateStatus::kValid);
  // At 20 s it has turned by 5 rad. The fixes are exact; the filter, told that they are not, has its own 0.5 m.
  const double angle = 5.0 / 20.0 * 20.0;
  EXPECT_NEAR(estimates.back().mean[0], 20.0 * std::sin(angle), 0.5);
  EXPECT_NEAR(estimates.back().mean[1], 20.0 * (1.0 - std::cos(angle)), 0.5);
  EXPECT_NEAR(std::remainder(estimates.back().mean[8] - angle, 2.0 * 3.14159265358979), 0.0, 0.05);
  Process monitor = bench.run(
      {Bench::program("monitor"), "--lcm-url", "file://" + bench.path("e.lcm") + "?speed=0", "--out", bench.path("scored")});
  expect_success(monitor);
  EXPECT_GT(bench.scores("scored")["estimators"]["es_ekf"]["valid"],
            1000);  // it knows its heading before half of the 2001 instants are over
}

TEST(Import, TheSameFilesGiveTheSameBytes) {
  Bench bench;
  OwnFiles().write(bench.path("csv"));
  std::string first;
  for (int i = 0; i < 2; ++i) {
    Process import = bench.run(Arguments{Bench::program("import")} + import_of(bench));
    expect_success(import);
    const std::string bytes = text_of(bench.path("my.lcm"));
    EXPECT_GT(bytes.size(), 100'000U);
    if (i == 0) first = bytes;
    EXPECT_TRUE(bytes == first);
  }
}

TEST(Import, RefusesBadRowsWithFileAndLine) {
  Bench bench;
  const auto refused = [&](const OwnFiles& files) {
    files.write(bench.path("csv"));
    std::string line = refused_line(bench, Arguments{Bench::program("import")} + import_of(bench));
    const std::string folder = bench.path("csv") + "/";
    for (std::size_t at; (at = line.find(folder)) != std::string::npos;) line.erase(at, folder.size());
    return line;
  };
  OwnFiles files;
  files.imu[7] = "0.06,0,nan,9.81,0,0,0.25";
  EXPECT_EQ(refused(files), "slipstream-import: imu.csv:8: f_y_mps2: found 'nan', expected a finite number\n");
  files = {};
  files.imu[7] = "0.02,0,0,9.81,0,0,0.25";
  EXPECT_EQ(refused(files), "slipstream-import: imu.csv:8: t_s: found 0.02, expected more than the row before it\n");
  files = {};
  files.imu[7] = "0.05,0,0,9.81,0,0,0.25";
  EXPECT_EQ(refused(files), "slipstream-import: imu.csv:8: t_s: found 0.05, expected more than the row before it\n");
  files = {};
  files.imu[7] = "0.06,0,0,9.81,0,0";
  EXPECT_EQ(refused(files), "slipstream-import: imu.csv:8: found 6 cells, expected 7 as in the header\n");
  files = {};
  files.gnss[3] = "0.40,95,-47.9,850";
  EXPECT_EQ(refused(files), "slipstream-import: gnss.csv:4: gnss: its latitude is not from -90 to 90 degrees\n");
  files = {};
  files.gnss[1] = "0.00,48.5,9.25,400";
  EXPECT_EQ(refused(files).substr(0, 48), "slipstream-import: gnss.csv:2: the first fix is ");
  files = {};
  files.speed[0] = "t_s,speed_mps";
  EXPECT_EQ(refused(files),
            "slipstream-import: speed.csv:1: missing column 'forward_speed_mps'; expected one of t_s, speed_mps\n");
}

TEST(Import, RefusesWhatItCannotImport) {
  Bench bench;
  const std::string own = scenario("own_car");
  expect_refused(bench, "import", {own, "--out", "x.lcm"}, "--data: missing; name the folder with the CSV files");
  expect_refused(bench, "import", {own, "--data", "nowhere"}, "--out: missing; name the log to write");
  expect_refused(bench, "import", {own, "--data", "nowhere", "--out", "x.lcm"}, "nowhere: no such data folder");
  expect_refused(bench, "import", {scenario("city"), "--data", ".", "--out", "x.lcm"},
                 "scenario 'city' is simulated: there is nothing to import without [recorded]");
  OwnFiles().write(bench.path("csv"));
  Arguments unwritable = import_of(bench);
  unwritable[4] = "/nonexistent/x.lcm";
  expect_refused(bench, "import", unwritable, "/nonexistent/x.lcm: cannot write the log");
  expect_refused(bench, "estimator", {"--with-input"}, "--with-input: goes with --out");
}

}  // namespace
}  // namespace slipstream::test
