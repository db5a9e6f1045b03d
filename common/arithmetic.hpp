// How this processor and its C library compute: the same number where their elementary functions agree to the last bit.
//
// Additions and multiplications are the same everywhere (IEEE 754, never contracted), but the library's sin, cos, exp and the
// like have variants for processors with and without fused multiplications, which differ in the last bit. Results that were
// promised to be the same to the bit may be put together only where this number is the same.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "common/random.hpp"

namespace slipstream {

// Of some ten thousand values at points that no variant is tuned for.
inline std::uint64_t arithmetic_fingerprint() {
  std::uint64_t h = 0;
  RandomStream random(0, 0, "arithmetic");
  const auto add = [&](double y) { h = mix64(h ^ std::bit_cast<std::uint64_t>(y)); };
  for (int i = 0; i < 2000; ++i) {
    const double x = 20.0 * random.uniform() - 10.0;
    add(std::sin(x)), add(std::cos(x)), add(std::tan(x)), add(std::atan(x)), add(std::exp(x)), add(std::log(std::abs(x) + 0.1)),
        add(std::pow(std::abs(x), 1.3));
  }
  return h;
}

}  // namespace slipstream
