// Functions for arrays against the C library's in higher precision, and many normal deviates at once.
#include "common/batch_math.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/random.hpp"

namespace slipstream {
namespace {

constexpr double kUlp = std::numeric_limits<double>::epsilon();

TEST(BatchMath, ExpLogSineCosine) {
  RandomStream random(1, 0, "arguments");
  for (int i = 0; i < 100000; ++i) {
    const double x = -700.0 + 1400.0 * random.uniform();
    EXPECT_NEAR(batch::exp(x) / static_cast<double>(std::exp(static_cast<long double>(x))), 1.0, 4.0 * kUlp) << x;
    const double near_one = 1.0 + 0.1 * (random.uniform() - 0.5), y = i % 2 == 0 ? std::exp(x) : near_one;
    const auto log_y = static_cast<double>(std::log(static_cast<long double>(y)));
    EXPECT_NEAR(batch::log(y), log_y, 4.0 * kUlp * std::abs(log_y)) << y;  // units in the last place
    const double turns = 10.0 * (random.uniform() - 0.5);
    const long double angle = 2.0L * 3.14159265358979323846264338328L * static_cast<long double>(turns);
    const batch::SineCosine at = batch::sine_cosine_of_turns(turns);
    EXPECT_NEAR(at.sine, static_cast<double>(std::sin(angle)), 2.0 * kUlp) << turns;
    EXPECT_NEAR(at.cosine, static_cast<double>(std::cos(angle)), 2.0 * kUlp) << turns;
  }
}

TEST(BatchMath, ExpAtItsEnds) {
  EXPECT_EQ(batch::exp(0.0), 1.0);
  EXPECT_EQ(batch::exp(batch::kExpLowest), 0.0);
  EXPECT_EQ(batch::log(1.0), 0.0);
}

TEST(BatchNormals, HaveTheMomentsOfANormal) {
  constexpr std::size_t kCount = 1000001;  // odd: the last has no partner
  RandomStream random(3, 0, "normals");
  std::vector<double> x(kCount);
  random.normals(x);
  double sum[5]{};
  int beyond = 0;
  for (const double v : x) {
    for (int p = 1; p <= 4; ++p) sum[p] += std::pow(v, p) / kCount;
    beyond += std::abs(v) > 2.5758293 ? 1 : 0;
  }
  const double deviation = 1.0 / std::sqrt(kCount);
  EXPECT_NEAR(sum[1], 0.0, 4.0 * deviation);                    // four deviations each: of x
  EXPECT_NEAR(sum[2], 1.0, 4.0 * std::sqrt(2.0) * deviation);   // of x^2
  EXPECT_NEAR(sum[3], 0.0, 4.0 * std::sqrt(15.0) * deviation);  // of x^3
  EXPECT_NEAR(sum[4], 3.0, 4.0 * std::sqrt(96.0) * deviation);  // of x^4
  EXPECT_NEAR(beyond, 0.01 * kCount, 4.0 * std::sqrt(0.0099 * kCount));
  // The two of a pair, and neighbours, do not know each other.
  double pairs = 0.0, neighbours = 0.0;
  for (std::size_t i = 0; i < kCount / 2; ++i) {
    pairs += x[i] * x[i + kCount / 2] / (kCount / 2);
    neighbours += x[i] * x[i + 1] / (kCount / 2);
  }
  EXPECT_NEAR(pairs, 0.0, 4.0 * std::sqrt(2.0) * deviation);
  EXPECT_NEAR(neighbours, 0.0, 4.0 * std::sqrt(2.0) * deviation);
}

TEST(BatchNormals, AreAStreamThatGoesOn) {
  RandomStream at_once(5, 0, "normals"), in_parts(5, 0, "normals");
  std::vector<double> first(10), second(10);
  at_once.normals(first);
  at_once.normals(second);
  EXPECT_NE(first, second);
  std::vector<double> again(10);
  in_parts.normals(again);
  EXPECT_EQ(again, first);
}

}  // namespace
}  // namespace slipstream
