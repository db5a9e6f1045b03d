// Elementary functions without branches or library calls, so that a loop over an array of them vectorises (g++ 12 leaves calls
// to the C library scalar) and gives the same bits with every vector length and C library.
//
//   exp x = 2^k e^r,      r = x - k ln 2, |r| <= ln 2 / 2      Taylor series to r^13
//   log x = k ln 2 + 2 artanh s,  s = (m - 1)/(m + 1), x = 2^k m, m in [sqrt 1/2, sqrt 2)      series to s^21
//   sin, cos of 2 pi t:   quarter turns taken off, the rest in +-pi/4          Taylor series to the 17th and 16th power
//
// The first term left out is below 1e-17 of the result: what remains is rounding, a few units in the last place.
// Abramowitz and Stegun, Handbook of Mathematical Functions (1964), 4.1.27, 4.2.1, 4.3.65, 4.3.66.
#pragma once

#include <bit>
#include <cstdint>

namespace slipstream::batch {

// Adding it rounds to a whole number, which then stands in the low bits; up to 2^51.
inline constexpr double kRounder = 0x1.8p52;

// For kExpLowest <= x <= 709. 0 below -708.7, where e^x is below the least normal number. Who may have less must clamp in a
// loop of his own: clamped here, compilers make a branch of it.
inline constexpr double kExpLowest = -709.2;  // k is -1023 here, whose bits make the scale 0
inline double exp(double x) {
  constexpr double kLog2E = 1.4426950408889634;
  constexpr double kLn2High = 0x1.62e42fefa38p-1, kLn2Low = 0x1.ef35793c7673p-45;  // k times the first is exact
  const double rounded = x * kLog2E + kRounder;
  const double k = rounded - kRounder;
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double e = 1.0 / 6227020800.0;
  e = e * r + 1.0 / 479001600.0;
  e = e * r + 1.0 / 39916800.0;
  e = e * r + 1.0 / 3628800.0;
  e = e * r + 1.0 / 362880.0;
  e = e * r + 1.0 / 40320.0;
  e = e * r + 1.0 / 5040.0;
  e = e * r + 1.0 / 720.0;
  e = e * r + 1.0 / 120.0;
  e = e * r + 1.0 / 24.0;
  e = e * r + 1.0 / 6.0;
  e = e * r + 0.5;
  e = e * r + 1.0;
  e = e * r + 1.0;
  const double scale = std::bit_cast<double>((std::bit_cast<std::uint64_t>(rounded) + 1023) << 52);
  return e * scale;
}

// For positive normal x.
inline double log(double x) {
  constexpr double kLn2 = 0.6931471805599453;
  constexpr std::uint64_t kOne = 0x3ff0000000000000ULL, kRootHalf = 0x3fe6a09e667f3bcdULL, kMantissa = 0x000fffffffffffffULL;
  const std::uint64_t shifted = std::bit_cast<std::uint64_t>(x) + (kOne - kRootHalf);
  const double k = std::bit_cast<double>((shifted >> 52) | 0x4330000000000000ULL) - (0x1.0p52 + 1023.0);
  const double m = std::bit_cast<double>((shifted & kMantissa) + kRootHalf);
  const double s = (m - 1.0) / (m + 1.0);
  const double z = s * s;
  double a = 1.0 / 21.0;
  a = a * z + 1.0 / 19.0;
  a = a * z + 1.0 / 17.0;
  a = a * z + 1.0 / 15.0;
  a = a * z + 1.0 / 13.0;
  a = a * z + 1.0 / 11.0;
  a = a * z + 1.0 / 9.0;
  a = a * z + 1.0 / 7.0;
  a = a * z + 1.0 / 5.0;
  a = a * z + 1.0 / 3.0;
  return k * kLn2 + (2.0 * s + 2.0 * s * (a * z));
}

struct SineCosine {
  double sine, cosine;
};

// Of the angle 2 pi t; |t| up to 2^48.
inline SineCosine sine_cosine_of_turns(double t) {
  constexpr double kQuarter = 1.5707963267948966;
  const double rounded = 4.0 * t + kRounder;
  const double r = (4.0 * t - (rounded - kRounder)) * kQuarter;
  const double z = r * r;
  double s = 1.0 / 355687428096000.0;
  s = s * z - 1.0 / 1307674368000.0;
  s = s * z + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  s = r + r * (s * z);
  double c = 1.0 / 20922789888000.0;
  c = c * z - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  c = c * z - 0.5;
  c = c * z + 1.0;
  // After q quarter turns sine and cosine have changed places q times, and signs as the quadrant says.
  const std::uint64_t q = std::bit_cast<std::uint64_t>(rounded);
  const std::uint64_t odd = 0ULL - (q & 1U);
  const std::uint64_t sine = std::bit_cast<std::uint64_t>(s), cosine = std::bit_cast<std::uint64_t>(c);
  return {std::bit_cast<double>(((sine & ~odd) | (cosine & odd)) ^ ((q & 2U) << 62)),
          std::bit_cast<double>(((cosine & ~odd) | (sine & odd)) ^ (((q + 1U) & 2U) << 62))};
}

}  // namespace slipstream::batch
