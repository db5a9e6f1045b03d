// Random streams: one root seed, one independent stream per name, so that a new sensor leaves the draws of the others alone.
//
// Generator: SplitMix64 (Steele, Lea, Flood 2014), whose state is a counter; a stream is the counter's start, hashed from
// (root seed, run index, name). Normal deviates by the polar method of Marsaglia, our own because std::normal_distribution
// differs between standard libraries; many at once: normal_draws.hpp.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

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

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ULL;

  std::uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace slipstream
