// Weights, moments, resampling and credible intervals of weighted sets, against closed forms and definitions.
#include "estimators/particle_set.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "common/random.hpp"
#include "estimators/interval_finder.hpp"

namespace slipstream::test {
namespace {

using State1 = Vector<double, 1>;

constexpr Resampling kMethods[] = {Resampling::kSystematic, Resampling::kStratified, Resampling::kResidual};

std::vector<double> normalised(std::vector<double> w) {
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  for (double& x : w) x /= sum;
  return w;
}
std::vector<double> wild_weights(std::size_t n, RandomStream& random) {
  std::vector<double> w(n);
  for (double& x : w) x = random.uniform() < 0.3 ? 0.0 : std::exp(6.0 * random.uniform());
  w[n / 2] = 1.0;
  return normalised(w);
}
std::vector<std::int32_t> ancestors(Resampling method, const std::vector<double>& w, RandomStream& random, double total = 1.0) {
  Resampler resampler(method, w.size());
  resampler.draw(w, total, random);
  std::vector<std::int32_t> numbers(w.size()), inherited(w.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  resampler.inherit<1>(numbers.data(), inherited.data(), 0);
  return inherited;
}
std::vector<int> offspring(const std::vector<std::int32_t>& ancestors) {
  std::vector<int> count(ancestors.size());
  for (const std::int32_t a : ancestors) ++count[static_cast<std::size_t>(a)];
  return count;
}

TEST(Resampling, OffspringAreAsManyAsTheMethodSays) {
  RandomStream random(1, 0, "weights");
  for (int round = 0; round < 200; ++round)
    for (const Resampling method : kMethods) {
      const std::vector<double> w = wild_weights(1 + static_cast<std::size_t>(random.uniform() * 100.0), random);
      const auto chosen = ancestors(method, w, random);
      EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
      const std::vector<int> count = offspring(chosen);
      const double fewer = method == Resampling::kStratified ? 1.0 : 0.0;
      const double more = method == Resampling::kSystematic ? 0.0 : 1.0;
      for (std::size_t i = 0; i < w.size(); ++i) {
        const double expected = static_cast<double>(w.size()) * w[i];
        EXPECT_GE(count[i], std::floor(expected - 1e-9) - fewer);  // rounding of the cumulated weights
        EXPECT_LE(count[i], std::ceil(expected + 1e-9) + more);
        EXPECT_TRUE(w[i] > 0.0 || count[i] == 0);
      }
    }
}

// 1.5, 1.5, 0.5 and 0.5 offspring. One systematic point u decides all four; of the residual two that are left each falls to one
// of two particles by itself.
TEST(Resampling, ResidualPointsAreIndependentOfEachOther) {
  const std::vector<double> w{0.375, 0.375, 0.125, 0.125};
  RandomStream random(4, 0, "weights");
  std::map<std::vector<int>, int> systematic, residual;
  constexpr int kDraws = 4000;
  for (int k = 0; k < kDraws; ++k) {
    ++systematic[offspring(ancestors(Resampling::kSystematic, w, random))];
    ++residual[offspring(ancestors(Resampling::kResidual, w, random))];
  }
  EXPECT_EQ(systematic.size(), 2u);
  ASSERT_EQ(residual.size(), 4u);
  for (const auto& [count, draws] : residual)
    EXPECT_NEAR(draws, kDraws / 4.0, 4.0 * std::sqrt(kDraws * 3.0 / 16.0));  // binomial
}

TEST(Resampling, OnAverageOffspringAreInProportionToTheWeight) {
  constexpr int kDraws = 40000;
  RandomStream random(2, 0, "weights");
  const std::vector<double> w = wild_weights(30, random);
  for (const Resampling method : kMethods) {
    std::vector<double> sum(w.size());
    for (int k = 0; k < kDraws; ++k) {
      const std::vector<int> count = offspring(ancestors(method, w, random));
      for (std::size_t i = 0; i < w.size(); ++i) sum[i] += count[i];
    }
    // One particle's number of a stratified or residual draw varies by 1/2 at most on the border of either end: variance up to
    // 1/2. Four deviations of the mean of so many draws.
    for (std::size_t i = 0; i < w.size(); ++i) EXPECT_NEAR(sum[i] / kDraws, 30.0 * w[i], 4.0 * std::sqrt(0.5 / kDraws)) << i;
  }
}

TEST(Resampling, WeightsNeedNotHaveTheSumOne) {
  RandomStream random(3, 0, "weights");
  const std::vector<double> w = wild_weights(77, random);
  std::vector<double> thrice = w;
  for (double& x : thrice) x *= 4.0;  // exact
  for (const Resampling method : kMethods) {
    RandomStream a(4, 0, "draws"), b(4, 0, "draws");
    EXPECT_EQ(ancestors(method, w, a), ancestors(method, thrice, b, 4.0));
  }
}

// Document 002, Table 2's own loop, with its own point: zeta_1 = u/N.
TEST(Resampling, SystematicIsTheDocuments) {
  RandomStream random(2, 0, "weights");
  constexpr std::size_t n = 50;
  std::vector<double> w(n);
  for (double& x : w) x = -std::log(1.0 - random.uniform());
  w = normalised(w);
  RandomStream draw(5, 0, "draw"), same(5, 0, "draw");
  const double u = same.uniform();
  const auto chosen = ancestors(Resampling::kSystematic, w, draw);
  std::size_t i = 0;
  double c = w[0];
  for (std::size_t j = 0; j < n; ++j) {
    while ((u + static_cast<double>(j)) / n > c) c += w[++i];
    EXPECT_EQ(chosen[j], static_cast<std::int32_t>(i)) << j;
  }
}

TEST(Resampling, ByNameOfTheTuning) {
  EXPECT_EQ(resampling_named("systematic"), Resampling::kSystematic);
  EXPECT_EQ(resampling_named("stratified"), Resampling::kStratified);
  EXPECT_EQ(resampling_named("residual"), Resampling::kResidual);
}

TEST(ParticleSet, WeightsOfVanishingLikelihoodsAreExact) {
  ParticleSet<1> set(4, Resampling::kSystematic);
  const std::vector<double> l{-1e6, -1e6 - std::log(3.0), -3e6, std::numeric_limits<double>::quiet_NaN()};
  std::copy(l.begin(), l.end(), set.new_log_weights());
  std::fill(set.new_log_weights() + 4, set.new_log_weights() + set.padded(), -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(set.weigh(-1e6, State1(0.0)), 1.0 / (0.75 * 0.75 + 0.25 * 0.25), 1e-9);
  set.normalise();
  const std::vector<double> w(set.weights(), set.weights() + 4);
  EXPECT_NEAR(w[0], 0.75, 1e-10);  // ulp of 1e6
  EXPECT_NEAR(w[1], 0.25, 1e-10);
  EXPECT_EQ(w[2], 0.0);
  EXPECT_EQ(w[3], 0.0);
  EXPECT_NEAR(set.log_weights()[1], std::log(0.25), 1e-9);
  EXPECT_EQ(set.weigh(-std::numeric_limits<double>::infinity(), State1(0.0)), 0.0);
  EXPECT_EQ(std::vector<double>(set.weights(), set.weights() + 4), w);
}

// Points at 1e6 + (0, 1, 2), weights 1 : 2 : 1: mean 1e6 + 1, variance 1/2. About zero, twelve of sixteen digits would be lost.
TEST(ParticleSet, MomentsKeepTheirDigitsFarFromZero) {
  ParticleSet<2> set(3, Resampling::kSystematic);
  for (std::size_t i = 0; i < 3; ++i) {
    set.put(i, {1e6 + static_cast<double>(i), 5.0});
  }
  for (int c = 0; c < 2; ++c) set.repeat_last(set.column(c));
  for (const double near : {0.0, 1e6, 1e6 + 1.0}) {
    std::fill_n(set.new_log_weights(), 3, -std::log(2.0));
    set.new_log_weights()[1] = 0.0;
    std::fill(set.new_log_weights() + 3, set.new_log_weights() + set.padded(), -std::numeric_limits<double>::infinity());
    set.weigh(0.0, {near, 5.0});
    const auto at = set.moments({near, 5.0});
    EXPECT_NEAR(at.mean[0], 1e6 + 1.0, 1e-9);  // ulp of 1e6
    EXPECT_NEAR(at.covariance(0, 0), 0.5, 1e-9);
    EXPECT_EQ(at.covariance(1, 1), 0.0);  // no spread at all
  }
}

TEST(ParticleSet, WhatIsNotFiniteIsReplacedByTheHeaviest) {
  ParticleSet<1> set(3, Resampling::kSystematic);
  for (std::size_t i = 0; i < 3; ++i) {
    set.put(i, State1(static_cast<double>(i)));
    set.new_log_weights()[i] = std::log(1.0 + static_cast<double>(i));
  }
  std::fill(set.new_log_weights() + 3, set.new_log_weights() + set.padded(), -std::numeric_limits<double>::infinity());
  set.weigh(std::log(3.0), State1(0.0));
  set.put(2, State1(std::numeric_limits<double>::quiet_NaN()));
  ASSERT_TRUE(set.replace_lost());
  EXPECT_EQ(set.column(0)[2], 1.0);
  EXPECT_NEAR(set.weights()[0], 1.0 / 3.0, 1e-15);  // rounding
  EXPECT_NEAR(set.weights()[1], 2.0 / 3.0, 1e-15);
  EXPECT_EQ(set.weights()[2], 0.0);
  for (std::size_t i = 0; i < 3; ++i) set.put(i, State1(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(set.replace_lost());
}

TEST(IntervalFinder, TheIntervalIsThatOfTheSortedSet) {
  RandomStream random(3, 0, "set");
  IntervalFinder finder(3000);
  for (const std::size_t n : {1U, 2U, 50U, 3000U})
    for (const bool skew : {true, false}) {
      const std::size_t padded = padded_to_packs(n);
      std::vector<double> x(padded), w(padded, 0.0);
      for (std::size_t i = 0; i < n; ++i) {
        const double z = random.normal();
        x[i] = skew ? std::exp(2.0 * z) : 3.0 + 5.0 * z;  // with far values, or as the finder expects them
        w[i] = random.uniform() + 1e-3;
      }
      std::fill(x.begin() + static_cast<std::ptrdiff_t>(n), x.end(), x[n - 1]);
      w = normalised(w);
      std::vector<std::size_t> order(n);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
      for (const double tail : {0.005, 0.2}) {
        double below = 0.0, above = 0.0;
        std::size_t low = 0, high = n - 1;
        while ((below += w[order[low]]) < tail) ++low;
        while ((above += w[order[high]]) < tail) --high;
        const auto [found_low, found_high] = finder.find({x.data(), n}, {w.data(), n}, 1.0, 3.0, 5.0, tail);
        EXPECT_EQ(found_low, x[order[low]]) << n;
        EXPECT_EQ(found_high, x[order[high]]) << n;
      }
    }
}

}  // namespace
}  // namespace slipstream::test
