// Random streams: one root seed, one independent stream per name, so that a new sensor leaves the draws of the others alone.
//
// Generator: SplitMix64 (Steele, Lea, Flood 2014), whose state is a counter; a stream is the counter's start, hashed from
// (root seed, run index, name). Normal deviates by the polar method of Marsaglia, our own because std::normal_distribution
// differs between standard libraries; many at once by the closed form of Box and Muller (1958), which vectorises.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "common/batch_math.hpp"

namespace slipstream {

inline std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// FNV-1a over the bytes, finished with mix64.
inline std::uint64_t hash64(std::string_view text, std::uint64_t start = 0xcbf29ce484222325ULL) {
  std::uint64_t h = start;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return mix64(h);
}

class RandomStream {
 public:
  RandomStream(std::uint64_t root_seed, std::uint64_t run_index, std::string_view name)
      : state_(hash64(name, mix64(root_seed + 0x9e3779b97f4a7c15ULL) ^ mix64(~run_index))) {}

  std::uint64_t bits() { return mix64(state_ += kStep); }

  // Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

  // Normal with mean 0 and variance 1.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double u = 0.0, v = 0.0, s = 0.0;
    do {
      u = 2.0 * uniform() - 1.0;
      v = 2.0 * uniform() - 1.0;
      s = u * u + v * v;
    } while (s >= 1.0 || s == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(s) / s);
    spare_ = v * factor;
    has_spare_ = true;
    return u * factor;
  }

  // Fills `to` with normal deviates of mean 0 and variance 1, independent of all others of the stream.
  //   z1 = sqrt(-2 log u1) cos(2 pi u2),  z2 = sqrt(-2 log u1) sin(2 pi u2)
  void normals(std::span<double> to) {
    const std::size_t half = to.size() / 2;
    const std::uint64_t start = state_;
    double* const first = to.data();
    double* const second = to.data() + half;
    for (std::size_t i = 0; i < half; ++i) {
      const std::uint64_t at = start + (2 * i + 1) * kStep;
      const double radius = std::sqrt(-2.0 * batch::log(2.0 - one_to_two(mix64(at))));
      const batch::SineCosine angle = batch::sine_cosine_of_turns(one_to_two(mix64(at + kStep)) - 1.0);
      first[i] = radius * angle.cosine;
      second[i] = radius * angle.sine;
    }
    state_ += 2 * half * kStep;
    if (to.size() % 2 != 0) to.back() = normal();
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ULL;

  // Uniform in [1, 2), 52 bits.
  static double one_to_two(std::uint64_t bits) { return std::bit_cast<double>((bits >> 12) | 0x3ff0000000000000ULL); }

  std::uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace slipstream
