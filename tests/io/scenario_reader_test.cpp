#include "io/scenario_reader.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "tests/io/temporary_folder.hpp"

namespace slipstream {
namespace {

const std::string kVehicles =
    "one of \"unimog\", \"quarter_car\", \"suspended_wheel\", \"bicycle\", \"road_car\", "
    "\"point_mass\", \"two_track\"";  // models/registry.hpp

// Lines are counted in the tests below: [sensor.wheel_speed] is line 5, [tuning.matched] line 12.
const std::string kMinimal = R"(name = "minimal"
[run]
[vehicle]
type = "unimog"
[sensor.wheel_speed]
rate_hz = 50
[estimator]
tuning = "matched"
[estimator.model]
type = "longitudinal_friction"

[tuning.matched]
process_variance = { wheel_speed_radps = 1e-4, speed_mps = 1e-8, friction = 5e-3 }
initial_mean = { wheel_speed_radps = 0.5, speed_mps = 0.26, friction = 0 }
initial_variance = { wheel_speed_radps = 1, speed_mps = 1, friction = 1 }
)";

const std::string kRecorded = R"(name = "drive"
[sensor.wheel_speed]
rate_hz = 20
[recorded]
[[recorded.sensor]]
quantity = "wheel_speed_radps"
file = "motor.csv"
column = "erpm"
scale = 0.1
[[recorded.input]]
quantity = "drive_torque_nm"
file = "motor.csv"
column = "amp"
offset = -1
[[recorded.truth]]
quantity = "friction"
file = "truth.csv"
column = "mu"
[recorded.path_speed]
file = "pose.csv"
yaw_column = "yaw_rad"
[estimator.model]
type = "longitudinal_friction"
mass_kg = 3.3
[tuning.matched]
start = "measured"
process_variance = { wheel_speed_radps = 1e-4, speed_mps = 1e-8, friction = 5e-3 }
initial_variance = { wheel_speed_radps = 1, speed_mps = 1, friction = 1 }
)";

// Lines are counted: [sensor.imu] is line 9, [sensor.gnss] line 12, [sensor.lidar] line 16, [tuning.matched] line 21.
const std::string kStrapdown = R"(name = "strapdown"
[world]
latitude_deg = 50
[vehicle]
type = "road_car"
speed_time_s = [0, 2]
speed_mps = [0, 5]
curvature_distance_m = []
[sensor.imu]
rate_hz = 200
position_m = [0.1, 0.2, 0.3]
[sensor.gnss]
rate_hz = 5
outages_s = [1, 2, 3, 4]
noise_m = [0.1, 0.1, 0.3]
[sensor.lidar]
rate_hz = 10
map_rpy_rad = [0.1, 0, 0]
[estimator.model]
type = "strapdown"
[tuning.matched]
start = "fixes"
)";

// Lines: [sensor.imu] 2, the groups 7, 11, 17, [recorded.attitude] 22.
const std::string kRecordedStrapdown = R"(name = "drive"
[sensor.imu]
rate_hz = 100
[sensor.gnss]
rate_hz = 10
[recorded]
[[recorded.group]]
quantity = "imu"
file = "imu.csv"
columns = ["a", "b", "c", "d", "e", "f"]
[[recorded.group]]
quantity = "gnss"
file = "gnss.csv"
columns = ["x", "y", "z"]
frame = "enu"
lag_s = 0.065
[[recorded.truth]]
quantity = "east_m"
file = "truth.csv"
column = "x"
mean_with = ["xx"]
[recorded.attitude]
file = "truth.csv"
axes = "frd"
rpy_rad = [0, 0.1, 0]
[estimator.model]
type = "strapdown"
[tuning.matched]
initial_position_m = [0, 0, 0]
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string refused(const std::string& toml) {
  const std::string line = refusal_of([&] { load_scenario_text(toml, "s.toml"); });
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  return line;
}

// The refusal of the minimal scenario with one line changed.
std::string refused_with(const std::string& from, const std::string& to) { return refused(replaced(kMinimal, from, to)); }

const LongitudinalFriction& model_of(const Scenario& s) { return std::get<LongitudinalFriction>(s.estimator.process); }
const Unimog& unimog_of(const Scenario& s) { return std::get<Unimog>(s.plant.vehicle); }

// Every field, bit by bit, as text.
struct Bits {
  std::string text;
  void put(double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    put(std::to_string(bits));
  }
  void put(const std::string& s) { text += s + "\n"; }
  void put(const std::map<std::string, double>& map) {
    for (const auto& [key, value] : map) put(key), put(value);
  }
  void number(const std::string& key, const double& x, const Range&) { put(key), put(x); }
  void list(const std::string& key, const std::vector<double>& xs, const Range&) {
    put(key);
    for (const double x : xs) put(x);
  }
  void triple(const std::string& key, const Vector<double, 3>& xs, const Range&) {
    put(key);
    for (const double x : xs) put(x);
  }
  void choice(const std::string& key, const std::string& s, const Choices&) { put(key), put(s); }
  void choices(const std::string& key, const std::vector<std::string>& xs, const Choices&) {
    put(key);
    for (const std::string& x : xs) put(x);
  }
  void flag(const std::string& key, const bool& b) { put(key), put(b ? "yes" : "no"); }
};

std::string bits_of(const Scenario& s) {
  Bits b;
  b.put(s.name), b.put(s.description), b.put(std::to_string(s.run.seed)), b.put(s.run.duration_s), b.put(s.run.clock);
  b.put(s.run.realtime_factor), b.put(s.run.start_timeout_s), b.put(s.run.late_timeout_s), b.put(s.run.deadline_s);
  for (const auto& w : s.run.wait_for) b.put(w);
  for (const auto& c : s.sensors)
    b.put(c.type), b.put(c.quantity), b.put(c.rate_hz), b.put(c.noise.relative), b.put(c.noise.absolute), b.put(c.errors.scale),
        b.put(c.errors.bias), b.put(c.errors.quantum), b.put(c.errors.delay_s);
  const auto put_all = [&](const auto& part) { part.visit_parameters(part, b); };
  put_all(s.world);
  if (s.imu) put_all(*s.imu);
  if (s.gnss) put_all(*s.gnss);
  if (s.lidar) put_all(*s.lidar);
  b.put(s.plant.input_rate_hz), b.put(s.plant.truth_rate_hz);
  b.put(s.plant.relative_tolerance), b.put(s.plant.absolute_tolerance);
  std::visit([&](const auto& v) { v.visit_parameters(v, b); }, s.plant.vehicle);
  if (s.recorded) {
    b.put(s.recorded->time_column);
    for (const auto* columns : {&s.recorded->sensors, &s.recorded->inputs, &s.recorded->truth})
      for (const auto& c : *columns) {
        b.put(c.quantity), b.put(c.file), b.put(c.column), b.put(c.scale), b.put(c.offset), b.put(c.lead_s);
        for (const auto& column : c.mean_with) b.put(column);
      }
    for (const auto& g : s.recorded->groups) {
      b.put(g.quantity), b.put(g.file), b.put(g.frame), b.put(g.lag_s);
      for (const auto& column : g.columns) b.put(column);
      for (const double x : g.scale) b.put(x);
    }
    if (const auto& a = s.recorded->attitude) {
      b.put(a->file), b.put(a->axes), b.triple("rpy_rad", a->rpy_rad, {});
      for (const auto& column : a->columns) b.put(column);
    }
    if (const auto& p = s.recorded->path_speed)
      b.put(p->file), b.put(p->x_column), b.put(p->y_column), b.put(p->yaw_column), b.put(p->window_s),
          b.put(p->max_residual_m);
  }
  std::visit(put_all, s.estimator.process);
  if (s.estimator.strapdown) put_all(*s.estimator.strapdown);
  b.put(s.estimator.tuning), b.put(s.estimator.lower_bound), b.put(s.estimator.upper_bound);
  for (const auto& [name, t] : s.estimator.tunings) {
    b.put(name), b.put(t.measurement_noise), b.put(t.measurement_variance), b.put(t.process_noise), b.put(t.process_variance);
    b.put(t.initial_mean), b.put(t.initial_variance), b.put(t.start), b.put(t.mhe_form), b.put(t.mhe_solver),
        b.put(std::to_string(t.mhe_window));
    b.put(t.arrival_weight), b.put(t.measurement_weight), b.put(std::to_string(t.pf_particles)), b.put(t.pf_resample_below),
        b.put(std::to_string(t.pf_recover));
    if (t.process) std::visit(put_all, *t.process);
    put_all(t.strapdown);
  }
  return b.text;
}

