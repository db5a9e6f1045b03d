// Packs of every width against plain doubles, lane by lane and bit by bit, and many normal deviates at once.
#include "common/pack.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "common/dual.hpp"
#include "common/normal_draws.hpp"
#include "common/widest.hpp"

namespace slipstream {
namespace {

constexpr int kLanes = 16;
using Numbers = std::array<double, kLanes>;

// Some algebra with every operation that models use.
template <typename T>
T formula(const T& a, const T& b) {
  using std::abs, std::sqrt;
  T c = (2.0 * a + b * b - a / (b * b + 1.0)) * -a;
  c += sqrt(a * a + 1.0);
  c -= clamp(a, -0.5, 0.75);
  c *= abs(b);
  c /= 3.0;
  return select_less(a, b, c, -c);
}

struct WidthGuard {
  explicit WidthGuard(int at_most) { widest_detail::at_most = at_most; }
  ~WidthGuard() { widest_detail::at_most = 8; }
};

Numbers random_numbers(const char* name) {
  RandomStream random(1, 0, name);
  Numbers x{};
  for (double& v : x) v = 4.0 * random.uniform() - 2.0;
  return x;
}

TEST(Pack, ArcTangentIsThatOfTheLibrary) {
  for (double x = 1e-9; x < 1e9; x *= 1.7) {
    const Pack y = atan(Pack(x)), minus = atan(Pack(-x));
    EXPECT_NEAR(y[0], std::atan(x), 7e-16 * std::atan(x)) << x;  // 3 units of the last digit
    EXPECT_EQ(minus[0], -y[0]);
  }
  EXPECT_EQ(atan(Pack(0.0))[0], 0.0);
  EXPECT_NEAR(atan(Pack(1e300))[0], 1.5707963267948966, 7e-16);
}

TEST(Pack, EveryWidthHasTheBitsOfPlainNumbers) {
  const Numbers a = random_numbers("a"), b = random_numbers("b");
  for (const int at_most : {2, 4, 8}) {
    const WidthGuard guard(at_most);
    Numbers plain{}, algebra{}, functions{};
    double total = 0.0;
    bool below = false, nowhere = true;
    with_widest([&](auto width) {
      using P = PackOf<width, kLanes>;
      EXPECT_LE(width, at_most);
      const P x = P::load(a.data()), y = P::load(b.data());
      formula(x, y).store(algebra.data());
      (exp(x) + log(abs(y) + 0.1) + sin(3.0 * x) * cos(y)).store(functions.data());
      total = sum_of(x);
      below = any_less(x, P(a[11] + 1e-9));
      nowhere = any_less(x, P(-2.0));
    });
    for (std::size_t i = 0; i < kLanes; ++i) {
      plain[i] = formula(a[i], b[i]);
      constexpr double kTurnsPerRad = 0.15915494309189535;
      EXPECT_EQ(functions[i], batch::exp(a[i]) + batch::log(std::abs(b[i]) + 0.1) +
                                  batch::sine_cosine_of_turns(3.0 * a[i] * kTurnsPerRad).sine *
                                      batch::sine_cosine_of_turns(b[i] * kTurnsPerRad).cosine);
    }
    EXPECT_EQ(algebra, plain);
    Numbers sum = a;  // in pairs, whatever the width
    for (std::size_t half = kLanes / 2; half > 0; half /= 2)
      for (std::size_t i = 0; i < half; ++i) sum[i] += sum[i + half];
    EXPECT_EQ(total, sum[0]);
    EXPECT_TRUE(below);
    EXPECT_FALSE(nowhere);
  }
}

TEST(Pack, WhatIsNoNumberChoosesTheSecond) {
  const double nan = std::nan("");
  with_widest([&](auto width) {
    using P = PackOf<width, kLanes>;
    EXPECT_EQ(max(P(nan), 3.0)[0], 3.0);
    EXPECT_EQ(min(P(nan), 3.0)[5], 3.0);
    EXPECT_TRUE(std::isnan(clamp(P(nan), 0.0, 1.0)[7])) << "a lost particle must stay one";
  });
}

std::vector<float> deviates(std::size_t count, int at_most, const char* name = "normals") {
  const WidthGuard guard(at_most);
  RandomStream start(3, 0, name);
  NormalDraws draws(start);
  std::vector<float> x(count);
  draws.fill({x.data(), count / 2});
  draws.fill({x.data() + count / 2, count / 2});
  return x;
}

// xoshiro256++ (Blackman and Vigna) and Box and Muller's form in double precision, written out.
TEST(NormalDraws, AreBoxAndMullersOfTheGenerator) {
  RandomStream start(3, 0, "normals");
  std::array<std::array<std::uint64_t, 8>, 4> s{};
  for (auto& word : s)
    for (std::uint64_t& lane : word) lane = start.bits();
  const auto rotate = [](std::uint64_t x, int by) { return (x << by) | (x >> (64 - by)); };
  const auto next = [&](std::size_t g) {
    const std::uint64_t result = rotate(s[0][g] + s[3][g], 23) + s[0][g], t = s[1][g] << 17;
    s[2][g] ^= s[0][g], s[3][g] ^= s[1][g], s[1][g] ^= s[2][g], s[0][g] ^= s[3][g], s[2][g] ^= t;
    s[3][g] = rotate(s[3][g], 45);
    return result;
  };
  const std::vector<float> x = deviates(64 * NormalDraws::kBlock, 8);
  for (std::size_t block = 0; block < 64; ++block)
    for (std::size_t g = 0; g < 8; ++g) {
      const std::uint64_t first = next(g), second = next(g);
      for (std::size_t half = 0; half < 2; ++half) {
        const auto k = static_cast<std::uint32_t>(first >> (32 * half)) >> 1;
        const auto turn = static_cast<std::int32_t>(static_cast<std::uint32_t>(second >> (32 * half)));
        const double radius = std::sqrt(-2.0 * std::log((k + 0.5) * 0x1p-31)), angle = turn * 0x1p-31 * std::acos(-1.0);
        const std::size_t at = block * NormalDraws::kBlock + 2 * g + half;
        EXPECT_NEAR(x[at], radius * std::cos(angle), 2e-6);  // single precision: some units of 6e-8 of up to 6
        EXPECT_NEAR(x[at + NormalDraws::kBlock / 2], radius * std::sin(angle), 2e-6);
      }
    }
}

TEST(NormalDraws, AreTheSameWithEveryWidthAndAnotherStreamsAreNot) {
  const std::vector<float> x = deviates(1024, 8);
  EXPECT_EQ(deviates(1024, 4), x);
  EXPECT_EQ(deviates(1024, 2), x);
  EXPECT_NE(deviates(1024, 8, "others"), x);
}

TEST(NormalDraws, HaveTheLawOfANormal) {
  constexpr std::size_t kCount = 1U << 22;
  const std::vector<float> x = deviates(kCount, 8);
  double sum[5]{};
  for (const float f : x) {
    const double v = static_cast<double>(f);
    double power = 1.0;
    for (int p = 1; p <= 4; ++p) sum[p] += (power *= v) / kCount;
  }
  const double deviation = 1.0 / std::sqrt(static_cast<double>(kCount));
  EXPECT_NEAR(sum[1], 0.0, 4.0 * deviation);                    // four deviations each: of x
  EXPECT_NEAR(sum[2], 1.0, 4.0 * std::sqrt(2.0) * deviation);   // of x^2
  EXPECT_NEAR(sum[3], 0.0, 4.0 * std::sqrt(15.0) * deviation);  // of x^3
  EXPECT_NEAR(sum[4], 3.0, 4.0 * std::sqrt(96.0) * deviation);  // of x^4
  for (const double limit : {0.01, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5}) {
    const double p = 0.5 * std::erfc(limit / std::sqrt(2.0));
    double above = 0.0, below = 0.0;
    for (const float f : x) {
      above += static_cast<double>(f) > limit ? 1.0 : 0.0;
      below += static_cast<double>(f) < -limit ? 1.0 : 0.0;
    }
    EXPECT_NEAR(above / kCount, p, 4.0 * std::sqrt(p * (1.0 - p)) * deviation) << limit;  // four deviations of a fraction
    EXPECT_NEAR(below / kCount, p, 4.0 * std::sqrt(p * (1.0 - p)) * deviation) << limit;
  }
  // The two of a pair (half a block apart), neighbours, and blocks do not know each other; nor do their squares.
  for (const std::size_t lag : {1U, 2U, 16U, 32U, 64U}) {
    double product = 0.0, squares = 0.0;
    for (std::size_t i = 0; i + lag < kCount; ++i) {
      const double a = static_cast<double>(x[i]), b = static_cast<double>(x[i + lag]);
      product += a * b / kCount;
      squares += (a * a - 1.0) * (b * b - 1.0) / kCount;
    }
    EXPECT_NEAR(product, 0.0, 4.0 * deviation) << lag;        // independent: variance 1
    EXPECT_NEAR(squares, 0.0, 4.0 * 2.0 * deviation) << lag;  // variance 4
  }
}

}  // namespace
}  // namespace slipstream
