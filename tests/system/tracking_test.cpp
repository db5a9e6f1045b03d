// The whole family of filters as processes: on the point mass that chance pushes, and on every other kind of model.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/system/doors.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

std::string scenario(const std::string& name) { return std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml"; }

const std::vector<std::string> kFamily{"ukf", "sqrt_ukf", "pf", "asir", "rbpf"};

// Plant, monitor and one estimator of each algorithm, in lockstep.
void play(Bench& bench, const Arguments& plant_arguments, const std::vector<std::string>& algorithms) {
  std::string all = "monitor";
  for (const std::string& a : algorithms) all += "," + a;
  Process plant = bench.plant(plant_arguments + Arguments{"--wait-for", all}), monitor = bench.monitor();
  std::vector<std::unique_ptr<Process>> estimators;
  for (const std::string& a : algorithms) estimators.emplace_back(new Process(bench.estimator({"--algorithm", a, "--once"})));
  expect_success(plant);
  for (const auto& e : estimators) expect_success(*e);
  expect_success(monitor);
}

TEST(Tracking, LiveInLockstepAgainstTheBoundAndAgainFromTheLog) {
  Bench bench;
  std::vector<std::string> algorithms = kFamily;
  algorithms.insert(algorithms.end(), {"ekf", "mhe"});
  play(bench, {scenario("point_mass")}, algorithms);
  const nlohmann::json scores = bench.scores();
  EXPECT_EQ(scores["bound"]["applies"], true) << scores["bound"];
  for (const std::string& name : algorithms) {
    const nlohmann::json& estimator = scores["estimators"][name];
    EXPECT_EQ(estimator["valid"], 101) << name << ": 2.5 s at 40 Hz, both ends";
    for (const char* state : {"east_m", "north_m"}) {
      EXPECT_LT(estimator["states"][state]["rmse"], 4.0) << name << ": a fix has 10 m, a good filter some 1.3 m";
      const double efficiency = estimator["states"][state]["efficiency"];
      EXPECT_GT(efficiency, 0.1) << name;  // of one run, which scatters: errors are alike for some 60 samples
      EXPECT_LT(efficiency, 10.0) << name;
    }
    Process again = bench.from_log(bench.path("out/run.lcm"), {"--algorithm", name, "--out", bench.path(name + ".lcm")});
    expect_success(again);
    const std::vector<Estimate> first = estimates_in(bench.path("out/run.lcm"), name),
                                second = estimates_in(bench.path(name + ".lcm"), name);
    ASSERT_EQ(first.size(), 101u) << name;
    ASSERT_EQ(second.size(), 101u) << name;
    for (std::size_t i = 0; i < first.size(); ++i) ASSERT_EQ(bits(first[i]), bits(second[i])) << name << " estimate " << i;
  }
}

// A second of each kind of model: every estimate usable and its covariance positive, as the monitor sees it.
TEST(Tracking, EveryFilterWorksOnEveryModelLive) {
  for (const char* name : {"unimog", "snow_step", "circle"}) {
    Bench bench;
    play(bench, {scenario(name), "--set", "run.duration_s=1"}, kFamily);
    const nlohmann::json scores = bench.scores();
    EXPECT_EQ(scores["bound"]["applies"], false) << name;
    for (const std::string& algorithm : kFamily) {
      const nlohmann::json& estimator = scores["estimators"][algorithm];
      const int valid = estimator["valid"], fallback = estimator["fallback"], invalid = estimator["invalid"];
      EXPECT_EQ(valid + fallback + invalid, 101) << name << ", " << algorithm << ": 1 s at 100 Hz, both ends";
      EXPECT_LE(invalid, 1) << name << ", " << algorithm
                            << ": at the start one particle may carry all the weight, which is told";
      EXPECT_GE(valid, 95) << name << ", " << algorithm
                           << ": a particle filter may find its set lost while it learns the friction";
      for (const auto& [state, score] : estimator["states"].items())
        EXPECT_TRUE(score["rmse"].is_number() || score["rmse"].is_null()) << name << ", " << algorithm << ", " << state;
    }
  }
}

}  // namespace
}  // namespace slipstream::test