void expect_round_trip(const LoadedScenario& loaded) {
  const LoadedScenario again = load_scenario_text(loaded.resolved_toml, "resolved");
  EXPECT_EQ(again.resolved_toml, loaded.resolved_toml);
  EXPECT_EQ(bits_of(again.scenario), bits_of(loaded.scenario));
}

// --- What is read -----------------------------------------------------------------------------------------------------

TEST(ScenarioReader, FillsDefaultsAndPrintsThem) {
  const LoadedScenario loaded = load_scenario_text(kMinimal, "s.toml");
  const Scenario& s = loaded.scenario;
  EXPECT_EQ(s.run.duration_s, 10.0);
  EXPECT_EQ(s.run.clock, "lockstep");
  ASSERT_EQ(s.sensors.size(), 1u);
  EXPECT_EQ(s.sensors[0].quantity, "wheel_speed_radps");
  EXPECT_EQ(s.sensors[0].rate_hz, 50.0);
  for (const char* line : {"seed = 1\n", "duration_s = 10.0\n", "[plant]\n", "wait_for = []\n", "noise_percent = 0.0\n",
                           "gear_ratio = [9.57, 6.635, ", "absolute_tolerance = 1e-10\n", "drag = true\n",
                           "process_variance = { friction = 0.005, speed_mps = 1e-08, wheel_speed_radps = 1e-04 }\n"})
    EXPECT_NE(loaded.resolved_toml.find(line), std::string::npos) << line << loaded.resolved_toml;
  expect_round_trip(loaded);
}

TEST(ScenarioReader, ReadsNumbersOfEveryKind) {
  const Scenario s =
      load_scenario_text(replaced(replaced(kMinimal, "rate_hz = 50", "rate_hz = 50\nnoise_percent = 5\nnoise_radps = 0.25"),
                                  "[run]", "[run]\nseed = 9007199254740992\nwait_for = ['ekf', \"mhe_2\"]"),
                         "s.toml")
          .scenario;
  EXPECT_EQ(s.sensors[0].noise.relative, 0.05);
  EXPECT_EQ(s.sensors[0].noise.absolute, 0.25);
  EXPECT_EQ(s.run.seed, std::uint64_t{1} << 53);
  EXPECT_EQ(s.run.wait_for, (std::vector<std::string>{"ekf", "mhe_2"}));
}

TEST(ScenarioReader, ReadsTheErrorsOfASimulatedSensor) {
  const LoadedScenario plain = load_scenario_text(kMinimal, "s.toml");
  EXPECT_EQ(plain.scenario.sensors[0].errors.scale, 1.0);
  for (const char* line : {"scale = 1.0\n", "bias_radps = 0.0\n", "quantum_radps = 0.0\n", "delay_s = 0.0\n"})
    EXPECT_NE(plain.resolved_toml.find(line), std::string::npos) << line << plain.resolved_toml;
  const LoadedScenario loaded =
      load_scenario_text(replaced(kMinimal, "rate_hz = 50",
                                  "rate_hz = 50\nscale = 1.02\nbias_radps = -0.1\nquantum_radps = 0.25\ndelay_s = 0.004"),
                         "s.toml");
  const SensorErrors& errors = loaded.scenario.sensors[0].errors;
  EXPECT_EQ(errors.scale, 1.02);
  EXPECT_EQ(errors.bias, -0.1);
  EXPECT_EQ(errors.quantum, 0.25);
  EXPECT_EQ(errors.delay_s, 0.004);
  expect_round_trip(loaded);
}

TEST(ScenarioReader, BelievesTheVehicleUnlessToldOtherwise) {
  const Scenario s =
      load_scenario_text(replaced(replaced(kMinimal, "\"unimog\"", "\"unimog\"\nmass_kg = 1500\nwheel_radius_m = 0.6"),
                                  "friction\"\n", "friction\"\nwheel_radius_m = 0.5\n"),
                         "s.toml")
          .scenario;
  EXPECT_EQ(unimog_of(s).quarter.mass_kg, 1500.0);
  EXPECT_EQ(model_of(s).wheel.quarter.mass_kg, 1500.0);
  EXPECT_EQ(unimog_of(s).quarter.wheel_radius_m, 0.6);
  EXPECT_EQ(model_of(s).wheel.quarter.wheel_radius_m, 0.5);
}

TEST(ScenarioReader, ATuningMayHaveItsOwnModelParameters) {
  const LoadedScenario loaded = load_scenario_text(
      replaced(kMinimal, "friction\"\n", "friction\"\nmass_kg = 1800\n") + "[tuning.matched.model]\ndrag = false\n", "s.toml");
  const auto& own = std::get<LongitudinalFriction>(loaded.scenario.estimator.tunings.at("matched").process.value());
  EXPECT_FALSE(own.drag);
  EXPECT_TRUE(model_of(loaded.scenario).drag);
  EXPECT_EQ(own.wheel.quarter.mass_kg, 1800.0);
  expect_round_trip(loaded);
}

TEST(ScenarioReader, PreparesTheVehicle) {
  EXPECT_GT(unimog_of(load_scenario_text(kMinimal, "s.toml").scenario).curve().torque_nm(150.0), 0.0);
}

