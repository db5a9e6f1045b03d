#include "monitor/scores.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// By hand: e = (0, 1, -1, 2), SS_res = 6, mean of truth 2.5, SS_tot = 2.25 + 0.25 + 0.25 + 2.25 = 5.
TEST(StateScore, HandComputed) {
  const StateScore s = score_state(std::vector<double>{1, 2, 3, 4}, std::vector<double>{1, 3, 2, 6});
  EXPECT_EQ(s.samples, 4);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(1.5));
  EXPECT_DOUBLE_EQ(s.r2, -0.2);
  EXPECT_EQ(s.max_abs_error, 2.0);
  EXPECT_EQ(s.max_index, 3u);
}

TEST(StateScore, PerfectIsOneAndTheMeanIsZero) {
  const std::vector<double> truth{1, 2, 3};
  EXPECT_EQ(score_state(truth, truth).r2, 1.0);
  EXPECT_EQ(score_state(truth, truth).rmse, 0.0);
  EXPECT_EQ(score_state(truth, std::vector<double>{2, 2, 2}).r2, 0.0);
}

TEST(StateScore, ConstantTruthHasNoR2) {
  const StateScore s = score_state(std::vector<double>{0.1, 0.1, 0.1}, std::vector<double>{0.1, 0.2, 0.1});
  EXPECT_TRUE(std::isnan(s.r2));                     // although the mean of three times 0.1 is not exactly 0.1
  EXPECT_NEAR(s.rmse, 0.1 / std::sqrt(3.0), 1e-15);  // rounding
}

TEST(StateScore, UnknownSamplesDoNotCount) {
  const StateScore s = score_state(std::vector<double>{1, kNan, 3, 4}, std::vector<double>{1, 3, kNan, 6});
  EXPECT_EQ(s.samples, 2);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(2.0));
  EXPECT_EQ(s.max_index, 3u);
  const StateScore none = score_state(std::vector<double>{kNan}, std::vector<double>{1});
  EXPECT_EQ(none.samples, 0);
  EXPECT_TRUE(std::isnan(none.rmse) && std::isnan(none.r2) && std::isnan(none.max_abs_error));
}

