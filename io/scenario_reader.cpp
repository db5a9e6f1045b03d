#include "io/scenario_reader.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "common/random.hpp"
#include "common/readings.hpp"
#include "common/refusal.hpp"
#include "io/bus.hpp"
#include "io/estimator_section.hpp"
#include "io/registry_names.hpp"
#include "io/suggest.hpp"
#include "io/text_file.hpp"
#include "io/toml_reader.hpp"
#include "io/toml_text.hpp"

namespace slipstream {
namespace {

constexpr Range kRate = between(1e-3, 1e4);  // Hz; so a period is from 100 us, rounded to whole microseconds, to 1000 s
constexpr Range kWallTime{0.0, 86400.0, true};
constexpr double kLongestRun_s = 1e6;
constexpr double kLongestDelay_s = 10.0;
constexpr std::int64_t kLargestSeed = std::int64_t{1} << 53;  // whole numbers that every TOML and JSON reader keeps exactly
constexpr int kDeepestBase = 8;

const TextForm kName{is_valid_name, "a name of 1 to 32 characters A-Z a-z 0-9 _ -"};
const TextForm kAnyText{[](const std::string&) { return true; }, "text"};
const TextForm kColumn{[](const std::string& s) { return !s.empty(); }, "the name of a column"};
const TextForm kDataFile{[](const std::string& s) {
                           const std::filesystem::path path(s);
                           return !s.empty() && path.is_relative() &&
                                  std::none_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
                         },
                         "a file inside the data folder"};

// --- Sections ---------------------------------------------------------------------------------------------------------

void read_run(TomlTable& t, RunConfig& run, bool recorded) {
  if (recorded) run.duration_s = 0.0;
  t.integer("seed", run.seed, 0, kLargestSeed);
  t.number("duration_s", run.duration_s, Range{0.0, kLongestRun_s, !recorded});
  t.choice("clock", run.clock, {"lockstep", "realtime", "free"});
  t.number("realtime_factor", run.realtime_factor, between(1e-3, 1e3));
  t.texts("wait_for", run.wait_for, kName);
  t.number("start_timeout_s", run.start_timeout_s, kWallTime);
  t.number("late_timeout_s", run.late_timeout_s, kWallTime);
  t.number("deadline_s", run.deadline_s, between(0.0, 3600.0));
}

// The states of the vehicle that can be disturbed.
std::vector<std::string> state_names(const AnyVehicle& vehicle) {
  return std::visit(
      []<typename V>(const V&) {
        std::vector<std::string> names;
        if constexpr (requires { V::kStateNames; })
          for (const std::string_view name : V::kStateNames)
            if (!name.empty()) names.emplace_back(name);
        return names;
      },
      vehicle);
}

void read_plant(TomlTable& t, PlantConfig& plant, bool has_imu) {
  t.number("input_rate_hz", plant.input_rate_hz, kRate);
  t.number("truth_rate_hz", plant.truth_rate_hz, kRate);
  t.number("relative_tolerance", plant.relative_tolerance, between(1e-14, 1e-2));
  t.number("absolute_tolerance", plant.absolute_tolerance, between(1e-16, 1e-2));
  t.number("process_noise_rate_hz", plant.process_noise_rate_hz, between(0.0, kRate.max));
  const std::vector<std::string> states = state_names(plant.vehicle);
  for (const char* key : {"process_noise", "start_deviation"})
    if (t.has(key) && states.empty())
      t.refuse(key, "the vehicle '" + std::visit([](const auto& v) { return std::string(v.kName); }, plant.vehicle) +
                        "' has no states that can be disturbed");
  t.numbers("process_noise", plant.process_noise, states, {}, non_negative());
  t.numbers("start_deviation", plant.start_deviation, states, {}, non_negative());
  if (plant.process_noise.empty() != (plant.process_noise_rate_hz == 0.0))
    t.refuse("process_noise_rate_hz", "process_noise and a rate above 0 belong together");
  if (has_imu && !(plant.process_noise.empty() && plant.start_deviation.empty()))
    t.refuse(plant.process_noise.empty() ? "start_deviation" : "process_noise",
             "an IMU measures exact derivatives of the motion: [sensor.imu] goes with an undisturbed vehicle only");
}

void read_vehicle(TomlTable& t, AnyVehicle& vehicle, const std::string& source) {
  std::string type;
  t.type(type, registered_names<AnyVehicle>());
  vehicle = make_registered<AnyVehicle>(type);
  std::visit([&](auto& v) { v.visit_parameters(v, t); }, vehicle);
  try {
    std::visit([](auto& v) { v.prepare(); }, vehicle);
  } catch (const Refusal& refusal) {
    throw Refusal(source + ": " + refusal.what());
  }
}

const std::string kOnlySimulated = "only a simulated sensor can have one; a recorded drive has the errors of its own sensors";

// Errors that the plant adds; a recorded drive has its own, so there they may only be spelt out as none.
void read_sensor_errors(TomlTable& t, const SensorType& type, SensorErrors& errors, bool recorded) {
  const std::string bias = type.key("bias"), quantum = type.key("quantum");
  t.number("scale", errors.scale, Range{0.0, 1e3, true});
  t.number(bias, errors.bias, between(-1e9, 1e9));
  t.number(quantum, errors.quantum, between(0.0, 1e9));
  t.number("delay_s", errors.delay_s, between(0.0, kLongestDelay_s));
  if (!recorded) return;
  if (errors.scale != 1.0) t.refuse("scale", kOnlySimulated);
  if (errors.bias != 0.0) t.refuse(bias, kOnlySimulated);
  if (errors.quantum != 0.0) t.refuse(quantum, kOnlySimulated);
  if (errors.delay_s != 0.0) t.refuse("delay_s", kOnlySimulated);
}

void read_sensors(TomlTable& t, std::vector<SensorConfig>& sensors, bool recorded) {
  t.only(sensor_names());
  for (const SensorType& type : kSensorTypes) {
    const std::string name(type.name);
    if (!t.has(name)) continue;
    SensorConfig sensor{name, std::string(type.quantity.name), 100.0, {}, {}};
    t.table(name, [&](TomlTable& s) {
      double noise_percent = 0.0;
      s.require("rate_hz");
      s.number("rate_hz", sensor.rate_hz, kRate);
      s.number("noise_percent", noise_percent, between(0.0, 1000.0));
      s.number(std::string(type.noise_key), sensor.noise.absolute, between(0.0, 1e9));
      sensor.noise.relative = noise_percent / 100.0;
      read_sensor_errors(s, type, sensor.errors, recorded);
    });
    sensors.push_back(sensor);
  }
}

void check_imu(TomlTable& t, const Imu& imu, bool recorded) {
  if (!recorded) return;
  if (!imu.bias_mps2.isZero(0.0)) t.refuse("bias_mps2", kOnlySimulated);
  if (!imu.bias_radps.isZero(0.0)) t.refuse("bias_radps", kOnlySimulated);
  if (!imu.accelerometer_scale.isOnes(0.0)) t.refuse("accelerometer_scale", kOnlySimulated);
  if (!imu.gyro_scale.isOnes(0.0)) t.refuse("gyro_scale", kOnlySimulated);
  if (imu.range_mps2 != 0.0) t.refuse("range_mps2", kOnlySimulated);
  if (imu.range_radps != 0.0) t.refuse("range_radps", kOnlySimulated);
}

void check_fixes(TomlTable& t, const FixSensor& sensor, bool recorded) {
  const std::vector<double>& out = sensor.outages_s;
  if (out.size() % 2 != 0)
    t.refuse("outages_s", "found " + std::to_string(out.size()) + " times, expected pairs: from, to, from, to, ...");
  for (std::size_t i = 1; i < out.size(); ++i)
    if (!(out[i] > out[i - 1]))
      t.refuse("outages_s", "found " + digits(out[i]) + " after " + digits(out[i - 1]) + ", expected increasing times");
  if (recorded && sensor.delay_s != 0.0)
    t.refuse("delay_s", "only a simulated sensor can have one; how late recorded fixes are says lag_s of [[recorded.group]]");
}

// The sensors whose readings have several numbers.
template <typename Sensor>
void read_group_sensor(TomlTable& t, std::string_view name, std::optional<Sensor>& sensor, bool recorded) {
  if (!t.has(std::string(name))) return;
  sensor.emplace();
  t.table(std::string(name), [&](TomlTable& s) {
    s.require("rate_hz");
    sensor->visit_parameters(*sensor, s);
    if constexpr (std::is_base_of_v<FixSensor, Sensor>) {
      check_fixes(s, *sensor, recorded);
    } else {
      check_imu(s, *sensor, recorded);
    }
  });
}

void read_groups(TomlTable& t, RecordedConfig& recorded, const Scenario& s) {
  t.tables("group", [&](TomlTable& c) {
    RecordedGroup group;
    std::vector<std::string> offered;
    if (s.imu) offered.emplace_back(kImu);
    if (s.gnss) offered.emplace_back(kGnss);
    if (s.lidar) offered.emplace_back(kLidar);
    c.only({"quantity", "file", "columns", "scale", "frame", "lag_s"});
    for (const char* required : {"quantity", "file", "columns"}) c.require(required);
    if (offered.empty()) c.refuse("quantity", "there is no [sensor.imu], [sensor.gnss] or [sensor.lidar] that it could be");
    group.quantity = offered.front();
    c.choice("quantity", group.quantity, offered);
    if (c.has("file")) c.text("file", group.file, kDataFile);
    if (c.has("columns")) c.texts("columns", group.columns, kColumn);
    c.list("scale", group.scale, any_number());
    c.choice("frame", group.frame, {"geodetic", "enu"});
    c.number("lag_s", group.lag_s, between(0.0, kLongestDelay_s));
    const std::size_t components = components_of(group.quantity).size();
    if (c.has("columns") && group.columns.size() != components)
      c.refuse("columns", "found " + std::to_string(group.columns.size()) + ", expected " + std::to_string(components) +
                              " for '" + group.quantity + "'");
    if (!group.scale.empty() && group.scale.size() != components)
      c.refuse("scale",
               "found " + std::to_string(group.scale.size()) + ", expected " + std::to_string(components) + " or none");
    if (group.frame != "geodetic" && group.quantity != kGnss) c.refuse("frame", "only of 'gnss'");
    for (const RecordedGroup& other : recorded.groups)
      if (other.quantity == group.quantity) c.refuse("quantity", "'" + group.quantity + "' is recorded twice");
    recorded.groups.push_back(group);
  });
  const auto wanted = [&](bool has, std::string_view quantity) {
    if (has && std::none_of(recorded.groups.begin(), recorded.groups.end(),
                            [&](const RecordedGroup& g) { return g.quantity == quantity; }))
      t.refuse("group", "no columns for [sensor." + std::string(quantity) + "]");
  };
  wanted(s.imu.has_value(), kImu);
  wanted(s.gnss.has_value(), kGnss);
  wanted(s.lidar.has_value(), kLidar);
}

void read_attitude(TomlTable& t, RecordedAttitude& attitude) {
  t.only({"file", "columns", "axes", "rpy_rad"});
  t.require("file");
  if (t.has("file")) t.text("file", attitude.file, kDataFile);
  t.texts("columns", attitude.columns, kColumn);
  if (attitude.columns.size() != 4)
    t.refuse("columns", "found " + std::to_string(attitude.columns.size()) + ", expected 4: the quaternion's w, x, y, z");
  t.choice("axes", attitude.axes, {"flu", "frd"});
  t.triple("rpy_rad", attitude.rpy_rad, between(-kPi, kPi));
}

// `admissible`: the quantities that may be recorded here, each at most once.
void read_columns(TomlTable& t, const std::string& key, std::vector<RecordedColumn>& columns,
                  const std::vector<std::string>& admissible) {
  t.tables(key, [&](TomlTable& c) {
    RecordedColumn column;
    c.only({"quantity", "file", "column", "mean_with", "scale", "offset", "lead_s"});
    for (const char* required : {"quantity", "file", "column"}) c.require(required);
    if (c.has("quantity")) {
      c.text("quantity", column.quantity, kAnyText);
      if (std::find(admissible.begin(), admissible.end(), column.quantity) == admissible.end())
        c.refuse("quantity", "unknown quantity '" + printable(column.quantity) + "'" + suggestion(column.quantity, admissible));
      for (const RecordedColumn& other : columns)
        if (other.quantity == column.quantity) c.refuse("quantity", "'" + column.quantity + "' is recorded twice");
    }
    if (c.has("file")) c.text("file", column.file, kDataFile);
    if (c.has("column")) c.text("column", column.column, kColumn);
    c.texts("mean_with", column.mean_with, kColumn);
    c.number("scale", column.scale, any_number());
    if (column.scale == 0.0) c.refuse("scale", "found 0, expected a number other than 0");
    c.number("offset", column.offset, any_number());
    c.number("lead_s", column.lead_s, between(0.0, kLongestDelay_s));
    columns.push_back(column);
  });
}

void read_path_speed(TomlTable& t, RecordedPathSpeed& path) {
  t.only({"file", "x_column", "y_column", "yaw_column", "window_s", "max_residual_m"});
  t.require("file");
  if (t.has("file")) t.text("file", path.file, kDataFile);
  t.text("x_column", path.x_column, kColumn);
  t.text("y_column", path.y_column, kColumn);
  t.text("yaw_column", path.yaw_column, kAnyText);
  t.number("window_s", path.window_s, Range{0.0, 10.0, true});
  t.number("max_residual_m", path.max_residual_m, Range{0.0, 1e3, true});
}

void read_recorded(TomlTable& t, RecordedConfig& recorded, const Scenario& scenario) {
  const std::vector<SensorConfig>& sensors = scenario.sensors;
  t.only({"time_column", "sensor", "group", "input", "truth", "attitude", "path_speed"});
  t.text("time_column", recorded.time_column, kColumn);
  std::vector<std::string> measured, inputs, known;
  for (const SensorConfig& sensor : sensors) measured.push_back(sensor.quantity);
  for_each_alternative<AnyProcess>([&](const auto& process) {
    for (const Quantity& q : std::remove_cvref_t<decltype(process)>::kInputNames) inputs.emplace_back(q.name);
  });
  for (const Quantity& q : known_quantities()) known.emplace_back(q.name);
  read_columns(t, "sensor", recorded.sensors, measured);
  read_columns(t, "input", recorded.inputs, inputs);
  read_columns(t, "truth", recorded.truth, known);
  read_groups(t, recorded, scenario);
  if (t.has("attitude")) t.table("attitude", [&](TomlTable& a) { read_attitude(a, recorded.attitude.emplace()); });
  if (t.has("path_speed")) {
    recorded.path_speed.emplace();
    t.table("path_speed", [&](TomlTable& p) { read_path_speed(p, *recorded.path_speed); });
  }
  const auto has = [](const std::vector<RecordedColumn>& columns, const std::string& quantity) {
    return std::any_of(columns.begin(), columns.end(), [&](const RecordedColumn& c) { return c.quantity == quantity; });
  };
  for (const SensorConfig& sensor : sensors)
    if (!has(recorded.sensors, sensor.quantity))
      t.refuse("sensor", "no column for '" + sensor.quantity + "' of [sensor." + sensor.type + "]");
  for (const RecordedColumn& input : recorded.inputs)
    if (has(recorded.sensors, input.quantity)) t.refuse("input", "'" + input.quantity + "' is also in [[recorded.sensor]]");
  if (recorded.attitude)
    for (const char* angle : {"roll_rad", "pitch_rad", "yaw_rad"})
      if (has(recorded.truth, angle)) t.refuse("attitude", std::string("'") + angle + "' is also in [[recorded.truth]]");
  if (recorded.path_speed && has(recorded.truth, "speed_mps"))
    t.refuse("path_speed", "'speed_mps' is also in [[recorded.truth]]");
}

// What one section asks of another.
void check_together(const TomlTable& root, const Scenario& s) {
  if (s.sensors.empty() && !s.imu && !s.gnss && !s.lidar) root.refuse("sensor", "no sensor" + suggestion("", sensor_names()));
  std::vector<std::string> offered;  // to the model as inputs: a sensor's reading may be one
  for (const SensorConfig& sensor : s.sensors) offered.push_back(sensor.quantity);
  if (s.recorded) {
    for (const RecordedColumn& c : s.recorded->inputs) offered.push_back(c.quantity);
  } else {
    std::visit(
        [&](const auto& vehicle) {
          const auto shown = names_of(vehicle.kTruth);
          for (const SensorConfig& sensor : s.sensors)
            if (std::find(shown.begin(), shown.end(), sensor.quantity) == shown.end())
              root.refuse("sensor", "the vehicle '" + std::string(vehicle.kName) + "' does not show '" + sensor.quantity +
                                        "', which [sensor." + sensor.type + "] measures");
          if constexpr (!MovingVehicle<std::remove_cvref_t<decltype(vehicle)>>) {
            const std::string_view mounted = s.imu ? kImu : s.gnss ? kGnss : s.lidar ? kLidar : "";
            if (!mounted.empty())
              root.refuse("sensor", "the vehicle '" + std::string(vehicle.kName) +
                                        "' has no motion in three dimensions, which [sensor." + std::string(mounted) +
                                        "] measures");
          }
          for (const Quantity& q : vehicle.kInputs) offered.emplace_back(q.name);
        },
        s.plant.vehicle);
  }
  if (s.estimator.strapdown) return;
  std::visit(
      [&](const auto& process) {
        for (const Quantity& q : process.kInputNames)
          if (std::find(offered.begin(), offered.end(), q.name) == offered.end())
            root.refuse(s.recorded ? "recorded" : "vehicle", "no input '" + std::string(q.name) + "', which the model '" +
                                                                 std::string(process.kName) + "' of [estimator.model] needs");
      },
      s.estimator.process);
}

LoadedScenario resolve(const TomlDocument& document, const std::string& source) {
  LoadedScenario loaded;
  Scenario& s = loaded.scenario;
  loaded.resolved_toml = document.read([&](TomlTable& root) {
    root.only({"name", "description", "run", "world", "plant", "vehicle", "recorded", "sensor", "estimator", "tuning"});
    const bool simulated = root.has("vehicle"), recorded = root.has("recorded");
    if (simulated == recorded)
      throw Refusal(source + ": expected either [vehicle] or [recorded], found " + (simulated ? "both" : "neither"));
    if (recorded && root.has("plant")) root.refuse("plant", "only a simulated [vehicle] has a plant, not [recorded]");

    if (!root.has("name")) throw Refusal(source + ": missing key 'name'");
    root.text("name", s.name, kName);
    root.text("description", s.description, kAnyText);
    root.table("run", [&](TomlTable& t) { read_run(t, s.run, recorded); });
    if (simulated) {
      root.table("vehicle", [&](TomlTable& t) { read_vehicle(t, s.plant.vehicle, source); });
      const std::vector<std::string> mounted = root.keys_of("sensor");
      const bool has_imu = std::find(mounted.begin(), mounted.end(), kImu) != mounted.end();
      root.table("plant", [&](TomlTable& t) { read_plant(t, s.plant, has_imu); });
    }
    if (root.has("world")) root.table("world", [&](TomlTable& t) { s.world.visit_parameters(s.world, t); });
    root.table("sensor", [&](TomlTable& t) {
      read_sensors(t, s.sensors, recorded);
      read_group_sensor(t, kImu, s.imu, recorded);
      read_group_sensor(t, kGnss, s.gnss, recorded);
      read_group_sensor(t, kLidar, s.lidar, recorded);
    });
    if (recorded) root.table("recorded", [&](TomlTable& t) { read_recorded(t, s.recorded.emplace(), s); });
    read_estimator(root, s, kName);
    check_together(root, s);
  });
  return loaded;
}

// --- Files ------------------------------------------------------------------------------------------------------------

TomlDocument read_with_base(const std::string& path, const std::string& named_by, int depth) {
  TomlDocument document(read_text_file(path, named_by), path);
  std::string position;
  const std::string base = document.take_text("base", position);
  if (base.empty()) return document;
  if (depth == kDeepestBase)
    throw Refusal(position + "more than " + std::to_string(kDeepestBase) + " bases, one upon the other");
  TomlDocument under = read_with_base((std::filesystem::path(path).parent_path() / base).string(), position, depth + 1);
  under.merge(std::move(document));
  return under;
}

TomlDocument read_with_overrides(const std::string& path, const std::vector<std::string>& overrides) {
  TomlDocument document = read_with_base(path, "", 0);
  for (const std::string& text : overrides) document.merge(TomlDocument::assignment(text));
  return document;
}

}  // namespace

std::string LoadedScenario::run_name() const {
  char hash[16];
  std::snprintf(hash, sizeof hash, "%08x", static_cast<unsigned>(hash64(resolved_toml)));
  return scenario.name + "-" + hash;
}

LoadedScenario load_scenario_file(const std::string& path, const std::vector<std::string>& overrides) {
  return resolve(read_with_overrides(path, overrides), path);
}

std::string flat_scenario_file(const std::string& path, const std::vector<std::string>& overrides) {
  return read_with_overrides(path, overrides).flat_text();
}

LoadedScenario load_scenario_text(const std::string& toml, const std::string& source_name,
                                  const std::vector<std::string>& overrides) {
  TomlDocument document(toml, source_name);
  std::string position;
  if (!document.take_text("base", position).empty())
    throw Refusal(position + "a scenario that is not read from a file cannot have a base");
  for (const std::string& text : overrides) document.merge(TomlDocument::assignment(text));
  return resolve(document, source_name);
}

LoadedScenario with_estimator_config(const LoadedScenario& loaded, const std::string& path) {
  const std::string source = "scenario " + loaded.scenario.name;
  TomlDocument config(read_text_file(path), path);
  config.read([](TomlTable& root) { root.only({"estimator", "tuning"}); });
  TomlDocument document(loaded.resolved_toml, source);
  document.merge(std::move(config));
  return resolve(document, source);
}

}  // namespace slipstream
