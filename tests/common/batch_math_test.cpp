// Functions for arrays against the C library's in higher precision.
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

}  // namespace
}  // namespace slipstream
