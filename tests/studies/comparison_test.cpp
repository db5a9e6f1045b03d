#include "studies/comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "common/random.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
using Verdict = Comparison::Verdict;

std::vector<std::uint64_t> first_runs(std::size_t n) {
  std::vector<std::uint64_t> run(n);
  std::iota(run.begin(), run.end(), std::uint64_t{0});
  return run;
}

Comparison compared(const std::vector<double>& a, const std::vector<double>& b) {
  return compare("ukf", a, "pf", b, first_runs(a.size()));
}

// Share of the repetitions whose interval has the true d in it. `draw`: the errors of both in a run.
template <typename Draw>
double coverage(int repetitions, std::size_t n, double truth, const Draw& draw) {
  RandomStream random(1, n, "coverage");
  int inside = 0;
  for (int r = 0; r < repetitions; ++r) {
    std::vector<double> a, b;
    for (std::size_t i = 0; i < n; ++i) {
      const auto [e_a, e_b] = draw(random);
      a.push_back(e_a);
      b.push_back(e_b);
    }
    const Comparison c = compared(a, b);
    inside += c.low <= truth && truth <= c.high ? 1 : 0;
  }
  return static_cast<double>(inside) / repetitions;
}

// 0.95 +- 3 standard deviations of a binomial share of 400: 0.95 +- 3 sqrt(0.95 0.05/400) = 0.95 +- 0.033.
TEST(Comparison, IntervalsHoldTheTruthAsOftenAsTheySay) {
  // Errors that share the run's draw: means 9 and 10, so d = 0.1.
  const auto normal = [](RandomStream& r) {
    const double shared = r.normal();
    return std::pair(9.0 + shared + 0.5 * r.normal(), 10.0 + shared + 0.5 * r.normal());
  };
  // Log-normal, E[e^(s xi)] = e^(s^2/2): means 1.5 e^0.125 and 2 e^0.125, so d = 0.25; skewness 1.75.
  const auto skewed = [](RandomStream& r) {
    const double shared = 0.4 * r.normal();
    return std::pair(1.5 * std::exp(shared + 0.3 * r.normal()), 2.0 * std::exp(shared + 0.3 * r.normal()));
  };
  for (const std::size_t n : {10u, 30u, 100u}) {
    const double of_normal = coverage(400, n, 0.1, normal), of_skewed = coverage(400, n, 0.25, skewed);
    std::printf("n = %zu: %.3f of normal, %.3f of skewed errors\n", n, of_normal, of_skewed);
    EXPECT_NEAR(of_normal, 0.95, 0.033) << n;
    EXPECT_NEAR(of_skewed, 0.95, 0.033) << n;
  }
}

// With b = 0 + 1 exactly the interval is that of a mean of normal deviates: +-1.96 sigma/sqrt(n).
TEST(Comparison, AgreesWithTheIntervalOfAMean) {
  const std::size_t n = 400;
  RandomStream random(2, 0, "mean");
  std::vector<double> a, b(n, 1.0);
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    a.push_back(0.8 + 0.05 * random.normal());
    sum += a.back();
    squares += a.back() * a.back();
  }
  const double mean = sum / n, error = std::sqrt((squares / n - mean * mean) / (n - 1));
  const Comparison c = compared(a, b);
  EXPECT_NEAR(c.difference, 1.0 - mean, 1e-12);  // rounding of a sum of 400
  EXPECT_EQ(c.verdict, Verdict::kFirstIsBetter);
  // An order statistic at 0.025 of 2000 resamples is off by about sqrt(0.025 0.975/2000)/phi(1.96) = 0.06 sigma: four of that.
  EXPECT_NEAR(c.low, 1.0 - mean - 1.96 * error, 0.24 * error);
  EXPECT_NEAR(c.high, 1.0 - mean + 1.96 * error, 0.24 * error);
}

TEST(Comparison, IdenticalErrorsAreATieOfZero) {
  const std::vector<double> e{1.0, 2.0, 0.5, 3.0, 1.5, 1.0, 2.5, 0.1, 1.0, 1.0, 7.0};
  const Comparison c = compared(e, e);
  EXPECT_EQ(c.verdict, Verdict::kTie);
  EXPECT_EQ(c.difference, 0.0);
  EXPECT_EQ(c.low, 0.0);
  EXPECT_EQ(c.high, 0.0);
  EXPECT_EQ(c.sentence(), "tie: ukf and pf differ by 0 % +-0, n = 11");
  const std::vector<double> nothing(12, 0.0);
  EXPECT_EQ(compared(nothing, nothing).sentence(), "tie: ukf and pf differ by 0 % +-0, n = 12");
}