TEST(ScenarioReader, ReadsARecordedDrive) {
  const LoadedScenario loaded = load_scenario_text(kRecorded, "s.toml");
  const Scenario& s = loaded.scenario;
  EXPECT_EQ(s.run.duration_s, 0.0);
  ASSERT_TRUE(s.recorded);
  EXPECT_EQ(s.recorded->time_column, "t_s");
  EXPECT_EQ(s.recorded->sensors.at(0).scale, 0.1);
  EXPECT_EQ(s.recorded->inputs.at(0).offset, -1.0);
  EXPECT_EQ(s.recorded->truth.at(0).quantity, "friction");
  EXPECT_EQ(s.recorded->path_speed.value().yaw_column, "yaw_rad");
  EXPECT_EQ(model_of(s).wheel.quarter.mass_kg, 3.3);
  EXPECT_EQ(model_of(s).wheel.quarter.frontal_area_m2, QuarterCar{}.frontal_area_m2);
  EXPECT_EQ(s.estimator.tunings.at("matched").initial_mean.at("friction"), 0.0);
  EXPECT_EQ(loaded.resolved_toml.find("[vehicle]"), std::string::npos);
  expect_round_trip(loaded);
}

TEST(ScenarioReader, ReadsAStrapdownModelAndItsSensors) {
  const LoadedScenario loaded = load_scenario_text(kStrapdown, "s.toml");
  const Scenario& s = loaded.scenario;
  EXPECT_EQ(s.world.origin.latitude_deg, 50.0);
  EXPECT_EQ(s.world.origin.longitude_deg, 8.0);
  ASSERT_TRUE(s.imu && s.gnss && s.lidar && s.estimator.strapdown);
  EXPECT_EQ(s.imu->rate_hz, 200.0);
  EXPECT_EQ(s.gnss->outages_s, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(s.gnss->noise_m[2], 0.3);
  // Estimators believe what the sensors are ...
  EXPECT_EQ(s.estimator.strapdown->imu_position_m, s.imu->position_m);
  EXPECT_EQ(s.estimator.strapdown->lidar_map_rpy_rad[0], 0.1);
  EXPECT_EQ(s.estimator.strapdown->gravity_mps2, 9.81);
  EXPECT_EQ(s.estimator.tunings.at("matched").strapdown.start, "fixes");
  for (const char* line : {"bias_walk_radps = 0.0\n", "outages_s = [1.0, 2.0, 3.0, 4.0]\n", "map_rpy_rad = [0.1, 0.0, 0.0]\n",
                           "longitude_deg = 8.0\n", "curvature_radpm = []\n", "history_s = 1.0\n"})
    EXPECT_NE(loaded.resolved_toml.find(line), std::string::npos) << line << loaded.resolved_toml;
  expect_round_trip(loaded);
  // ... unless they are told otherwise.
  const LoadedScenario wrong = load_scenario_text(
      replaced(kStrapdown, "\"strapdown\"\n[tuning", "\"strapdown\"\nlidar_map_rpy_rad = [0, 0, 0.1]\n[tuning"), "s.toml");
  EXPECT_EQ(wrong.scenario.estimator.strapdown->lidar_map_rpy_rad[0], 0.0);
  EXPECT_EQ(wrong.scenario.lidar->map_rpy_rad[0], 0.1);
  expect_round_trip(wrong);
}

TEST(ScenarioReader, ReadsARecordedStrapdownDrive) {
  const LoadedScenario loaded = load_scenario_text(kRecordedStrapdown, "s.toml");
  const RecordedConfig& r = loaded.scenario.recorded.value();
  ASSERT_EQ(r.groups.size(), 2u);
  EXPECT_EQ(r.groups[0].columns.at(5), "f");
  EXPECT_EQ(r.groups[1].frame, "enu");
  EXPECT_EQ(r.groups[1].lag_s, 0.065);
  EXPECT_EQ(r.truth.at(0).mean_with, std::vector<std::string>{"xx"});
  EXPECT_EQ(r.attitude.value().axes, "frd");
  EXPECT_EQ(r.attitude->rpy_rad[1], 0.1);
  expect_round_trip(loaded);
}

TEST(ScenarioReader, KeepsEveryBitOfNumbersAndText) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 500; ++i) {
    double value;
    do {
      const std::uint64_t bits = random();
      std::memcpy(&value, &bits, sizeof value);
    } while (!std::isfinite(value));
    if (i == 0) value = 5e-324;
    if (i == 1) value = -0.0;
    if (i == 2) value = 1e15;
    char text[40];
    std::snprintf(text, sizeof text, "%.17e", value);
    const LoadedScenario loaded =
        load_scenario_text(replaced(kMinimal, "friction = 0 }", std::string("friction = ") + text + " }"), "s.toml");
    const double read = loaded.scenario.estimator.tunings.at("matched").initial_mean.at("friction");
    EXPECT_EQ(std::memcmp(&read, &value, sizeof value), 0) << text;
    expect_round_trip(loaded);
  }
  const LoadedScenario loaded =
      load_scenario_text("description = \"a \\\"b\\\" \\\\ c\\n\\t\\u0001\\u007F \\u00e9\"\n" + kMinimal, "s.toml");
  EXPECT_EQ(loaded.scenario.description, "a \"b\" \\ c\n\t\x01\x7f \xC3\xA9");
  expect_round_trip(loaded);
}

// --- What is refused --------------------------------------------------------------------------------------------------

TEST(Refusals, ListsOfChoices) {
  const auto told = [](const std::string& lists) {
    const std::string path = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/surfaces.toml";
    try {
      load_scenario_file(path, {lists});
    } catch (const Refusal& refusal) {
      const std::string line = refusal.what();
      return line.substr(line.find("surfaces:") == std::string::npos ? 0 : line.find("surfaces:"));
    }
    return std::string("(not refused)");
  };
  EXPECT_EQ(told("vehicle.surfaces=[\"ice\", \"ice\", \"wet\"]"), "(not refused)") << "a road may come back to a surface";
  EXPECT_EQ(told("vehicle.surfaces=[\"ice\", \"mud\", \"wet\"]"),
            "surfaces: found \"mud\", expected one of \"dry\", \"wet\", \"snow\", \"ice\"");
  EXPECT_EQ(told("vehicle.surfaces=\"ice\""),
            "surfaces: found \"ice\", expected a list, each one of \"dry\", \"wet\", \"snow\", \"ice\"");
  EXPECT_EQ(told("vehicle.surfaces=[\"ice\"]"), "surfaces: has 1 values, expected 3, one for each of vehicle.surface_time_s");
}

TEST(ScenarioReader, RefusesUnknownKeysWithASuggestion) {
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = 50\nnois_percent = 5"),
            "s.toml:7:1: unknown key 'nois_percent' in [sensor.wheel_speed]; did you mean 'noise_percent'?");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate = 50"),
            "s.toml:6:1: unknown key 'rate' in [sensor.wheel_speed]; expected one of rate_hz, noise_percent, noise_radps, "
            "scale, bias_radps, quantum_radps, delay_s");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_h = 50"),
            "s.toml:6:1: unknown key 'rate_h' in [sensor.wheel_speed]; did you mean 'rate_hz'?");
  EXPECT_EQ(refused_with("[run]", "[runn]"), "s.toml:2:2: unknown key 'runn'; did you mean 'run'?");
  EXPECT_EQ(refused_with("[sensor.wheel_speed]", "[sensor.whel_speed]"),
            "s.toml:5:9: unknown key 'whel_speed' in [sensor]; did you mean 'wheel_speed'?");
  EXPECT_EQ(refused_with("friction = 0 }", "frction = 0 }"),
            "s.toml:14:61: unknown key 'frction' in [tuning.matched.initial_mean]; did you mean 'friction'?");
  EXPECT_EQ(refused_with("type = \"unimog\"", "tpye = \"unimog\""),
            "s.toml:4:1: unknown key 'tpye' in [vehicle]; did you mean 'type'?");
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\nmas_kg = 1"),
            "s.toml:5:1: unknown key 'mas_kg' in [vehicle]; did you mean 'mass_kg'?");
  EXPECT_EQ(refused_with("[estimator.model]", "bound = 1\n[estimator.model]"),
            "s.toml:9:1: unknown key 'bound' in [estimator]; did you mean 'bounds'?");
}

