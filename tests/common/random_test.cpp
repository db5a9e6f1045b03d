#include "common/random.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace slipstream {
namespace {

constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15ULL;  // SplitMix64's increment: 2^64 over the golden ratio, odd
constexpr int kDraws = 1'000'000;

// All seeds are fixed, so these tests cannot flicker: a bound of four standard errors is one that a right generator meets
// with probability 0.99994 for the seed that happens to be written here.
constexpr double kSigmas = 4.0;

std::vector<double> draws(RandomStream stream, int n, double (RandomStream::*draw)()) {
  std::vector<double> x(static_cast<std::size_t>(n));
  for (double& value : x) value = (stream.*draw)();
  return x;
}
std::vector<double> normals(std::uint64_t seed, std::uint64_t run, const std::string& name, int n = kDraws) {
  return draws(RandomStream(seed, run, name), n, &RandomStream::normal);
}

double mean_of(const std::vector<double>& x, const std::function<double(double)>& f) {
  double sum = 0.0;
  for (const double v : x) sum += f(v);
  return sum / static_cast<double>(x.size());
}
// Standard error of a mean of n independent values of the given variance.
double standard_error(double variance, std::size_t n) { return std::sqrt(variance / static_cast<double>(n)); }

// The inverse of mix64: xor-shifts undone by repetition, factors by their inverses modulo 2^64 (Newton's iteration).
std::uint64_t inverse(std::uint64_t odd) {
  std::uint64_t x = odd;  // right to 3 bits; each step doubles them
  for (int i = 0; i < 6; ++i) x *= 2 - odd * x;
  return x;
}
std::uint64_t undo_shift(std::uint64_t z, int shift) {
  std::uint64_t x = z;
  for (int i = 0; i < 64 / shift + 1; ++i) x = z ^ (x >> shift);
  return x;
}
std::uint64_t unmix64(std::uint64_t z) {
  z = undo_shift(z, 31) * inverse(0x94d049bb133111ebULL);
  z = undo_shift(z, 27) * inverse(0xbf58476d1ce4e5b9ULL);
  return undo_shift(z, 30);
}

// Known answers of the reference implementation (Vigna, splitmix64.c) for the seed 1234567.
TEST(SplitMix64, KnownAnswers) {
  const std::vector<std::uint64_t> expected{6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL,
                                            4593380528125082431ULL, 16408922859458223821ULL};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(mix64(1234567 + (i + 1) * kGamma), expected[i]) << i;
}

// bits() is the reference generator: undoing the mixing shows a counter that goes up by gamma.
TEST(RandomStream, BitsAreSplitMix64OfACounter) {
  RandomStream stream(7, 3, "sensor.wheel_speed");
  std::uint64_t before = unmix64(stream.bits());
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t now = unmix64(stream.bits());
    ASSERT_EQ(now - before, kGamma) << i;
    before = now;
  }
}

// Published FNV-1a 64 vectors (Noll's test suite), with the finisher.
TEST(Hash64, KnownAnswersOfFnv1a) {
  EXPECT_EQ(unmix64(hash64("")), 0xcbf29ce484222325ULL);
  EXPECT_EQ(unmix64(hash64("a")), 0xaf63dc4c8601ec8cULL);
  EXPECT_EQ(unmix64(hash64("foobar")), 0x85944171f73967e8ULL);
  EXPECT_EQ(unmix64(hash64("\xff")), 0xaf64724c8602eb6eULL);  // a byte above 127 counts as unsigned
}

TEST(RandomStream, UniformIsOf53BitsInTheHalfOpenUnitInterval) {
  RandomStream bits(1, 0, "u"), uniform(1, 0, "u");
  for (int i = 0; i < 1000; ++i) {
    const double u = uniform.uniform();
    EXPECT_EQ(u, std::ldexp(static_cast<double>(bits.bits() >> 11), -53));
    EXPECT_GE(u, 0.0);
    EXPECT_LT(u, 1.0);
  }
}

TEST(RandomStream, UniformMomentsAndBins) {
  const auto u = draws(RandomStream(1, 0, "uniform"), kDraws, &RandomStream::uniform);
  EXPECT_NEAR(mean_of(u, [](double x) { return x; }), 0.5, kSigmas * standard_error(1.0 / 12.0, u.size()));  // 4 s.e.
  EXPECT_NEAR(mean_of(u, [](double x) { return (x - 0.5) * (x - 0.5); }), 1.0 / 12.0,
              kSigmas * standard_error(1.0 / 180.0, u.size()));  // 4 s.e.; E[d^4] - E[d^2]^2 = 1/80 - 1/144
  std::vector<int> bin(100, 0);
  for (const double x : u) ++bin[static_cast<std::size_t>(x * 100.0)];
  double chi_square = 0.0;
  for (const int n : bin) chi_square += (n - 10000.0) * (n - 10000.0) / 10000.0;
  EXPECT_NEAR(chi_square, 99.0, kSigmas * std::sqrt(2.0 * 99.0));  // 99 degrees of freedom: mean 99, variance 2 * 99
}

