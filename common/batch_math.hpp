// Elementary functions without branches or library calls, for one number or for all numbers of a register at once (g++ 12
// leaves calls to the C library scalar), with the same bits for every register's width and C library. Polynomials are summed by
// parts that do not wait for each other (Estrin's scheme).
//
//   exp x = 2^k e^r,      r = x - k ln 2, |r| <= ln 2 / 2      1 + r + r^2 q(r), q of degree 9
//   log x = k ln 2 + 2 artanh s,  s = (m - 1)/(m + 1), x = 2^k m, m in [sqrt 1/2, sqrt 2)      s + s^3 a(s^2), a of degree 6
//   sin, cos of 2 pi t:   quarter turns taken off, the rest r in +-pi/4:   r + r^3 s(r^2), s of degree 5, and
//                         1 - r^2/2 + r^4 c(r^2), c of degree 5
//
// The polynomials q, a, s and c interpolate their functions at Chebyshev's nodes, which leaves 2e-17 of the result at most.
// What remains is rounding, a few units in the last place.
// Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 4.1.27, 4.2.1, 4.3.65, 4.3.66.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

// Wide registers are returned in one way where the processor has them and in another where not. All this is inlined.
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

namespace slipstream::batch {

// A register of so many numbers, its bits, and as many short numbers.
template <int kWidth>
struct Register;
template <>
struct Register<1> {
  using Real = double;
  using Bits = std::uint64_t;
};
template <>
struct Register<2> {
  using Real [[gnu::vector_size(16)]] = double;
  using Bits [[gnu::vector_size(16)]] = std::uint64_t;
  using Single [[gnu::vector_size(8)]] = float;
  using Whole [[gnu::vector_size(8)]] = std::int32_t;
};
template <>
struct Register<4> {
  using Real [[gnu::vector_size(32)]] = double;
  using Bits [[gnu::vector_size(32)]] = std::uint64_t;
  using Single [[gnu::vector_size(16)]] = float;
  using Whole [[gnu::vector_size(16)]] = std::int32_t;
};
template <>
struct Register<8> {
  using Real [[gnu::vector_size(64)]] = double;
  using Bits [[gnu::vector_size(64)]] = std::uint64_t;
  using Single [[gnu::vector_size(32)]] = float;
  using Whole [[gnu::vector_size(32)]] = std::int32_t;
};

// Whether any bit is set.
template <int kWidth>
inline bool any_of(const typename Register<kWidth>::Bits& bits) {
  if constexpr (kWidth == 2) {
    return (bits[0] | bits[1]) != 0;
  } else {
    typename Register<kWidth / 2>::Bits half[2];
    std::memcpy(half, &bits, sizeof bits);
    return any_of<kWidth / 2>(half[0] | half[1]);
  }
}

// Adding it rounds to a whole number, which then stands in the low bits; up to 2^51.
inline constexpr double kRounder = 0x1.8p52;

// For kExpLowest <= x <= 709. 0 below -708.7, where e^x is below the least normal number. Who may have less must clamp in a
// loop of his own: clamped here, compilers make a branch of it.
inline constexpr double kExpLowest = -709.2;  // k is -1023 here, whose bits make the scale 0
template <int kWidth>
inline typename Register<kWidth>::Real exp_of(const typename Register<kWidth>::Real& x) {
  using Real = typename Register<kWidth>::Real;
  using Bits = typename Register<kWidth>::Bits;
  constexpr double kLog2E = 1.4426950408889634;
  constexpr double kLn2High = 0x1.62e42fefa38p-1, kLn2Low = 0x1.ef35793c7673p-45;  // k times the first is exact
  const Real rounded = x * kLog2E + kRounder;
  const Real k = rounded - kRounder;
  const Real r = (x - k * kLn2High) - k * kLn2Low;
  const Real r2 = r * r, r4 = r2 * r2;
  const Real low = (1.0 + r) + r2 * (0.5000000000000001 + r * 0.16666666666666669);
  const Real middle =
      (0.041666666666624164 + r * 0.008333333333330065) + r2 * (0.0013888888917196719 + r * 0.00019841269863040545);
  const Real high =
      (2.4801521322368692e-5 + r * 2.7557268480310024e-6) + r2 * (2.7620075879983367e-7 + r * 2.5100375832561234e-8);
  const Real e = low + r4 * (middle + r4 * high);
  const Bits scale = (std::bit_cast<Bits>(rounded) + std::uint64_t{1023}) << std::uint64_t{52};
  return e * std::bit_cast<Real>(scale);
}
inline double exp(double x) { return exp_of<1>(x); }

// For positive normal x.
template <int kWidth>
inline typename Register<kWidth>::Real log_of(const typename Register<kWidth>::Real& x) {
  using Real = typename Register<kWidth>::Real;
  using Bits = typename Register<kWidth>::Bits;
  constexpr double kLn2 = 0.6931471805599453;
  constexpr std::uint64_t kOne = 0x3ff0000000000000ULL, kRootHalf = 0x3fe6a09e667f3bcdULL, kMantissa = 0x000fffffffffffffULL;
  const Bits shifted = std::bit_cast<Bits>(x) + (kOne - kRootHalf);
  const Bits exponent = (shifted >> std::uint64_t{52}) | std::uint64_t{0x4330000000000000ULL};
  const Bits mantissa = (shifted & kMantissa) + kRootHalf;
  const Real k = std::bit_cast<Real>(exponent) - (0x1.0p52 + 1023.0);
  const Real m = std::bit_cast<Real>(mantissa);
  const Real s = (m - 1.0) / (m + 1.0);
  const Real z = s * s;
  const Real z2 = z * z, z4 = z2 * z2;
  const Real low = (0.33333333333333348 + z * 0.19999999999949752) + z2 * (0.14285714312987743 + z * 0.1111110556739754);
  const Real high = (0.090914445626308613 + z * 0.07665860800278021) + z2 * 0.073082248425217031;
  const Real a = low + z4 * high;
  const Real twice = 2.0 * s;
  return k * kLn2 + (twice + twice * (a * z));
}
inline double log(double x) { return log_of<1>(x); }

template <int kWidth>
struct SinesCosines {
  typename Register<kWidth>::Real sine, cosine;
};

// Of the angle 2 pi t; |t| up to 2^48.
template <int kWidth>
inline SinesCosines<kWidth> sines_cosines_of_turns(const typename Register<kWidth>::Real& t) {
  using Real = typename Register<kWidth>::Real;
  using Bits = typename Register<kWidth>::Bits;
  constexpr double kQuarter = 1.5707963267948966;
  const Real rounded = 4.0 * t + kRounder;
  const Real r = (4.0 * t - (rounded - kRounder)) * kQuarter;
  const Real z = r * r;
  const Real z2 = z * z, z4 = z2 * z2;
  const Real s_low =
      (-0.16666666666666666 + z * 0.008333333333330948) + z2 * (-0.00019841269836758574 + z * 2.7557316102552439e-6);
  const Real s_high = -2.5051131845003624e-8 + z * 1.5918129294866608e-10;
  const Real s = r + r * (z * (s_low + z4 * s_high));
  const Real c_low =
      (0.041666666666666664 + z * -0.0013888888888887398) + z2 * (2.4801587298765689e-5 + z * -2.7557317271729793e-7);
  const Real c_high = 2.0876146268403199e-9 + z * -1.1382632425521717e-11;
  const Real c = (1.0 - 0.5 * z) + z2 * (c_low + z4 * c_high);
  // After q quarter turns sine and cosine have changed places q times, and signs as the quadrant says.
  const Bits q = std::bit_cast<Bits>(rounded);
  const Bits odd = std::uint64_t{0} - (q & std::uint64_t{1});
  const Bits sine = std::bit_cast<Bits>(s), cosine = std::bit_cast<Bits>(c);
  const Bits first = ((sine & ~odd) | (cosine & odd)) ^ ((q & std::uint64_t{2}) << std::uint64_t{62});
  const Bits second = ((cosine & ~odd) | (sine & odd)) ^ (((q + std::uint64_t{1}) & std::uint64_t{2}) << std::uint64_t{62});
  return {std::bit_cast<Real>(first), std::bit_cast<Real>(second)};
}
using SineCosine = SinesCosines<1>;
inline SineCosine sine_cosine_of_turns(double t) { return sines_cosines_of_turns<1>(t); }

}  // namespace slipstream::batch