TEST(ScenarioReader, RefusesAModelWhoseInputsNobodyOffers) {
  const std::string lateral = replaced(replaced(kMinimal, "type = \"longitudinal_friction\"", "type = \"lateral_bicycle\""),
                                       kMinimal.substr(kMinimal.find("process_variance")), R"(start = "measured"
process_variance = { lateral_speed_mps = 1, yaw_rate_radps = 1, heading_rad = 1, x_m = 1, y_m = 1, front_stiffness_npr = 1, rear_stiffness_npr = 1 }
initial_variance = { lateral_speed_mps = 1, yaw_rate_radps = 1, heading_rad = 1, x_m = 1, y_m = 1, front_stiffness_npr = 1, rear_stiffness_npr = 1 }
)");
  EXPECT_EQ(refused(lateral),
            "s.toml:3:1: vehicle: no input 'steering_angle_rad', which the model 'lateral_bicycle' of [estimator.model] needs");
  const std::string bicycle = replaced(lateral, "type = \"unimog\"", "type = \"bicycle\"");
  EXPECT_EQ(refused(bicycle), "(not refused)") << "the wheel speed is a sensor's";
  EXPECT_EQ(refused(replaced(bicycle, "[sensor.wheel_speed]", "[sensor.yaw_rate]")),
            "s.toml:3:1: vehicle: no input 'wheel_speed_radps', which the model 'lateral_bicycle' of [estimator.model] needs");
}

TEST(ScenarioReader, RefusesWrongTypes) {
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = \"fast\""),
            "s.toml:6:11: sensor.wheel_speed.rate_hz: found \"fast\", expected a number from 0.001 to 10000");
  EXPECT_EQ(refused_with("[run]", "[run]\nseed = 1.5"),
            "s.toml:3:8: run.seed: found 1.5, expected a whole number from 0 to 9007199254740992");
  EXPECT_EQ(refused_with("[run]", "[run]\nclock = true"),
            "s.toml:3:9: run.clock: found true, expected one of \"lockstep\", \"realtime\", \"free\"");
  EXPECT_EQ(refused_with("[run]", "run = 5"), "s.toml:2:7: run: found 5, expected a table");
  EXPECT_EQ(refused_with("[run]", "[run]\nwait_for = \"ekf\""),
            "s.toml:3:12: run.wait_for: found \"ekf\", expected a list, each a name of 1 to 32 characters A-Z a-z 0-9 _ -");
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\ngear_ratio = 3"),
            "s.toml:5:14: vehicle.gear_ratio: found 3, expected a list of numbers");
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\ngear_ratio = []"),
            "s.toml:5:14: vehicle.gear_ratio: found a list, expected a list of at least one number");
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\ngear_ratio = [3, [1]]"),
            "s.toml:5:18: vehicle.gear_ratio: found a list, expected a number greater than 0");
  EXPECT_EQ(refused_with("friction\"\n", "friction\"\ndrag = 1\n"),
            "s.toml:11:8: estimator.model.drag: found 1, expected true or false");
  EXPECT_EQ(refused_with("name = \"minimal\"", "name = 1979-05-27"),
            "s.toml:1:8: name: found a date or time, expected a name of 1 to 32 characters A-Z a-z 0-9 _ -");
  EXPECT_EQ(refused_with("initial_mean = { wheel_speed_radps = 0.5, speed_mps = 0.26, friction = 0 }", "initial_mean = 3"),
            "s.toml:14:16: tuning.matched.initial_mean: found 3, expected a table of numbers");
  EXPECT_EQ(refused("tuning = 3\n" + kMinimal.substr(0, kMinimal.find("[tuning"))),
            "s.toml:1:10: tuning: found 3, expected a table");
}

TEST(ScenarioReader, RefusesValuesOutOfRange) {
  const std::string rate = "sensor.wheel_speed.rate_hz: found ";
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = -5"), "s.toml:6:11: " + rate + "-5, expected a number from 0.001 to 10000");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = 0.0"), "s.toml:6:11: " + rate + "0, expected a number from 0.001 to 10000");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = 1e-6"),  // a period of twelve days
            "s.toml:6:11: " + rate + "1e-06, expected a number from 0.001 to 10000");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = nan"),
            "s.toml:6:11: " + rate + "nan, expected a finite number from 0.001 to 10000");
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\nmass_kg = inf"),
            "s.toml:5:11: vehicle.mass_kg: found inf, expected a finite number greater than 0");
  EXPECT_EQ(refused_with("friction = 0 }", "friction = -inf }"),
            "s.toml:14:72: tuning.matched.initial_mean.friction: found -inf, expected a finite number");
  EXPECT_EQ(refused_with("rate_hz = 50", "rate_hz = 50\nnoise_radps = -0.1"),
            "s.toml:7:15: sensor.wheel_speed.noise_radps: found -0.1, expected a number from 0 to 1000000000");
  EXPECT_EQ(refused_with("[run]", "[run]\nduration_s = 0"),
            "s.toml:3:14: run.duration_s: found 0, expected a number greater than 0 and at most 1000000");
  EXPECT_EQ(refused_with("[run]", "[run]\nseed = -1"),
            "s.toml:3:8: run.seed: found -1, expected a whole number from 0 to 9007199254740992");
  EXPECT_EQ(refused_with("[run]", "[run]\nwait_for = [\"a b\"]"),
            "s.toml:3:13: run.wait_for: found \"a b\", expected a name of 1 to 32 characters A-Z a-z 0-9 _ -");
  EXPECT_EQ(refused_with("[run]", "[run]\nwait_for = [\"ekf\", \"ekf\"]"), "s.toml:3:20: run.wait_for: \"ekf\" appears twice");
  EXPECT_EQ(refused_with("\"unimog\"", "\"tractor\""), "s.toml:4:8: vehicle.type: found \"tractor\", expected " + kVehicles);
  EXPECT_EQ(refused_with("tuning = \"matched\"", "tuning = \"matchd\""),
            "s.toml:8:10: estimator.tuning: found \"matchd\", expected \"matched\"");
  EXPECT_EQ(refused_with("[tuning.matched]", "[tuning.matched]\nmhe_solver = \"rtj\""),
            "s.toml:13:14: tuning.matched.mhe_solver: found \"rtj\", expected one of \"ipopt\", \"rti\"");
  EXPECT_EQ(refused_with("[tuning.matched]", "[tuning.matched]\nmhe_window = 0"),
            "s.toml:13:14: tuning.matched.mhe_window: found 0, expected a whole number from 1 to 1000");
  for (const char* particles : {"0", "1000001"})
    EXPECT_EQ(refused_with("[tuning.matched]", std::string("[tuning.matched]\npf_particles = ") + particles),
              std::string("s.toml:13:16: tuning.matched.pf_particles: found ") + particles +
                  ", expected a whole number from 1 to 1000000");
  for (const char* fraction : {"0", "1.5"})
    EXPECT_EQ(refused_with("[tuning.matched]", std::string("[tuning.matched]\npf_resample_below = ") + fraction),
              std::string("s.toml:13:21: tuning.matched.pf_resample_below: found ") + fraction +
                  ", expected a number greater than 0 and at most 1");
}

