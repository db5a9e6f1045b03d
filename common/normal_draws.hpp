// Many normal deviates at once, for filters that draw thousands a step.
//
//   z_1 = sqrt(-2 log u_1) cos(2 pi u_2),   z_2 = sqrt(-2 log u_1) sin(2 pi u_2)
//
// Box and Muller (1958), from 31 and 32 random bits and in single precision: a deviate has seven digits and is at most 6.66,
// which N(0, 1) leaves once in 3e10 draws. Bits: eight xoshiro256++ generators (Blackman and Vigna 2021), each started by a
// SplitMix64 stream, whose 64-bit products registers do not have. The same bits with every register's width.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/random.hpp"

namespace slipstream {

class NormalDraws {
 public:
  static constexpr std::size_t kBlock = 32;

  explicit NormalDraws(RandomStream& start) {
    for (auto& word : state_)
      for (std::uint64_t& lane : word) lane = start.bits();
  }

  // Independent N(0, 1), also of all that were drawn before. The size is a multiple of kBlock.
  void fill(std::span<float> to);

 private:
  static constexpr std::size_t kGenerators = 8;

  std::array<std::array<std::uint64_t, kGenerators>, 4> state_;  // word, generator
};

}  // namespace slipstream
