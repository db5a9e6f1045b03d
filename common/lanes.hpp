// A short fixed row of N scalars with element-wise arithmetic: the gradient part of a dual number.
//
// For double the row is made of two-wide vectors, which every x86-64 and AArch64 has; compilers do not find them by themselves
// in such short loops. An odd N leaves one lane unused.
#pragma once

#include <array>
#include <cstddef>

namespace slipstream {

template <typename T, int N>
class Lanes {
 public:
  constexpr T operator[](std::size_t i) const { return lane_[i]; }
  constexpr void set(std::size_t i, const T& x) { lane_[i] = x; }

  friend constexpr Lanes operator+(Lanes a, const Lanes& b) {
    for (std::size_t i = 0; i < N; ++i) a.lane_[i] += b.lane_[i];
    return a;
  }
  friend constexpr Lanes operator-(Lanes a, const Lanes& b) {
    for (std::size_t i = 0; i < N; ++i) a.lane_[i] -= b.lane_[i];
    return a;
  }
  template <typename S>
  friend constexpr Lanes operator*(Lanes a, const S& s) {
    for (std::size_t i = 0; i < N; ++i) a.lane_[i] = a.lane_[i] * s;
    return a;
  }

 private:
  std::array<T, N> lane_{};
};

template <int N>
class Lanes<double, N> {
  using Pair [[gnu::vector_size(16)]] = double;
  static constexpr std::size_t kPairs = (N + 1) / 2;

 public:
  double operator[](std::size_t i) const { return pair_[i / 2][i % 2]; }
  void set(std::size_t i, double x) { pair_[i / 2][i % 2] = x; }

  friend Lanes operator+(Lanes a, const Lanes& b) {
    for (std::size_t i = 0; i < kPairs; ++i) a.pair_[i] += b.pair_[i];
    return a;
  }
  friend Lanes operator-(Lanes a, const Lanes& b) {
    for (std::size_t i = 0; i < kPairs; ++i) a.pair_[i] -= b.pair_[i];
    return a;
  }
  friend Lanes operator*(Lanes a, double s) {
    for (std::size_t i = 0; i < kPairs; ++i) a.pair_[i] *= s;
    return a;
  }

 private:
  Pair pair_[kPairs]{};
};

}  // namespace slipstream