TEST(TruthAt, ExactElseBetweenTheNeighbours) {
  const std::vector<Utime> t{0, 100'000, 300'000};
  const std::vector<double> y{0, 1, 5};
  EXPECT_EQ(truth_at(t, y, 100'000), 1.0);
  EXPECT_EQ(truth_at(t, y, 25'000), 0.25);
  EXPECT_EQ(truth_at(t, y, 200'000), 3.0);
  EXPECT_TRUE(std::isnan(truth_at(t, y, -1)));
  EXPECT_TRUE(std::isnan(truth_at(t, y, 300'001)));
  EXPECT_TRUE(std::isnan(truth_at({}, {}, 0)));
}

TEST(TruthAt, BothNeighboursMustBeWithin200Milliseconds) {
  const std::vector<Utime> t{0, 400'000};
  const std::vector<double> y{0, 4};
  EXPECT_EQ(truth_at(t, y, 200'000), 2.0);
  EXPECT_TRUE(std::isnan(truth_at(t, y, 200'001)));
  EXPECT_TRUE(std::isnan(truth_at(t, y, 199'999)));
}

TEST(TruthAt, AnUnknownNeighbourMakesItUnknown) {
  const std::vector<Utime> t{0, 100'000, 200'000};
  const std::vector<double> y{0, kNan, 2};
  EXPECT_TRUE(std::isnan(truth_at(t, y, 50'000)));
  EXPECT_TRUE(std::isnan(truth_at(t, y, 100'000)));
  EXPECT_EQ(truth_at(t, y, 200'000), 2.0);
}

// S = [2 1; 1 2], S^-1 = 1/3 [2 -1; -1 2]; e = (1, -1): e' S^-1 e = 1/3 (2 + 1 + 1 + 2) = 2.
TEST(NormalisedSquare, HandComputed) {
  EXPECT_NEAR(normalised_square(std::vector<double>{1, -1}, std::vector<double>{2, 1, 1, 2}), 2.0, 1e-15);  // rounding
  EXPECT_DOUBLE_EQ(normalised_square(std::vector<double>{3}, std::vector<double>{4}), 2.25);
}

TEST(NormalisedSquare, UnknownWithoutAPositiveDefiniteMatrix) {
  EXPECT_TRUE(std::isnan(normalised_square(std::vector<double>{1, 1}, std::vector<double>{1, 2, 2, 1})));
  EXPECT_TRUE(std::isnan(normalised_square(std::vector<double>{1}, std::vector<double>{0})));
  EXPECT_TRUE(std::isnan(normalised_square(std::vector<double>{kNan}, std::vector<double>{1})));
  EXPECT_TRUE(std::isnan(normalised_square(std::vector<double>{1}, std::vector<double>{kNan})));
  EXPECT_TRUE(std::isnan(normalised_square({}, {})));
}

TEST(SubBlock, KeepsRowsAndColumns) {
  const std::vector<double> m{1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_EQ(sub_block(m, 3, std::vector<std::size_t>{0, 2}), (std::vector<double>{1, 3, 7, 9}));
}

// chi2_20 at 0.025 and 0.975 is 9.591 and 34.170 (NIST table): over ten values of two dimensions 0.9591 and 3.4170.
TEST(Consistency, MeanAgainstItsBand) {
  const Consistency inside = score_consistency(std::vector<double>{1, 2, 3, 1, 2, 3, 1, 2, 3, kNan, 2}, 2);
  EXPECT_EQ(inside.samples, 10);
  EXPECT_DOUBLE_EQ(inside.mean, 2.0);
  EXPECT_NEAR(inside.band.low, 0.9591, 5e-5);   // half the last printed digit
  EXPECT_NEAR(inside.band.high, 3.4170, 5e-5);  // half the last printed digit
  EXPECT_TRUE(inside.within);
  EXPECT_FALSE(score_consistency(std::vector<double>(10, 0.9), 2).within);
  EXPECT_FALSE(score_consistency(std::vector<double>(10, 3.5), 2).within);
}

// Ten values of one dimension and five of two: sum d = 20, so the same printed quantiles over N = 15.
TEST(Consistency, MixedDimensions) {
  std::vector<double> q(15, 1.0);
  std::vector<int> d(15, 1);
  for (std::size_t i = 0; i < 5; ++i) d[3 * i] = 2;
  q.push_back(kNan);  // counts neither as a value nor by its dimension
  d.push_back(2);
  const Consistency c = score_consistency(q, d);
  EXPECT_EQ(c.samples, 15);
  EXPECT_DOUBLE_EQ(c.dimension, 4.0 / 3.0);
  EXPECT_DOUBLE_EQ(c.mean, 1.0);
  EXPECT_NEAR(c.band.low, 9.591 / 15.0, 5e-4 / 15.0);    // half the last printed digit over N
  EXPECT_NEAR(c.band.high, 34.170 / 15.0, 5e-4 / 15.0);  // the same
  EXPECT_TRUE(c.within);
  for (double& value : q) value *= 2.3;  // 34.170/15 = 2.278
  EXPECT_FALSE(score_consistency(q, d).within);
}

TEST(Consistency, NothingKnown) {
  const Consistency none = score_consistency(std::vector<double>{kNan}, 2);
  EXPECT_EQ(none.samples, 0);
  EXPECT_TRUE(std::isnan(none.mean) && std::isnan(none.band.low));
  EXPECT_FALSE(none.within);
  EXPECT_TRUE(std::isnan(consistency_ratio(std::vector<double>{kNan}, std::vector<int>{2})));
}

TEST(Consistency, RatioOverMixedDimensions) {
  EXPECT_DOUBLE_EQ(consistency_ratio(std::vector<double>{1, 4, kNan, 1}, std::vector<int>{1, 2, 2, 1}), 1.5);
}

TEST(StepTimes, PercentilesAndMisses) {
  std::vector<double> us;
  for (int i = 100; i >= 1; --i) us.push_back(i);
  us.push_back(kNan);
  const StepTimes s = score_step_times(us, 90e-6);
  EXPECT_EQ(s.p50, 50);
  EXPECT_EQ(s.p99, 99);
  EXPECT_EQ(s.max, 100);
  EXPECT_DOUBLE_EQ(s.mean, 50.5);
  EXPECT_EQ(s.deadline_misses, 10);  // 91 to 100; 90 is in time
  EXPECT_EQ(score_step_times(us, 0.0).deadline_misses, 0);
  EXPECT_TRUE(std::isnan(score_step_times({}, 0.01).p50));
}

TEST(Residuals, AreOfTheProgramsThatWereSolved) {
  std::vector<double> residual;
  for (int i = 100; i >= 1; --i) residual.push_back(1e-3 * i);
  residual.push_back(kNan);
  const Residuals r = score_residuals(residual);
  EXPECT_EQ(r.programs, 100);
  EXPECT_EQ(r.p50, 0.05);
  EXPECT_EQ(r.p99, 0.099);
  EXPECT_EQ(r.max, 0.1);
  EXPECT_EQ(score_residuals({kNan}).programs, 0);
  EXPECT_TRUE(std::isnan(score_residuals({}).max));
}

}  // namespace
}  // namespace slipstream
