// Every refusal of the three programs, word for word: one line on stderr, exit code 1, nothing on stdout, nothing written.
// The bus is not needed to refuse these; doors_of_logs_test.cpp and doors_of_the_bus_test.cpp have the others.
#include "tests/system/doors.hpp"

#include <gtest/gtest.h>

namespace slipstream::test {
namespace {

TEST(Doors, CommandLines) {
  Bench bench;
  struct {
    const char* program;
    Arguments arguments;
    const char* line;
  } const doors[] = {
      {"plant", {}, "missing argument 'SCENARIO'; see --help"},
      {"plant", {kUnimog, "more"}, "unexpected argument 'more'; see --help"},
      {"plant", {kUnimog, "--clok", "free"}, "unknown option '--clok'; did you mean '--clock'?"},
      {"estimator", {"--algoritm", "ekf"}, "unknown option '--algoritm'; did you mean '--algorithm'?"},
      {"monitor", {"--uot", "x"}, "unknown option '--uot'; did you mean '--out'?"},
      {"monitor", {"--colour"}, "unknown option '--colour'; see --help"},
      {"monitor", {"--out"}, "--out: expected a value; see --help"},
      {"plant", {kUnimog, "--clock", "--data"}, "--clock: expected a value, found the option '--data'"},
      {"plant",
       {kUnimog, "--wait-for", "ekf,,mhe"},
       "--wait-for: '' is no participant's name; expected NAME[,NAME...] or none"},
      {"plant", {kUnimog, "--wait-for", "a b"}, "--wait-for: 'a b' is no participant's name; expected NAME[,NAME...] or none"},
      {"estimator",
       {"--algorithm", "ekff"},
       "--algorithm: unknown algorithm 'ekff'; expected one of: ekf, ukf, sqrt_ukf, mhe, pf, asir, rbpf, imm, "
       "hierarchical_ekf, hierarchical_mhe, es_ekf"},
      {"estimator", {"--name", "my filter"}, "--name: 'my filter' is no name; expected 1 to 32 of A-Z a-z 0-9 _ -"},
      {"estimator",
       {"--name", std::string(33, 'x')},
       "--name: 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx' is no name; expected 1 to 32 of A-Z a-z 0-9 _ -"},
      {"estimator", {"--config", "none.toml"}, "none.toml: no such file"},
      {"estimator", {"--out", "new.lcm"}, "--out: goes with a log: --lcm-url 'file://LOG?speed=0'"},
      {"monitor", {"--name", "../x"}, "--name: found '../x', expected 1 to 32 characters of A-Z a-z 0-9 _ -"},
      {"monitor", {"--log-name", "a/b"}, "--log-name: found 'a/b', expected a plain file name"},
      {"monitor", {"--published", "none.json"}, "none.json: cannot be read, expected a JSON file of published values"},
  };
  for (const auto& door : doors) expect_refused(bench, door.program, door.arguments, door.line);
}

TEST(Doors, Urls) {
  Bench bench;
  for (const char* url : {"", "udpm://", "udpm:/239.255.76.67:7667", "udpm://localhost:7667", "http://239.255.76.67:7667",
                          "udpm://239.255.76.67:7667?ttl=0;x", "udpm://239.255.76.67:99999", "udpm://239.255.76.999:7667",
                          "udpm://192.168.0.1:7667", "memq://", "udpm://239.255.76.67:0"}) {
    const std::string line = std::string("--lcm-url: cannot use '") + url +
                             "'; expected udpm://GROUP:PORT?ttl=N (e.g. udpm://239.255.76.67:7667?ttl=0) or file://LOG?speed=0";
    expect_refused(bench, "plant", {kUnimog, "--lcm-url", url}, line);
    expect_refused(bench, "estimator", {"--lcm-url", url}, line);
    expect_refused(bench, "monitor", {"--lcm-url", url}, line);
  }
  for (const char* url : {"file://x.lcm?speed=-1", "file://x.lcm?speed=", "file://x.lcm?fast", "file://x.lcm?speed=1x"}) {
    const std::string line = std::string("--lcm-url: cannot use '") + url +
                             "'; expected file://LOG?speed=S with S >= 0, where 0 is as fast as possible";
    expect_refused(bench, "estimator", {"--lcm-url", url}, line);
    expect_refused(bench, "monitor", {"--lcm-url", url}, line);
  }
}

TEST(Doors, Scenarios) {
  Bench bench;
  const std::string missing = bench.path("none.toml");
  expect_refused(bench, "plant", {missing}, missing + ": cannot read: No such file or directory");
  expect_refused(bench, "plant", {bench.path("work")}, bench.path("work") + ": cannot read: Is a directory");

  const std::string base = "base = \"" + kUnimog + "\"\n";
  struct {
    const char* text;
    const char* rest;
  } const files[] = {
      {"[run]\nduraton_s = 3\n", ":3:1: unknown key 'duraton_s' in [run]; did you mean 'duration_s'?"},
      {"[run]\n  seed = -1\n", ":3:10: run.seed: found -1, expected a whole number from 0 to 9007199254740992"},
      {"[vehicle]\nmass_kg = \"heavy\"\n", ":3:11: vehicle.mass_kg: found \"heavy\", expected a number greater than 0"},
      {"[vehicle]\nmass_kg = nan\n", ":3:11: vehicle.mass_kg: found nan, expected a finite number greater than 0"},
      {"[estimator]\ntuning = \"best\"\n",
       ":3:10: estimator.tuning: found \"best\", expected one of \"document\", \"matched\""},
      {"[sensor.gyro]\nrate_hz = 1\n",
       ":2:9: unknown key 'gyro' in [sensor]; expected one of wheel_speed, accelerometer, yaw_rate, lateral_accelerometer, "
       "motor_current, forward_speed, east_position, north_position, imu, gnss, lidar"},
      {"[run\n", ":2:5: syntax error: Error while parsing table header: expected ']', saw '\\n'"},
  };
  for (const auto& file : files) {
    const std::string path = bench.folder.write("bad.toml", base + file.text);
    expect_refused(bench, "plant", {path}, path + file.rest);
  }
  expect_refused(bench, "plant", {kUnimog, "--set", "run.sed=1"},
                 "override 'run.sed=1': unknown key 'sed' in [run]; did you mean 'seed'?");
  expect_refused(bench, "plant", {kUnimog, "--set", "run.duration_s"}, "override 'run.duration_s': expected table.key=value");
  expect_refused(
      bench, "plant", {kUnimog, "--clock", "sundial"},
      "override 'run.clock=sundial': run.clock: found \"sundial\", expected one of \"lockstep\", \"realtime\", \"free\"");
}

TEST(Doors, RecordedDrives) {
  Bench bench;
  const std::string scenario = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/f1tenth_ds5a.toml";
  expect_refused(bench, "plant", {scenario},
                 "scenario 'f1tenth_ds5a' plays a recorded drive: name the folder with its files by --data DIR");
  expect_refused(bench, "plant", {kUnimog, "--data", bench.path("data")},
                 "--data: scenario 'unimog' is simulated and reads no recorded drive");
  expect_refused(bench, "plant", {scenario, "--data", bench.path("data")}, bench.path("data") + ": no such data folder");

  std::filesystem::create_directory(bench.path("data"));
  std::string motor = "t_s,i_motor_A,erpm_fwd\n", imu = "t_s,f_x_mps2\n", pose = "t_s,p_x_m,p_y_m,yaw_rad\n";
  for (int i = 1; i <= 40; ++i) {
    const std::string t = std::to_string(0.05 * i);
    motor += t + ",1,6000\n";
    imu += t + ",0\n";
    pose += t + "," + t + ",0,0\n";
  }
  bench.folder.write("data/imu.csv", imu);
  bench.folder.write("data/reference_pose.csv", pose);
  struct {
    const char* row;
    const char* rest;
  } const rows[] = {
      {"2.1,1,fast\n", ":42: erpm_fwd: found 'fast', expected a finite number"},
      {"2.1,,6000\n", ":42: i_motor_A: found '', expected a finite number"},
      {"2.1,nan,6000\n", ":42: i_motor_A: found 'nan', expected a finite number"},
      {"2.1,1\n", ":42: found 2 cells, expected 3 as in the header"},
      {"1.9,1,6000\n", ":42: t_s: found 1.9, expected more than the row before it"},
  };
  for (const auto& row : rows) {
    const std::string path = bench.folder.write("data/motor.csv", motor + row.row + "2.2,1,6000\n");
    expect_refused(bench, "plant", {scenario, "--data", bench.path("data")}, path + row.rest);
  }
  bench.folder.write("data/motor.csv", motor);
  std::filesystem::remove(bench.path("data/imu.csv"));
  expect_refused(bench, "plant", {scenario, "--data", bench.path("data")},
                 bench.path("data/imu.csv") + ": cannot read: No such file or directory");
}

}  // namespace
}  // namespace slipstream::test