// The same estimate by another way of computing it is no better, however surely.
TEST(Comparison, WhatOnlyRoundingMakesIsATie) {
  std::vector<double> a, b;
  for (int i = 0; i < 100; ++i) {
    a.push_back(1.0 + 0.01 * i);
    b.push_back(a.back() * (1.0 + 1e-9));
  }
  const Comparison c = compared(a, b);
  EXPECT_GT(c.low, 0.0);
  EXPECT_EQ(c.sentence(), "tie: ukf and pf differ by 0.000 % +-0.000, n = 100");
}

TEST(Comparison, TheOrderOfRunsAndOfEstimatorsDoesNotMatter) {
  RandomStream random(3, 0, "order");
  std::vector<double> a, b;
  for (int i = 0; i < 57; ++i) {
    a.push_back(random.uniform());
    b.push_back(random.uniform() + 0.5);
  }
  b[20] = kNan;
  std::vector<std::uint64_t> run = first_runs(a.size());
  const Comparison c = compare("ukf", a, "pf", b, run);
  const Comparison exchanged = compare("pf", b, "ukf", a, run);
  EXPECT_EQ(exchanged.low, -c.high);
  EXPECT_EQ(exchanged.high, -c.low);
  EXPECT_EQ(c.verdict, Verdict::kFirstIsBetter);
  EXPECT_EQ(exchanged.sentence(), c.sentence());
  for (std::size_t i = 0; i < a.size(); ++i) {  // Fisher and Yates
    const auto j = i + static_cast<std::size_t>(random.uniform() * static_cast<double>(a.size() - i));
    std::swap(a[i], a[j]);
    std::swap(b[i], b[j]);
    std::swap(run[i], run[j]);
  }
  const Comparison shuffled = compare("ukf", a, "pf", b, run);
  EXPECT_EQ(shuffled.mean_first, c.mean_first);
  EXPECT_EQ(shuffled.mean_second, c.mean_second);
  EXPECT_EQ(shuffled.low, c.low);
  EXPECT_EQ(shuffled.high, c.high);
}

Comparison example(double difference, double low, double high, Verdict verdict) {
  Comparison c;
  c.first = "ukf";
  c.second = "pf";
  c.runs = c.used = 200;
  c.difference = difference;
  c.low = low;
  c.high = high;
  c.verdict = verdict;
  return c;
}

TEST(Comparison, SaysItInASentence) {
  EXPECT_EQ(example(0.12, 0.09, 0.16, Verdict::kFirstIsBetter).sentence(), "ukf better than pf by 12 % +-3, n = 200");
  EXPECT_EQ(example(-0.12, -0.16, -0.09, Verdict::kSecondIsBetter).sentence(), "pf better than ukf by 12 % +-3, n = 200");
  EXPECT_EQ(example(0.004, -0.007, 0.012, Verdict::kTie).sentence(), "tie: ukf and pf differ by 0.4 % +-1.1, n = 200");
  EXPECT_EQ(example(-0.004, -0.012, 0.007, Verdict::kTie).sentence(), "tie: ukf and pf differ by 0.4 % +-1.1, n = 200");
  EXPECT_EQ(example(0.80321, 0.7978, 0.81, Verdict::kFirstIsBetter).sentence(), "ukf better than pf by 80.3 % +-0.5, n = 200");
  EXPECT_EQ(example(0.3, 0.06, 0.5, Verdict::kFirstIsBetter).sentence(), "ukf better than pf by 30 % +-24, n = 200");
}

TEST(Comparison, TellsTheRunsThatFailed) {
  std::vector<double> a(40, 1.0), b(40, 2.0);
  b[3] = b[7] = b[39] = kNan;
  EXPECT_EQ(compared(a, b).sentence(),
            "ukf better than pf by 50 % +-0, n = 37; 3 of 40 runs left out: pf was without an estimate");
  a[3] = a[4] = std::numeric_limits<double>::infinity();
  const Comparison c = compared(a, b);
  EXPECT_EQ(c.sentence(),
            "ukf better than pf by 50 % +-0, n = 36; 4 of 40 runs left out: ukf was without an estimate in 2, pf in 3");
  EXPECT_EQ(c.failed_first, 2u);
  EXPECT_EQ(c.failed_second, 3u);
}

TEST(Comparison, GivesNoIntervalToTooFewRuns) {
  const std::vector<double> a(9, 1.0), b(9, 1.25);
  EXPECT_EQ(compared(a, b).sentence(), "ukf and pf differ by 20 % in 9 runs, too few for an interval (at least 10)");
  EXPECT_TRUE(std::isnan(compared(a, b).low));
  EXPECT_EQ(compared({1.0}, {2.0}).sentence(), "ukf and pf differ by 50 % in 1 run, too few for an interval (at least 10)");
  EXPECT_EQ(compared({1.0, 2.0}, {kNan, kNan}).sentence(),
            "ukf and pf cannot be compared: no run has a number of both; 2 of 2 runs left out: pf was without an estimate");
  EXPECT_EQ(compared({}, {}).sentence(), "ukf and pf cannot be compared: no run has a number of both");
}

}  // namespace
}  // namespace slipstream
