#include "common/normal_draws.hpp"

#include <bit>
#include <cmath>
#include <cstring>

#include "common/batch_math.hpp"
#include "common/check.hpp"
#include "common/widest.hpp"

namespace slipstream {

namespace {

// Registers of kWidth generators' words, seen as twice as many short numbers.
template <int kWidth>
struct Short;
template <>
struct Short<2> {
  using Bits [[gnu::vector_size(16)]] = std::uint32_t;
  using Whole [[gnu::vector_size(16)]] = std::int32_t;
  using Real [[gnu::vector_size(16)]] = float;
};
template <>
struct Short<4> {
  using Bits [[gnu::vector_size(32)]] = std::uint32_t;
  using Whole [[gnu::vector_size(32)]] = std::int32_t;
  using Real [[gnu::vector_size(32)]] = float;
};
template <>
struct Short<8> {
  using Bits [[gnu::vector_size(64)]] = std::uint32_t;
  using Whole [[gnu::vector_size(64)]] = std::int32_t;
  using Real [[gnu::vector_size(64)]] = float;
};

// xoshiro256++: the next 64 bits of each generator.
template <int W, typename Words = typename batch::Register<W>::Bits>
inline void draw(Words& s0, Words& s1, Words& s2, Words& s3, typename Short<W>::Bits& random) {
  const Words sum = s0 + s3;
  const Words result = ((sum << std::uint64_t{23}) | (sum >> std::uint64_t{41})) + s0;
  const Words shifted = s1 << std::uint64_t{17};
  s2 ^= s0;
  s3 ^= s1;
  s1 ^= s2;
  s0 ^= s3;
  s2 ^= shifted;
  s3 = (s3 << std::uint64_t{45}) | (s3 >> std::uint64_t{19});
  random = std::bit_cast<typename Short<W>::Bits>(result);
}

// sqrt(-2 log u), u = (k + 1/2) / 2^31 from 31 bits. As batch_math.hpp's; the polynomial is 3e-9 off.
template <int W>
inline void radius_of(const typename Short<W>::Bits& random, typename Short<W>::Real& radius) {
  using Bits = typename Short<W>::Bits;
  using Whole = typename Short<W>::Whole;
  using Real = typename Short<W>::Real;
  constexpr std::uint32_t kOne = 0x3f800000U, kRootHalf = 0x3f3504f3U, kMantissa = 0x007fffffU;
  const Whole k = std::bit_cast<Whole>(random >> 1U);
  const Real u = (__builtin_convertvector(k, Real) + 0.5F) * 0x1p-31F;
  const Bits shifted = std::bit_cast<Bits>(u) + (kOne - kRootHalf);
  const Whole exponent = std::bit_cast<Whole>(shifted >> 23U) - 127;
  const Bits mantissa = (shifted & kMantissa) + kRootHalf;
  const Real m = std::bit_cast<Real>(mantissa);
  const Real s = (m - 1.0F) / (m + 1.0F);
  const Real z = s * s;
  const Real a = (z * 0.147899747F + 0.199943903F) * z + 0.333333425F;
  const Real square = -2.0F * (__builtin_convertvector(exponent, Real) * 0.69314718F + 2.0F * (s + s * (a * z)));
  for (int i = 0; i < 2 * W; ++i) radius[i] = std::sqrt(square[i]);
}

// Of the angle 2 pi random / 2^32; interpolated as batch_math.hpp's log: 1.4e-8 and 1e-9 off.
template <int W>
inline void sine_cosine(const typename Short<W>::Bits& random, typename Short<W>::Real& sine, typename Short<W>::Real& cosine) {
  using Bits = typename Short<W>::Bits;
  using Whole = typename Short<W>::Whole;
  using Real = typename Short<W>::Real;
  constexpr float kRounder = 0x1.8p23F;
  const Real quarters = __builtin_convertvector(std::bit_cast<Whole>(random), Real) * 0x1p-30F;
  const Real rounded = quarters + kRounder;
  const Real r = (quarters - (rounded - kRounder)) * 1.57079633F;
  const Real z = r * r;
  const Real s = r + r * (z * ((z * -0.000195878909F + 0.00833274827F) * z - 0.166666647F));
  const Real c = (((z * 2.45479421e-5F - 0.0013888303F) * z + 0.0416666647F) * z - 0.5F) * z + 1.0F;
  const Bits q = std::bit_cast<Bits>(rounded);
  const Bits odd = 0U - (q & 1U);
  const Bits s_bits = std::bit_cast<Bits>(s), c_bits = std::bit_cast<Bits>(c);
  const Bits first = ((s_bits & ~odd) | (c_bits & odd)) ^ ((q & 2U) << 30U);
  const Bits second = ((c_bits & ~odd) | (s_bits & odd)) ^ (((q + 1U) & 2U) << 30U);
  sine = std::bit_cast<Real>(first);
  cosine = std::bit_cast<Real>(second);
}

}  // namespace

// Generators that share a register go through all blocks together: their states stay in registers.
void NormalDraws::fill(std::span<float> to) {
  SLIPSTREAM_CHECK(to.size() % kBlock == 0);
  with_widest([&](auto width) {
    constexpr int W = width;
    using Words = typename batch::Register<W>::Bits;
    float* const begin = to.data();
    const std::size_t size = to.size();
    for (std::size_t g = 0; g < kGenerators; g += W) {
      Words s[4];
      for (std::size_t k = 0; k < 4; ++k) std::memcpy(&s[k], &state_[k][g], sizeof s[k]);
      for (std::size_t i = 2 * g; i < size; i += kBlock) {
        typename Short<W>::Bits random;
        typename Short<W>::Real radius, sine, cosine;
        draw<W>(s[0], s[1], s[2], s[3], random);
        radius_of<W>(random, radius);
        draw<W>(s[0], s[1], s[2], s[3], random);
        sine_cosine<W>(random, sine, cosine);
        const typename Short<W>::Real first = radius * cosine, second = radius * sine;
        std::memcpy(begin + i, &first, sizeof first);
        std::memcpy(begin + i + kBlock / 2, &second, sizeof second);
      }
      for (std::size_t k = 0; k < 4; ++k) std::memcpy(&state_[k][g], &s[k], sizeof s[k]);
    }
  });
}

}  // namespace slipstream
