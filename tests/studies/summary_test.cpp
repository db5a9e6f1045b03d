// The indices of a study, by hand.
#include "studies/summary.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

namespace slipstream {
namespace {

// One case, one estimator.
Study study_of(int runs) {
  Study s;
  s.name = "hand";
  s.runs = runs;
  s.scenarios = {{"only", ""}};
  s.estimators = {{"a", "ekf", "", {}}};
  s.grid = {{"sensor.x.noise_m", {"5.0"}}};
  s.cases.resize(1);
  s.cases[0].values = {"5.0"};
  return s;
}

// Two samples with the errors e of two states.
RunLine line_of(std::size_t item, const double (&e)[2][2], double nees, double nis) {
  EstimatorRun run;
  run.estimator = "a";
  run.tally = {2, 1, 0};
  run.samples = 2;
  for (int i = 0; i < 2; ++i) {
    StateErrors s{i == 0 ? "x" : "y", 2, 0.0, 0.0, {}, {}};
    for (int j = 0; j < 2; ++j) {
      s.square_sum += e[j][i] * e[j][i];
      s.most = std::max(s.most, std::abs(e[j][i]));
      s.series.push_back(std::abs(e[j][i]));
    }
    run.states.push_back(s);
  }
  for (int j = 0; j < 2; ++j) {
    const double norm = std::sqrt((e[j][0] * e[j][0] + e[j][1] * e[j][1]) / 2.0);
    run.norm_sum += norm;
    run.t_s.push_back(0.1 * j);
    run.norm_series.push_back(norm);
    run.nees_series.push_back(nees);
  }
  run.nees = {2, 2.0 * nees, 4.0};
  run.nis = {2, 2.0 * nis, 2.0};
  return {"", item, 0, {run}, {10.0}};
}

// A run in which the estimator gave up for a while has no eta: it would be better off without its worst samples.
TEST(Summary, ARunWithAGapHasNoEta) {
  const Study study = study_of(2);
  Summariser summariser(study);
  summariser.add(line_of(0, {{3.0, -4.0}, {6.0, 8.0}}, 1.0, 0.5));
  RunLine gap = line_of(1, {{0.0, 0.0}, {0.0, 0.0}}, 1.0, 0.5);
  gap.estimators[0].missing = 1;
  summariser.add(gap);
  const Summary summary = summariser.finish();
  const EstimatorSummary& a = summary.cases[0].estimators[0];
  EXPECT_TRUE(std::isnan(a.eta_of_run[1]));
  EXPECT_EQ(a.eta, a.eta_of_run[0]);
}

// Two runs, s = 4 and 8, b = 3 and 5: R = 8/12, sum (b - R s)^2 = 2/9, so 1.96 sqrt(2/1 * 2/9)/12.
TEST(Summary, EfficiencyAndItsIntervalByHand) {
  const Study study = study_of(2);
  Summariser summariser(study);
  for (const auto& [item, square, bound] : {std::tuple{0U, 4.0, 3.0}, {1U, 8.0, 5.0}}) {
    RunLine line = line_of(item, {{1.0, 1.0}, {1.0, 1.0}}, 1.0, 0.5);
    line.estimators[0].states[0].square_sum = square;
    line.estimators[0].states[0].bound_sum = bound;
    summariser.add(line);
  }
  const Summary summary = summariser.finish();
  const StateSummary& x = summary.cases[0].estimators[0].states[0];
  ASSERT_TRUE(x.efficiency && x.efficiency_off);
  EXPECT_NEAR(*x.efficiency, 8.0 / 12.0, 1e-15);                                 // rounding
  EXPECT_NEAR(*x.efficiency_off, 1.959964 * std::sqrt(4.0 / 9.0) / 12.0, 1e-7);  // of the printed quantile
  EXPECT_FALSE(summary.cases[0].estimators[0].states[1].efficiency);
}

TEST(Summary, IndicesByHand) {
  const Study study = study_of(2);
  Summariser summariser(study);
  // sqrt((3^2 + 4^2)/2) = 5/sqrt 2, sqrt((6^2 + 8^2)/2) = 10/sqrt 2; the second run: twice as much.
  summariser.add(line_of(0, {{3.0, -4.0}, {6.0, 8.0}}, 1.0, 0.5));
  summariser.add(line_of(1, {{-6.0, 8.0}, {12.0, 16.0}}, 3.0, 1.5));
  const Summary summary = summariser.finish();
  EXPECT_TRUE(summary.missing.empty());
  ASSERT_EQ(summary.cases.size(), 1U);
  EXPECT_EQ(summary.cases[0].runs, 2);
  EXPECT_EQ(summary.cases[0].point[0], (std::pair<std::string, std::string>{"sensor.x.noise_m", "5.0"}));
  const EstimatorSummary& a = summary.cases[0].estimators[0];
  const double eps = 1e-15;  // a few roundings of numbers near 10
  EXPECT_NEAR(a.eta_of_run[0], 7.5 / std::sqrt(2.0), 8 * eps);
  EXPECT_NEAR(a.eta_of_run[1], 15.0 / std::sqrt(2.0), 16 * eps);
  EXPECT_NEAR(a.eta, 11.25 / std::sqrt(2.0), 16 * eps);  // eq. 29
  EXPECT_EQ(a.worst_run, 1);
  ASSERT_EQ(a.eps_k.size(), 2U);
  EXPECT_NEAR(a.eps_k[0], 7.5 / std::sqrt(2.0), 8 * eps);  // eq. 28: mean of 5 and 10
  EXPECT_NEAR(a.eps_k[1], 15.0 / std::sqrt(2.0), 16 * eps);
  EXPECT_EQ(a.states[0].eps_k, (std::vector<double>{4.5, 9.0}));  // eq. 30
  EXPECT_EQ(a.states[1].eps_k, (std::vector<double>{6.0, 12.0}));
  EXPECT_NEAR(a.states[0].rmse, std::sqrt((9.0 + 36.0 + 36.0 + 144.0) / 4.0), 8 * eps);
  EXPECT_NEAR(a.states[0].rmse_of_run[0], std::sqrt(45.0 / 2.0), 8 * eps);
  EXPECT_EQ(a.states[1].most, 16.0);
  EXPECT_FALSE(a.states[0].bound_rmse);
  EXPECT_EQ(a.tally.steps, 4);
  EXPECT_EQ(a.tally.fallback, 2);
  EXPECT_EQ(a.step_time_us, 5.0);
  EXPECT_EQ(a.nees.mean, 2.0);
  EXPECT_EQ(a.nees.dimension, 2.0);
  // N = 2 runs of 2 states: chi-square with 4 degrees, 0.484 ... 11.143 (any table), over N.
  EXPECT_NEAR(a.nees.band.low, 0.484 / 2.0, 5e-4);  // as the table is printed
  EXPECT_NEAR(a.nees.band.high, 11.143 / 2.0, 5e-4);
  EXPECT_TRUE(a.nees.within);
  EXPECT_EQ(a.nees_inside, 1.0);
  // N = 4 samples of one dimension: the same 4 degrees, over 4.
  EXPECT_EQ(a.nis.mean, 1.0);
  EXPECT_NEAR(a.nis.band.low, 0.484 / 4.0, 5e-4);
  EXPECT_NEAR(a.nis.band.high, 11.143 / 4.0, 5e-4);
}

TEST(Summary, WhatIsMissingIsNamedAndInNoMean) {
  const Study study = study_of(4);
  Summariser summariser(study);
  summariser.add(line_of(1, {{3.0, -4.0}, {6.0, 8.0}}, 1.0, 0.5));
  const Summary summary = summariser.finish();
  EXPECT_EQ(summary.missing, (std::vector<std::size_t>{0, 2, 3}));
  const EstimatorSummary& a = summary.cases[0].estimators[0];
  EXPECT_EQ(summary.cases[0].runs, 1);
  EXPECT_EQ(a.eta, a.eta_of_run[1]);
  EXPECT_TRUE(std::isnan(a.eta_of_run[0]));
}

TEST(Summary, ABoundIsSummarisedWhereEveryRunHasOne) {
  const Study study = study_of(2);
  for (const bool all : {true, false}) {
    Summariser summariser(study);
    for (std::size_t item = 0; item < 2; ++item) {
      RunLine line = line_of(item, {{3.0, -4.0}, {6.0, 8.0}}, 1.0, 0.5);
      if (all || item == 0) line.estimators[0].states[0].bound_sum = 8.0;  // variance 4 at both samples
      summariser.add(line);
    }
    const Summary summary = summariser.finish();
    EXPECT_EQ(summary.cases[0].estimators[0].states[0].bound_rmse, all ? std::optional(2.0) : std::nullopt);
  }
}

TEST(Summary, HowToSeeARunLive) {
  const Study study = study_of(2);
  EXPECT_EQ(replay_command(study, 1), "slipstream-plant scenarios/only.toml --set run.seed=" +
                                          std::to_string(study.seed_of(1)) + " --set 'sensor.x.noise_m=5.0'");
}

TEST(Summary, NothingOfTheWallClockIsInTheResults) {
  const Study study = study_of(1);
  std::string results[2], timings[2];
  for (const int i : {0, 1}) {
    Summariser summariser(study);
    RunLine line = line_of(0, {{3.0, -4.0}, {6.0, 8.0}}, 1.0, 0.5);
    line.step_time_us[0] = 1.0 + i;
    summariser.add(line);
    const Summary summary = summariser.finish();
    results[i] = results_json(study, summary);
    timings[i] = timings_json(study, summary);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_NE(timings[0], timings[1]);
}

}  // namespace
}  // namespace slipstream
