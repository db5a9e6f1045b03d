// One item of a study: its line, its seed, and that all estimators follow the same drive.
#include "studies/item.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "studies/play.hpp"
#include "tests/studies/small_study.hpp"

namespace slipstream {
namespace {

// The sums of a line against the series of an ordinary run of the scenario with the item's seed.
TEST(Item, IsAnOrdinaryRunOfTheScenarioWithItsSeed) {
  const TemporaryFolder folder;
  const Study study = read_small(folder, small_study("", "seed = 7\nstates = [\"east_m\", \"north_m\"]\nseries = true"));
  const RunLine line = run_item(study, 2);
  EXPECT_EQ(line.item, 2U);
  EXPECT_EQ(line.seed, study.seed_of(2));
  Scenario scenario = study.cases[0].drive;
  scenario.run.seed = line.seed;
  const Played played = slipstream::play(scenario, {{"ekf", "matched", "", nullptr}}, nullptr, {"east_m", "north_m"});
  const EstimatorRun& ekf = line.estimators[0];
  EXPECT_EQ(ekf.estimator, "ekf");
  EXPECT_EQ(ekf.tally.steps, 21);  // 0 ... 0.5 s at 40 Hz
  EXPECT_EQ(ekf.samples, 20);      // k = 1 ... 20: not the start
  EXPECT_EQ(ekf.missing, 0);
  ASSERT_EQ(ekf.states.size(), 2U);
  const std::vector<double> east = played.error(0, "east_m"), north = played.error(0, "north_m");
  double squares = 0.0, norms = 0.0, nees = 0.0;
  for (std::size_t j = 0; j < east.size(); ++j) {
    squares += east[j] * east[j];
    const double norm = std::sqrt((east[j] * east[j] + north[j] * north[j]) / 2.0);
    if (j > 0) norms += norm;
    nees += played.tracks[0].nees[j];
    EXPECT_EQ(ekf.states[0].series[j], std::abs(east[j]));
    EXPECT_TRUE(j == 0 ? std::isnan(ekf.norm_series[j]) : ekf.norm_series[j] == norm);
  }
  EXPECT_EQ(ekf.states[0].square_sum, squares);
  EXPECT_EQ(ekf.norm_sum, norms);
  EXPECT_EQ(ekf.nees.sum, nees);
  EXPECT_EQ(ekf.nees.dimensions, 42.0);  // two states
  EXPECT_EQ(ekf.nis.dimensions, 63.0);   // three sensors
}

// Common random numbers: the EKF's line does not depend on who else follows the drive.
TEST(Item, EstimatorsDoNotTouchEachOther) {
  const TemporaryFolder folder;
  const Study two = read_small(folder, small_study());
  const Study three = read_small(folder, small_study("[estimator.again]\nalgorithm = \"ekf\"\n"));
  const RunLine a = run_item(two, 1), b = run_item(three, 1);
  ASSERT_EQ(b.estimators.size(), 3U);
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.estimators[0].norm_sum, b.estimators[1].norm_sum);  // ekf, after "again"
  EXPECT_EQ(b.estimators[0].norm_sum, b.estimators[1].norm_sum);
  EXPECT_EQ(a.estimators[1].norm_sum, b.estimators[2].norm_sum);  // few
}

TEST(Item, ALineReadsBackToTheSameBits) {
  const TemporaryFolder folder;
  const Study study = read_small(folder, small_study("", "series = true"));
  const std::string text = to_text(run_item(study, 0));
  EXPECT_EQ(text.find('\n'), std::string::npos);
  EXPECT_EQ(to_text(read_run_line(text)), text);
  EXPECT_TRUE(is_same_result(text, to_text(run_item(study, 0))));  // but for the wall clock
  EXPECT_FALSE(is_same_result(text, to_text(run_item(study, 1))));
}

TEST(Item, WhatIsNotKnownIsNull) {
  RunLine line{
      "key",
      3,
      5,
      {{"e", {2, 0, 1}, 1, 0, 0.1, {{"x", 1, 1e-300, 0.1, {0.1, NAN}, {}}}, {}, {}, {0.0, 0.1}, {0.1, NAN}, {NAN, NAN}}},
      {NAN}};
  const std::string text = to_text(line);
  const RunLine back = read_run_line(text);
  EXPECT_EQ(to_text(back), text);
  EXPECT_TRUE(std::isnan(back.estimators[0].states[0].series[1]));
  EXPECT_TRUE(std::isnan(back.step_time_us[0]));
  EXPECT_EQ(back.estimators[0].states[0].square_sum, 1e-300);
  EXPECT_FALSE(back.estimators[0].states[0].bound_sum);
  line.estimators[0].states[0].bound_sum = 0.25;
  EXPECT_EQ(read_run_line(to_text(line)).estimators[0].states[0].bound_sum, 0.25);
}

TEST(Item, TextThatIsNoLineIsRefused) {
  for (const char* text : {"", "{", "[]", "3", "{\"study\":\"k\",\"item\":1"})
    EXPECT_EQ(refusal_of([&] { read_run_line(text); }), "not a line of JSON");
  for (const char* text : {"{}", R"({"study":3,"item":1,"seed":2,"estimators":{},"step_time_us":{}})",
                           R"({"study":"k","item":1,"seed":2,"estimators":{"e":{}},"step_time_us":{}})"})
    EXPECT_EQ(refusal_of([&] { read_run_line(text); }), "not the line of a run") << text;
  const TemporaryFolder folder;
  std::string cut = to_text(run_item(read_small(folder, small_study("", "series = true")), 0));
  cut.replace(cut.find("\"t_s\":[0"), 8, "\"t_s\":[0.5,0");
  EXPECT_EQ(refusal_of([&] { read_run_line(cut); }), "series of different lengths");
}

}  // namespace
}  // namespace slipstream