TEST(ScenarioReader, RefusesWhatIsMissing) {
  EXPECT_EQ(refused_with("rate_hz = 50", ""), "s.toml:5:1: missing key 'rate_hz' in [sensor.wheel_speed]");
  EXPECT_EQ(refused_with("type = \"unimog\"", ""), "s.toml:3:1: missing key 'type' in [vehicle], expected " + kVehicles);
  EXPECT_EQ(refused_with("name = \"minimal\"", ""), "s.toml: missing key 'name'");
  EXPECT_EQ(refused_with("[vehicle]\ntype = \"unimog\"", ""), "s.toml: expected either [vehicle] or [recorded], found neither");
  EXPECT_EQ(refused_with("[run]", "[recorded]"), "s.toml: expected either [vehicle] or [recorded], found both");
  EXPECT_EQ(
      refused_with("[sensor.wheel_speed]\nrate_hz = 50", ""),
      "s.toml: sensor: no sensor; expected one of wheel_speed, accelerometer, yaw_rate, lateral_accelerometer, motor_current, "
      "forward_speed, east_position, north_position, imu, gnss, lidar");
  EXPECT_EQ(refused(kMinimal.substr(0, kMinimal.find("[tuning"))), "s.toml: tuning: expected at least one table [tuning.NAME]");
  EXPECT_EQ(refused_with(", friction = 5e-3", ""), "s.toml:13:20: missing key 'friction' in [tuning.matched.process_variance]");
  EXPECT_EQ(refused_with("process_variance", "#"),
            "s.toml:12:1: missing key 'process_variance' in [tuning.matched], expected a "
            "number for each of wheel_speed_radps, speed_mps, friction");
  EXPECT_EQ(
      refused_with("[tuning.matched]", "[tuning.matched]\nmeasurement_noise = \"given\""),
      "s.toml:12:1: missing key 'measurement_variance' in [tuning.matched], expected a number for each of wheel_speed_radps");
  EXPECT_EQ(refused_with("[tuning.matched]", "[tuning.matched]\nmhe_form = \"single_shooting\""),
            "s.toml:12:1: missing key 'arrival_weight' in [tuning.matched], expected a number for each of wheel_speed_radps, "
            "speed_mps, friction");
}

TEST(ScenarioReader, RefusesWhatDoesNotFitTogether) {
  EXPECT_EQ(refused_with("type = \"unimog\"", "type = \"unimog\"\nengine_torque_nm = [1, 2]"),
            "s.toml: vehicle.engine_torque_nm: has 2 values, expected 8, one for each of vehicle.engine_speed_rpm");
  EXPECT_EQ(refused(kMinimal + "[estimator.bounds]\nlower = { friction = 1 }\nupper = { friction = 1 }\n"),
            "s.toml:18:9: estimator.bounds.upper: of 'friction' is not greater than its lower bound");
  EXPECT_EQ(refused(kRecorded + "[plant]\n"), "s.toml:29:1: plant: only a simulated [vehicle] has a plant, not [recorded]");
  const auto recorded_with = [](const std::string& from, const std::string& to) {
    return refused(replaced(kRecorded, from, to));
  };
  EXPECT_EQ(recorded_with("\"wheel_speed_radps\"", "\"wheel_sped_radps\""),
            "s.toml:6:12: recorded.sensor.quantity: unknown quantity 'wheel_sped_radps'; did you mean 'wheel_speed_radps'?");
  EXPECT_EQ(recorded_with("\"friction\"", "\"speed_mps\""),
            "s.toml:19:1: recorded.path_speed: 'speed_mps' is also in [[recorded.truth]]");
  EXPECT_EQ(recorded_with("[sensor.wheel_speed]", "[sensor.accelerometer]\nrate_hz = 5\n[sensor.wheel_speed]"),
            "s.toml:7:1: recorded.sensor: no column for 'a_x_mps2' of [sensor.accelerometer]");
  EXPECT_EQ(recorded_with("[[recorded.truth]]\nquantity = \"friction\"", "[[recorded.input]]\nquantity = \"drive_torque_nm\""),
            "s.toml:16:12: recorded.input.quantity: 'drive_torque_nm' is recorded twice");
  EXPECT_EQ(
      recorded_with("[[recorded.input]]\nquantity = \"drive_torque_nm\"", "[[recorded.truth]]\nquantity = \"slip\""),
      "s.toml:4:1: recorded: no input 'drive_torque_nm', which the model 'longitudinal_friction' of [estimator.model] needs");
  EXPECT_EQ(recorded_with("quantity = \"drive_torque_nm\"", "quantity = \"wheel_speed_radps\""),
            "s.toml:10:1: recorded.input: 'wheel_speed_radps' is also in [[recorded.sensor]]");
  EXPECT_EQ(recorded_with("\"motor.csv\"", "\"../motor.csv\""),
            "s.toml:7:8: recorded.sensor.file: found \"../motor.csv\", expected a file inside the data folder");
  EXPECT_EQ(recorded_with("scale = 0.1", "scale = 0"),
            "s.toml:9:9: recorded.sensor.scale: found 0, expected a number other than 0");
  EXPECT_EQ(recorded_with("column = \"amp\"", "colum = \"amp\""),
            "s.toml:13:1: unknown key 'colum' in [[recorded.input]]; did you mean 'column'?");
  EXPECT_EQ(recorded_with("column = \"amp\"", ""), "s.toml:10:1: missing key 'column' in [[recorded.input]]");
}

