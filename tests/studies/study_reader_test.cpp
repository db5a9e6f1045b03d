// Study files: what they mean, and every refusal word for word.
#include "io/study_reader.hpp"

#include <gtest/gtest.h>

#include <set>

#include "io/scenario_reader.hpp"
#include "tests/studies/small_study.hpp"

namespace slipstream {
namespace {

TEST(StudyReader, DefaultsAndOrder) {
  const TemporaryFolder folder;
  const Study s = read_small(folder, small_study());
  EXPECT_EQ(s.name, "small");
  EXPECT_EQ(s.runs, 3);
  EXPECT_EQ(s.seed, 7U);
  EXPECT_FALSE(s.series);
  ASSERT_EQ(s.scenarios.size(), 1U);
  EXPECT_EQ(s.scenarios[0].name, "point_mass");  // its own
  ASSERT_EQ(s.estimators.size(), 2U);
  EXPECT_EQ(s.estimators[0].algorithm, "ekf");  // its name
  EXPECT_EQ(s.estimators[1].name, "few");
  EXPECT_EQ(s.estimators[1].algorithm, "pf");
  ASSERT_EQ(s.pairs.size(), 1U);  // all
  EXPECT_EQ(s.pairs[0].estimator, "ekf");
  EXPECT_EQ(s.pairs[0].against, "few");
  ASSERT_EQ(s.cases.size(), 1U);
  EXPECT_EQ(s.items(), 3U);
  EXPECT_EQ(s.cases[0].drive.run.duration_s, 0.5);
  // What an estimator sets is its own.
  EXPECT_EQ(s.cases[0].beliefs[0].estimator.tunings.at("matched").pf_particles, 300);
  EXPECT_EQ(s.cases[0].beliefs[1].estimator.tunings.at("matched").pf_particles, 50);
}

// Keys quoted or not, in the order of the file.
TEST(StudyReader, TheGridIsAProductOfWhichTheLastAxisTurnsFastest) {
  const TemporaryFolder folder;
  const std::string grid = "[grid]\nsensor.forward_speed.noise_mps = [5, 2.5]\n\"vehicle.steering_rad\" = [[0], [0.01]]\n";
  const Study s = read_small(folder, small_study(grid));
  ASSERT_EQ(s.cases.size(), 4U);
  EXPECT_EQ(s.items(), 12U);
  const auto speed_noise = [&](std::size_t i) {
    for (const SensorConfig& sensor : s.cases[i].drive.sensors)
      if (sensor.type == "forward_speed") return sensor.noise.absolute;
    return 0.0;
  };
  const auto steering = [&](std::size_t i) { return std::get<PointMass>(s.cases[i].drive.plant.vehicle).steering_rad[0]; };
  const double expected[4][2] = {{5.0, 0.0}, {5.0, 0.01}, {2.5, 0.0}, {2.5, 0.01}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(speed_noise(i), expected[i][0]) << i;
    EXPECT_EQ(steering(i), expected[i][1]) << i;
  }
  EXPECT_EQ(s.cases[1].values, (std::vector<std::string>{"5", "[0.01]"}));
  EXPECT_EQ(s.case_of(11).values, s.cases[3].values);
  EXPECT_EQ(s.run_of(11), 2);
}

// Whoever computes it, and whatever else the study holds.
TEST(StudyReader, ARunHasItsSeedFromTheRootAndItsIndexOnly) {
  const TemporaryFolder folder;
  const Study plain = read_small(folder, small_study());
  const Study other = read_small(folder, small_study("[grid]\n\"sensor.forward_speed.noise_mps\" = [5, 7]\n"));
  const Study root = read_small(folder, small_study("", "seed = 8"));
  std::set<std::uint64_t> seen;
  for (int run = 0; run < 1000; ++run) {
    EXPECT_EQ(plain.seed_of(run), other.seed_of(run));
    EXPECT_NE(plain.seed_of(run), root.seed_of(run));
    EXPECT_LT(plain.seed_of(run), std::uint64_t{1} << 53);  // what a scenario's run.seed holds
    EXPECT_TRUE(seen.insert(plain.seed_of(run)).second);
  }
}

// The folder of a study holds the whole of it: it reads back to the same key, from files or from texts.
TEST(StudyReader, WhatIsResolvedReadsBackToTheSameStudy) {
  const TemporaryFolder folder, copy;
  const Study s = read_small(
      folder,
      small_study("[grid]\n\"vehicle.mass_kg\" = [1000.0, 1500.0]\n[[compare]]\nestimator = \"few\"\nagainst = \"ekf\"\n"));
  std::filesystem::create_directory(copy.path("scenarios"));
  copy.write("scenarios/point_mass.toml", s.scenarios[0].toml);
  const Study again = load_study_file(copy.write("study.toml", s.resolved_toml), require_playable);
  EXPECT_EQ(again.key, s.key);
  EXPECT_EQ(again.resolved_toml, s.resolved_toml);
  EXPECT_EQ(again.pairs[0].estimator, "few");
  EXPECT_EQ(load_study_text(s.resolved_toml, {{"point_mass", s.scenarios[0].toml}}, "text", require_playable).key, s.key);
  // What an estimator believes of the vehicle follows the grid, as it follows an override of the file itself.
  const auto mass = [](const Scenario& scenario) { return std::get<PointMassMotion>(scenario.estimator.process).car.mass_kg; };
  EXPECT_EQ(mass(again.cases[0].beliefs[0]), 1000.0);
  EXPECT_EQ(mass(again.cases[1].beliefs[0]), 1500.0);
}

TEST(StudyReader, AnyDifferenceMakesAnotherKey) {
  const TemporaryFolder folder;
  std::set<std::string> keys;
  for (const std::string& toml :
       {small_study(), small_study("", "seed = 8"), small_study("", "seed = 7\nseries = true"),
        small_study("", "seed = 7\nstates = [\"east_m\"]"), small_study("[estimator.more]\nalgorithm = \"pf\"\n"),
        small_study("[grid]\n\"vehicle.mass_kg\" = [1000]\n"), small_study("[grid]\n\"vehicle.mass_kg\" = [1001]\n")})
    EXPECT_TRUE(keys.insert(read_small(folder, toml).key).second) << toml;
}

TEST(StudyReader, Refusals) {
  const TemporaryFolder folder;
  const std::string file = folder.path("study.toml");
  const std::string seed = "the seed of each run is the study's: a hash of its `seed` and the run's index";
  struct {
    std::string toml, line;
  } const doors[] = {
      {"runs = 3\n", file + ": missing key 'name'"},
      {small_study("", "sed = 7"), file + ":3:1: unknown key 'sed'; did you mean 'seed'?"},
      {small_study("", "seed = -1"), file + ":3:8: seed: found -1, expected a whole number from 0 to 9007199254740992"},
      {"name = \"x\"\n[estimator.ekf]\n", file + ": scenario: expected at least one table [[scenario]]"},
      {"name = \"x\"\n[[scenario]]\nfile = \"" + kPointMass + "\"\n",
       file + ": estimator: expected at least one table [estimator.NAME]"},
      {"name = \"x\"\n[[scenario]]\nname = \"y\"\n[estimator.ekf]\n", file + ":2:1: missing key 'file' in [[scenario]]"},
      {"name = \"x\"\n[[scenario]]\nfile = \"nowhere.toml\"\n[estimator.ekf]\n",
       file + ":3:8: scenario.file: " + folder.path("nowhere.toml") + ": cannot read: No such file or directory"},
      {small_study("[grid]\n"),
       file + ":12:1: grid: an empty grid; expected keys of the scenarios with lists of values, or no [grid]"},
      {small_study("[grid]\n\"vehicle.mass_kg\" = []\n"),
       file + ":13:21: grid.vehicle.mass_kg: found a list, expected a list of at least one value"},
      {small_study("[grid]\n\"vehicle.mass_kg\" = 3\n"),
       file + ":13:21: grid.vehicle.mass_kg: found 3, expected a list of at least one value"},
      {small_study("[grid]\n\"vehicle.mass_kg\" = [1, 2, 1]\n"), file + ":13:28: grid.vehicle.mass_kg: 1 appears twice"},
      {small_study("[grid]\n\"vehicle.mass_kg\" = [1, 1979-05-27]\n"),
       file + ":13:25: grid.vehicle.mass_kg: found a date or time, expected a number, text, true, false, or a list of these"},
      {small_study("[grid]\n\"vehicle.mas_kg\" = [1]\n"),
       file + ": override 'vehicle.mas_kg=1': unknown key 'mas_kg' in [vehicle]; did you mean 'mass_kg'?"},
      {small_study("[grid]\n\"vehicle.mass_kg\" = [1000, -1]\n"),
       file + ": override 'vehicle.mass_kg=-1': vehicle.mass_kg: found -1, expected a number greater than 0"},
      {small_study("[grid]\n\"run.seed\" = [1, 2]\n"), file + ":12:1: grid: " + seed},
      {small_study("[grid]\n\"run.duration_s\" = [1, 2]\n"),
       file + ":12:1: grid: 'run.duration_s' is also set by [[scenario]]"},
      {small_study("[grid]\n\"tuning.matched.pf_particles\" = [1, 2]\n"),
       file + ":12:1: grid: 'tuning.matched.pf_particles' is also set by [estimator.few]"},
      {small_study("[[scenario]]\nfile = \"" + kPointMass + "\"\n"),
       file + ":13:8: scenario.file: two scenarios are called 'point_mass'; give one of them a `name`"},
      {small_study("[[scenario]]\nfile = \"" + kPointMass + "\"\nset = [\"run.seed=3\"]\n"),
       file + ":14:7: scenario.set: " + seed},
      {small_study("[[scenario]]\nfile = \"" + std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/f1tenth_ds3.toml\"\n"),
       file + ":13:8: scenario.file: a study simulates; this scenario plays a recorded drive"},
      {small_study("[estimator.pff]\n"), file + ":12:1: estimator.pff: unknown algorithm 'pff'; expected one of: "},
      {small_study("[estimator.pf]\ntuning = \"macthed\"\n"),
       file + ":12:1: estimator.pf: unknown tuning 'macthed'; scenario 'point_mass' has: matched, undiscretised"},
      {small_study("[estimator.pf]\nalgoritm = \"pf\"\n"),
       file + ":13:1: unknown key 'algoritm' in [estimator.pf]; did you mean 'algorithm'?"},
      {small_study("[estimator.pf]\nset = [\"tuning.matched.pf_partciles=3\"]\n"),
       file +
           ": estimator.pf.set: override 'tuning.matched.pf_partciles=3': unknown key 'pf_partciles' in [tuning.matched]; did "
           "you mean 'pf_particles'?"},
      {small_study("[estimator.pf]\nset = [\"vehicle.mass_kg=3\"]\n"),
       file +
           ":13:7: estimator.pf.set: 'vehicle.mass_kg' is not the estimator's alone: expected keys in estimator. or tuning."},
      {small_study("[[compare]]\nestimator = \"ekf\"\nagainst = \"fwe\"\n"),
       file + ":14:11: compare.against: unknown estimator 'fwe'; did you mean 'few'?"},
      {small_study("[[compare]]\nestimator = \"ekf\"\nagainst = \"ekf\"\n"),
       file + ":14:11: compare.against: an estimator is not compared with itself"},
      {small_study("", "states = [\"heading\"]"),
       file + ":8:1: estimator.ekf: no state 'heading' with a truth in scenario 'point_mass', which `states` asks for; it has: "
              "east_m, north_m, speed_mps, heading_rad"},
  };
  for (const auto& door : doors) {
    const std::string line = refusal_of([&] { read_small(folder, door.toml); });
    if (door.line.ends_with(": "))  // the list of algorithms grows
      EXPECT_EQ(line.substr(0, door.line.size()), door.line) << door.toml;
    else
      EXPECT_EQ(line, door.line) << door.toml;
  }
}

// The flat text of a scenario means the same as its files, also below an override that other keys follow.
TEST(StudyReader, AFlatScenarioMeansTheSameAsItsFiles) {
  for (const char* name : {"point_mass_3", "unimog_10", "city", "snow_step", "scale_car_rich", "track"}) {
    const std::string path = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml";
    const std::string flat = flat_scenario_file(path);
    EXPECT_EQ(load_scenario_text(flat, name).resolved_toml, load_scenario_file(path).resolved_toml) << name;
    const TemporaryFolder folder;
    EXPECT_EQ(flat_scenario_file(folder.write("flat.toml", flat)), flat) << name;
  }
}

}  // namespace
}  // namespace slipstream