TEST(RandomStream, NormalMoments) {
  const auto x = normals(1, 0, "sensor.wheel_speed");
  // Moments of N(0,1): 0, 1, 0, 3; their variances 1, 2, 15, 96 (E[x^8] - 9 = 105 - 9). 4 standard errors each.
  EXPECT_NEAR(mean_of(x, [](double v) { return v; }), 0.0, kSigmas * standard_error(1.0, x.size()));
  EXPECT_NEAR(mean_of(x, [](double v) { return v * v; }), 1.0, kSigmas * standard_error(2.0, x.size()));
  EXPECT_NEAR(mean_of(x, [](double v) { return v * v * v; }), 0.0, kSigmas * standard_error(15.0, x.size()));
  EXPECT_NEAR(mean_of(x, [](double v) { return v * v * v * v; }), 3.0, kSigmas * standard_error(96.0, x.size()));
}

// A uniform of the same variance has no value beyond 1.73 and would fail here, as would a sum of a few uniforms beyond 4.
TEST(RandomStream, NormalTailFractionsOnBothSides) {
  const auto x = normals(2, 0, "tails");
  for (const double limit : {0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0}) {
    const double p = 0.5 * std::erfc(limit / std::sqrt(2.0));
    const double tolerance = kSigmas * standard_error(p * (1.0 - p), x.size());  // 4 s.e. of a binomial fraction
    EXPECT_NEAR(mean_of(x, [&](double v) { return v > limit ? 1.0 : 0.0; }), p, tolerance) << limit;
    EXPECT_NEAR(mean_of(x, [&](double v) { return v < -limit ? 1.0 : 0.0; }), p, tolerance) << -limit;
  }
}

double correlation(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag) {
  double sum = 0.0;
  for (std::size_t i = 0; i + lag < a.size(); ++i) sum += a[i + lag] * b[i];
  return sum / static_cast<double>(a.size() - lag);
}

TEST(RandomStream, NamesRunsAndSeedsAreIndependent) {
  const int n = 200'000;
  const auto base = normals(1, 0, "sensor.wheel_speed", n);
  const std::vector<std::pair<std::string, std::vector<double>>> others{
      {"another name", normals(1, 0, "sensor.accelerometer", n)},
      {"a name that differs in one bit", normals(1, 0, "sensor.wheel_speee", n)},
      {"the next run", normals(1, 1, "sensor.wheel_speed", n)},
      {"the next seed", normals(2, 0, "sensor.wheel_speed", n)},
      {"seed and run exchanged", normals(0, 1, "sensor.wheel_speed", n)},
  };
  const double tolerance = kSigmas * standard_error(1.0, base.size());  // products of independent N(0,1) have variance 1
  for (const auto& [what, other] : others) {
    EXPECT_NE(base[0], other[0]) << what;
    for (const std::size_t lag : {0U, 1U, 2U}) EXPECT_NEAR(correlation(base, other, lag), 0.0, tolerance) << what;
  }
  // Within a stream: neighbours, also those that share a pair of the polar method; and their squares.
  for (const std::size_t lag : {1U, 2U, 3U}) {
    EXPECT_NEAR(correlation(base, base, lag), 0.0, tolerance) << lag;
    std::vector<double> square(base.size());
    for (std::size_t i = 0; i < base.size(); ++i) square[i] = base[i] * base[i] - 1.0;
    EXPECT_NEAR(correlation(square, square, lag), 0.0, 2.0 * tolerance) << lag;  // the squares' products have variance 4
  }
}

TEST(RandomStream, NoTwoNamesRunsOrSeedsStartAlike) {
  std::set<std::uint64_t> first;
  std::size_t streams = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    for (std::uint64_t run = 0; run < 20; ++run)
      for (const char* name : {"", "a", "b", "ab", "ba", "sensor.wheel_speed", "sensor.accelerometer"}) {
        first.insert(RandomStream(seed, run, name).bits());
        ++streams;
      }
  EXPECT_EQ(first.size(), streams);  // chance of one accidental pair: 2800^2 / 2^65, so 2e-13
}

TEST(RandomStream, AnotherStreamLeavesTheDrawsOfTheFirstAlone) {
  const auto alone = normals(5, 2, "a", 100);
  RandomStream a(5, 2, "a"), b(5, 2, "b");
  for (const double expected : alone) {
    b.normal();
    b.bits();
    EXPECT_EQ(a.normal(), expected);
  }
}

// The polar method gives two deviates at once: both must be used, and each pair must be the two of one point (u, v):
//   x1 = u f, x2 = v f, f = sqrt(-2 ln s / s), s = u^2 + v^2     (Marsaglia and Bray 1964)
TEST(RandomStream, NormalIsThePolarMethodOnTheStreamsUniforms) {
  RandomStream normal(9, 0, "polar"), uniform(9, 0, "polar");
  int rejected = 0;
  for (int pair = 0; pair < 1000; ++pair) {
    double u = 0.0, v = 0.0, s = 2.0;
    for (;; ++rejected) {
      u = 2.0 * uniform.uniform() - 1.0;
      v = 2.0 * uniform.uniform() - 1.0;
      s = u * u + v * v;
      if (s < 1.0) break;
    }
    const double f = std::sqrt(-2.0 * std::log(s) / s);
    EXPECT_DOUBLE_EQ(normal.normal(), u * f);
    EXPECT_DOUBLE_EQ(normal.normal(), v * f);
  }
  EXPECT_GT(rejected, 0);  // of 1000 points 21 % are expected outside the circle
}

}  // namespace
}  // namespace slipstream