TEST(ScenarioReader, RefusesSensorErrorsThatMakeNoSense) {
  const auto sensor_with = [](const std::string& line) { return refused_with("rate_hz = 50", "rate_hz = 50\n" + line); };
  EXPECT_EQ(sensor_with("scale = 0"),
            "s.toml:7:9: sensor.wheel_speed.scale: found 0, expected a number greater than 0 and at most 1000");
  EXPECT_EQ(sensor_with("quantum_radps = -1"),
            "s.toml:7:17: sensor.wheel_speed.quantum_radps: found -1, expected a number from 0 to 1000000000");
  EXPECT_EQ(sensor_with("delay_s = 11"), "s.toml:7:11: sensor.wheel_speed.delay_s: found 11, expected a number from 0 to 10");
  EXPECT_EQ(sensor_with("bias_radps = inf"),
            "s.toml:7:14: sensor.wheel_speed.bias_radps: found inf, expected a finite number from -1000000000 to 1000000000");
  EXPECT_EQ(sensor_with("bias_mps2 = 1"),
            "s.toml:7:1: unknown key 'bias_mps2' in [sensor.wheel_speed]; expected one of rate_hz, noise_percent, "
            "noise_radps, scale, bias_radps, quantum_radps, delay_s");
  // A recorded drive's errors are in its data.
  const auto recorded_with = [](const std::string& line) {
    return refused(replaced(kRecorded, "rate_hz = 20", "rate_hz = 20\n" + line));
  };
  const std::string reason = ": only a simulated sensor can have one; a recorded drive has the errors of its own sensors";
  EXPECT_EQ(recorded_with("scale = 1.1"), "s.toml:4:9: sensor.wheel_speed.scale" + reason);
  EXPECT_EQ(recorded_with("bias_radps = 0.1"), "s.toml:4:14: sensor.wheel_speed.bias_radps" + reason);
  EXPECT_EQ(recorded_with("quantum_radps = 0.1"), "s.toml:4:17: sensor.wheel_speed.quantum_radps" + reason);
  EXPECT_EQ(recorded_with("delay_s = 0.1"), "s.toml:4:11: sensor.wheel_speed.delay_s" + reason);
  load_scenario_text(replaced(kRecorded, "rate_hz = 20", "rate_hz = 20\nbias_radps = 0\nscale = 1"),
                     "s.toml");  // none: accepted
}

TEST(ScenarioReader, RefusesMountedSensorsThatCannotBe) {
  const auto with = [](const std::string& from, const std::string& to) { return refused(replaced(kStrapdown, from, to)); };
  EXPECT_EQ(refused(kStrapdown), "(not refused)");
  EXPECT_EQ(with("latitude_deg = 50", "latitude_deg = 95"),
            "s.toml:3:16: world.latitude_deg: found 95, expected a number from -90 to 90");
  EXPECT_EQ(with("latitude_deg", "lattitude_deg"),
            "s.toml:3:1: unknown key 'lattitude_deg' in [world]; did you mean 'latitude_deg'?");
  EXPECT_EQ(with("position_m = [0.1, 0.2, 0.3]", "position_m = [0.1, 0.2]"),
            "s.toml:11:14: sensor.imu.position_m: found a list, expected a list of three numbers");
  EXPECT_EQ(with("position_m = [0.1, 0.2, 0.3]", "position_m = [0.1, 0.2, 1000]"),
            "s.toml:11:25: sensor.imu.position_m: found 1000, expected a number from -100 to 100");
  EXPECT_EQ(with("position_m = [0.1, 0.2, 0.3]", "noise_mps = 0.1"),
            "s.toml:11:1: unknown key 'noise_mps' in [sensor.imu]; did you mean 'noise_mps2'?");
  EXPECT_EQ(with("rate_hz = 5\n", ""), "s.toml:12:1: missing key 'rate_hz' in [sensor.gnss]");
  EXPECT_EQ(with("[1, 2, 3, 4]", "[1, 2, 3]"),
            "s.toml:14:13: sensor.gnss.outages_s: found 3 times, expected pairs: from, to, from, to, ...");
  EXPECT_EQ(with("[1, 2, 3, 4]", "[1, 2, 2, 4]"),
            "s.toml:14:13: sensor.gnss.outages_s: found 2 after 2, expected increasing times");
  EXPECT_EQ(with("[0.1, 0.1, 0.3]", "[0.1, 0.1, 0]"),
            "s.toml:15:22: sensor.gnss.noise_m: found 0, expected a number greater than 0 and at most 10000");
  EXPECT_EQ(with("[sensor.gnss]", "[sensor.gnns]"), "s.toml:12:9: unknown key 'gnns' in [sensor]; did you mean 'gnss'?");
  EXPECT_EQ(
      with("type = \"road_car\"\nspeed_time_s = [0, 2]\nspeed_mps = [0, 5]\ncurvature_distance_m = []", "type = \"unimog\""),
      "s.toml:6:1: sensor: the vehicle 'unimog' has no motion in three dimensions, which [sensor.imu] measures");
  EXPECT_EQ(with("speed_mps = [0, 5]", "speed_mps = [5]"),
            "s.toml: vehicle.speed_mps: has 1 values, expected 2, one for each of vehicle.speed_time_s");
  EXPECT_EQ(with("speed_mps = [0, 5]", "speed_mps = [0, -5]"),
            "s.toml:7:17: vehicle.speed_mps: found -5, expected a number from 0 to 200");
  EXPECT_EQ(with("[sensor.imu]\nrate_hz = 200\nposition_m = [0.1, 0.2, 0.3]\n", ""),
            "s.toml:17:8: estimator.model.type: the model 'strapdown' needs an IMU: there is no [sensor.imu]");
}

TEST(ScenarioReader, RefusesDisturbancesThatCannotBe) {
  const auto with = [](const std::string& vehicle, const std::string& plant) {
    return refused("name = \"x\"\n[vehicle]\ntype = \"" + vehicle + "\"\n[plant]\n" + plant + "\n");
  };
  EXPECT_EQ(with("point_mass", "process_noise = { east = 1.0 }"),
            "s.toml:5:19: unknown key 'east' in [plant.process_noise]; did you mean 'east_m'?");
  EXPECT_EQ(with("point_mass", "process_noise_rate_hz = 10.0\nprocess_noise = { east_m = -1.0 }"),
            "s.toml:6:28: plant.process_noise.east_m: found -1, expected a number of at least 0");
  EXPECT_EQ(with("point_mass", "process_noise = { east_m = 1.0 }"),
            "s.toml:4:1: plant.process_noise_rate_hz: process_noise and a rate above 0 belong together");
  EXPECT_EQ(with("point_mass", "process_noise_rate_hz = 10.0"),
            "s.toml:5:25: plant.process_noise_rate_hz: process_noise and a rate above 0 belong together");
  EXPECT_EQ(with("unimog", "start_deviation = { speed_mps = 1.0 }"),
            "s.toml:5:19: plant.start_deviation: the vehicle 'unimog' has no states that can be disturbed");
  EXPECT_EQ(
      refused(replaced(kStrapdown, "type = \"road_car\"\nspeed_time_s = [0, 2]\nspeed_mps = [0, 5]\ncurvature_distance_m = []",
                       "type = \"point_mass\"\n[plant]\nstart_deviation = { speed_mps = 1.0 }")),
      "s.toml:7:19: plant.start_deviation: an IMU measures exact derivatives of the motion: [sensor.imu] goes with an "
      "undisturbed vehicle only");
}

TEST(ScenarioReader, RefusesStrapdownTuningsThatMakeNoSense) {
  const auto with = [](const std::string& line) { return refused(replaced(kStrapdown, "start = \"fixes\"", line)); };
  EXPECT_EQ(with("start = \"given\""),
            "s.toml:22:9: tuning.matched.start: \"given\" needs initial_position_m, initial_velocity_mps, initial_rpy_rad");
  EXPECT_EQ(with("start = \"fix\""), "s.toml:22:9: tuning.matched.start: found \"fix\", expected one of \"given\", \"fixes\"");
  EXPECT_EQ(with("start = \"fixes\"\ngate = 1"),
            "s.toml:23:8: tuning.matched.gate: found 1, expected a number from 0 to 0.999999999999");
  EXPECT_EQ(with("start = \"fixes\"\nbias = false"),
            "s.toml:23:1: unknown key 'bias' in [tuning.matched]; did you mean 'biases'?");
  EXPECT_EQ(with("start = \"fixes\"\nprocess_variance = { east_m = 1 }"),
            "s.toml:23:1: unknown key 'process_variance' in [tuning.matched]");
  EXPECT_EQ(refused(replaced(kStrapdown, "[tuning", "[estimator.bounds]\nlower = {}\n[tuning")),
            "s.toml:21:1: estimator.bounds: a strapdown model has none");
}

TEST(ScenarioReader, RefusesRecordedReadingsThatCannotBe) {
  const auto with = [](const std::string& from, const std::string& to) {
    return refused(replaced(kRecordedStrapdown, from, to));
  };
  EXPECT_EQ(refused(kRecordedStrapdown), "(not refused)");
  EXPECT_EQ(with("\"gnss\"", "\"lidar\""),
            "s.toml:12:12: recorded.group.quantity: found \"lidar\", expected one of \"imu\", \"gnss\"");
  EXPECT_EQ(with("\"gnss\"", "\"imu\""), "s.toml:14:11: recorded.group.columns: found 3, expected 6 for 'imu'");
  EXPECT_EQ(with("[\"x\", \"y\", \"z\"]", "[\"x\", \"y\"]"),
            "s.toml:14:11: recorded.group.columns: found 2, expected 3 for 'gnss'");
  EXPECT_EQ(with("frame = \"enu\"", "scale = [1, 1]"), "s.toml:15:9: recorded.group.scale: found 2, expected 3 or none");
  EXPECT_EQ(with("frame = \"enu\"", "frame = \"ned\""),
            "s.toml:15:9: recorded.group.frame: found \"ned\", expected one of \"geodetic\", \"enu\"");
  EXPECT_EQ(with("file = \"imu.csv\"", "file = \"imu.csv\"\nframe = \"enu\""),
            "s.toml:10:9: recorded.group.frame: only of 'gnss'");
  EXPECT_EQ(with("lag_s = 0.065", "lag_s = -1"), "s.toml:16:9: recorded.group.lag_s: found -1, expected a number from 0 to 10");
  EXPECT_EQ(with("lag_s = 0.065", "lag = 1"), "s.toml:16:1: unknown key 'lag' in [[recorded.group]]; did you mean 'lag_s'?");
  EXPECT_EQ(with("[recorded]", "[sensor.lidar]\nrate_hz = 1\n[recorded]"),
            "s.toml:9:1: recorded.group: no columns for [sensor.lidar]");
  EXPECT_EQ(with("lag_s = 0.065",
                 "[[recorded.group]]\nquantity = \"imu\"\nfile = \"a\"\ncolumns = [\"a\", \"b\", \"c\", \"d\", \"e\", \"f\"]"),
            "s.toml:17:12: recorded.group.quantity: 'imu' is recorded twice");
  EXPECT_EQ(with("axes = \"frd\"", "columns = [\"w\", \"x\", \"y\"]"),
            "s.toml:24:11: recorded.attitude.columns: found 3, expected 4: the quaternion's w, x, y, z");
  EXPECT_EQ(with("axes = \"frd\"", "axes = \"ned\""),
            "s.toml:24:8: recorded.attitude.axes: found \"ned\", expected one of \"flu\", \"frd\"");
  EXPECT_EQ(with("\"east_m\"", "\"yaw_rad\""), "s.toml:22:1: recorded.attitude: 'yaw_rad' is also in [[recorded.truth]]");
  EXPECT_EQ(with("\"east_m\"", "\"easting_m\""),
            "s.toml:18:12: recorded.truth.quantity: unknown quantity 'easting_m'; did you mean 'east_m'?");
  const std::string reason = ": only a simulated sensor can have one; a recorded drive has the errors of its own sensors";
  EXPECT_EQ(with("rate_hz = 100", "rate_hz = 100\nbias_radps = [0, 0, 1]"), "s.toml:4:14: sensor.imu.bias_radps" + reason);
  EXPECT_EQ(with("rate_hz = 100", "rate_hz = 100\ngyro_scale = [1, 1, 1.01]"), "s.toml:4:14: sensor.imu.gyro_scale" + reason);
  EXPECT_EQ(with("rate_hz = 100", "rate_hz = 100\nrange_mps2 = 80"), "s.toml:4:14: sensor.imu.range_mps2" + reason);
  EXPECT_EQ(with("rate_hz = 10\n", "rate_hz = 10\ndelay_s = 0.1\n"),
            "s.toml:6:11: sensor.gnss.delay_s: only a simulated sensor can have one; how late recorded fixes are says lag_s of "
            "[[recorded.group]]");
}

TEST(ScenarioReader, RefusesSyntaxErrorsAndMissingFiles) {
  const std::string line = refused("name = \"a\"\n[run\nseed = 1\n");
  EXPECT_EQ(line.substr(0, 26), "s.toml:2:5: syntax error: ") << line;
  EXPECT_EQ(refused("[[[a]]]\n").substr(0, 24), "s.toml:1:3: syntax error");
  EXPECT_EQ(refused("a = 1\na = 2\n").substr(0, 9), "s.toml:2:");
  EXPECT_EQ(refused(std::string("a = \"\xff\"")).substr(0, 9), "s.toml:1:");
  TemporaryFolder folder;
  EXPECT_EQ(refusal_of([&] { load_scenario_file(folder.path("no.toml")); }),
            folder.path("no.toml") + ": cannot read: No such file or directory");
}

TEST(ScenarioReader, SurvivesDamagedText) {
  std::mt19937 random(7);
  for (int i = 0; i < 3000; ++i) {
    const std::string* const texts[]{&kMinimal, &kRecorded, &kStrapdown, &kRecordedStrapdown};
    std::string text = *texts[i % 4];
    for (int k = 0; k < 3; ++k) {
      const std::size_t at = random() % text.size();
      if (random() % 3 == 0)
        text.erase(at, random() % 20);
      else if (random() % 2 == 0)
        text[at] = static_cast<char>(random() % 256);
      else
        text.insert(at, text.substr(random() % text.size(), random() % 30));
      if (text.empty()) text.push_back('a');
    }
    try {
      expect_round_trip(load_scenario_text(text, "s.toml"));
    } catch (const Refusal& refusal) {
      const std::string line = refusal.what();
      EXPECT_EQ(line.find("s.toml:"), 0u) << line;
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    }
  }
}

// --- Layers -----------------------------------------------------------------------------------------------------------

class ScenarioLayers : public testing::Test {
 protected:
  Scenario with(const std::vector<std::string>& overrides) { return load_scenario_file(file, overrides).scenario; }
  std::string refused_with(const std::string& text) {
    return refusal_of([&] { load_scenario_file(file, {text}); });
  }

  TemporaryFolder folder;
  std::string file = folder.write("s.toml", kMinimal);
};

TEST_F(ScenarioLayers, OverridesReplaceAndAddKeys) {
  const Scenario s = with({"run.seed=7", "run.clock=free", "run.clock=realtime", "sensor.accelerometer.rate_hz = 20",
                           "description=\"a b\"", "tuning.matched.process_variance.friction=1e-3", "run.wait_for=['x']"});
  EXPECT_EQ(s.run.seed, 7u);
  EXPECT_EQ(s.run.clock, "realtime");
  EXPECT_EQ(s.sensors.size(), 2u);
  EXPECT_EQ(s.description, "a b");
  EXPECT_EQ(s.estimator.tunings.at("matched").process_variance.at("friction"), 1e-3);
  EXPECT_EQ(s.estimator.tunings.at("matched").process_variance.at("speed_mps"), 1e-8);
  EXPECT_EQ(s.run.wait_for, std::vector<std::string>{"x"});
}

TEST_F(ScenarioLayers, OverridesAreRefusedByTheirText) {
  EXPECT_EQ(refused_with("run.sede=7"), "override 'run.sede=7': unknown key 'sede' in [run]; did you mean 'seed'?");
  EXPECT_EQ(refused_with("run.seed=x"),
            "override 'run.seed=x': run.seed: found \"x\", expected a whole number from 0 to 9007199254740992");
  EXPECT_EQ(refused_with("run.seed"), "override 'run.seed': expected table.key=value");
  EXPECT_EQ(refused_with("#=3"), "override '#=3': expected table.key=value");
  EXPECT_EQ(refused_with("a=1\nb=2"), "override 'a=1?b=2': expected table.key=value");
  EXPECT_EQ(refused_with("run.seed=").substr(0, 36), "override 'run.seed=': syntax error: ") << refused_with("run.seed=");
}

TEST_F(ScenarioLayers, ABaseIsReadFirst) {
  const std::string over =
      folder.write("over.toml", "base = \"s.toml\"\nname = \"over\"\n[sensor.wheel_speed]\nnoise_percent = 10\n");
  const LoadedScenario loaded = load_scenario_file(over);
  EXPECT_EQ(loaded.scenario.name, "over");
  EXPECT_EQ(loaded.scenario.sensors.at(0).rate_hz, 50.0);
  EXPECT_EQ(loaded.scenario.sensors.at(0).noise.relative, 0.1);
  expect_round_trip(loaded);
}

TEST_F(ScenarioLayers, ErrorsNameTheFileThatHoldsTheValue) {
  const std::string bad = folder.write("bad.toml", replaced(kMinimal, "rate_hz = 50", "rate_hz = -1"));
  const std::string over = folder.write("over.toml", "base = \"bad.toml\"\n");
  const std::string range = ", expected a number from 0.001 to 10000";
  EXPECT_EQ(refusal_of([&] { load_scenario_file(over); }), bad + ":6:11: sensor.wheel_speed.rate_hz: found -1" + range);
  const std::string worse = folder.write("worse.toml", "base = \"s.toml\"\n[sensor.wheel_speed]\nrate_hz = -2\n");
  EXPECT_EQ(refusal_of([&] { load_scenario_file(worse); }), worse + ":3:11: sensor.wheel_speed.rate_hz: found -2" + range);
  const std::string typo = folder.write("typo.toml", "base = \"s.toml\"\n[sensor.wheel_speed]\nratehz = 2\n");
  EXPECT_EQ(refusal_of([&] { load_scenario_file(typo); }),
            typo + ":3:1: unknown key 'ratehz' in [sensor.wheel_speed]; did you mean 'rate_hz'?");
  const std::string none = folder.write("none.toml", "base = \"gone.toml\"\n");
  EXPECT_EQ(refusal_of([&] { load_scenario_file(none); }),
            none + ":1:8: base: cannot read '" + folder.path("gone.toml") + "': No such file or directory");
  const std::string loop = folder.write("loop.toml", "base = \"loop.toml\"\n");
  EXPECT_EQ(refusal_of([&] { load_scenario_file(loop); }), loop + ":1:8: base: more than 8 bases, one upon the other");
  EXPECT_EQ(refused("base = \"s.toml\"\n" + kMinimal),
            "s.toml:1:8: base: a scenario that is not read from a file cannot have a base");
  EXPECT_EQ(refused_with("base=x.toml").substr(0, 43), "override 'base=x.toml': unknown key 'base';");
}

TEST_F(ScenarioLayers, AnEstimatorsConfigReplacesItsKeys) {
  const LoadedScenario loaded = load_scenario_file(file, {"run.seed=5"});
  const std::string config = folder.write("ekf.toml", "[estimator.model]\nmass_kg = 1800\n[tuning.matched]\nmhe_window = 8\n");
  const LoadedScenario changed = with_estimator_config(loaded, config);
  EXPECT_EQ(model_of(changed.scenario).wheel.quarter.mass_kg, 1800.0);
  EXPECT_EQ(unimog_of(changed.scenario).quarter.mass_kg, 2000.0);
  EXPECT_EQ(changed.scenario.estimator.tunings.at("matched").mhe_window, 8);
  EXPECT_EQ(changed.scenario.run.seed, 5u);
  expect_round_trip(changed);

  const std::string wide = folder.write("wide.toml", "[run]\nseed = 3\n");
  EXPECT_EQ(refusal_of([&] { with_estimator_config(loaded, wide); }),
            wide + ":1:2: unknown key 'run'; expected one of estimator, tuning");
  const std::string typo = folder.write("typo.toml", "[estimator]\ntuning = \"doc\"\n");
  EXPECT_EQ(refusal_of([&] { with_estimator_config(loaded, typo); }),
            typo + ":2:10: estimator.tuning: found \"doc\", expected \"matched\"");
}

TEST(ShippedScenarios, LoadAndRoundTrip) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios")) {
    if (entry.path().extension() != ".toml") continue;
    const LoadedScenario loaded = load_scenario_file(entry.path().string());
    EXPECT_EQ(loaded.scenario.name, entry.path().stem().string());
    EXPECT_FALSE(loaded.scenario.description.empty());
    expect_round_trip(loaded);
    ++count;
  }
  EXPECT_GE(count, 3);
}

// The comments of unimog.toml say where its numbers come from: they are the vehicle's defaults.
TEST(ShippedScenarios, UnimogSpellsOutTheDefaultVehicle) {
  const std::string folder = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/";
  const Scenario s = load_scenario_file(folder + "unimog.toml").scenario;
  Bits spelt, defaults;
  unimog_of(s).visit_parameters(unimog_of(s), spelt);
  const Unimog unimog;
  Unimog::visit_parameters(unimog, defaults);
  EXPECT_EQ(spelt.text, defaults.text);
  EXPECT_EQ(s.sensors.at(0).noise.relative, 0.05);
  EXPECT_EQ(load_scenario_file(folder + "unimog_10.toml").scenario.sensors.at(1).noise.relative, 0.1);
}

}  // namespace
}  // namespace slipstream
