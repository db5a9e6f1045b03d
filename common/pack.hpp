// Several numbers that go through the same arithmetic at once: a scalar for models, as dual numbers are, so that one evaluation
// of f(x, u) moves eight particles, or four sigma points.
//
//   (a_1 ... a_n) op (b_1 ... b_n) = (a_1 op b_1 ... a_n op b_n)
//
// n = kCount, in registers of kWidth numbers: 2 on every x86-64, 4 with AVX2, 8 with AVX-512. Each lane has the bits that plain
// doubles would have, whatever the width; only sin, cos, exp and log are those of batch_math.hpp, which have no branches. Code
// that must know which way a lane goes takes both ways and chooses: select_less, clamp, abs, max. Two registers to a pack keep
// a processor busy where each operation waits for the one before.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "common/batch_math.hpp"

namespace slipstream {

// Of two halves; the specialisation below is of one register.
template <int kWidth, int kCount>
class PackOf {
  using Half = PackOf<kWidth, kCount / 2>;

 public:
  static constexpr int kLanes = kCount;

  PackOf() = default;
  PackOf(const Half& first, const Half& second) : first_(first), second_(second) {}
  // Implicit on purpose: `2.0 * x` and `T(0)` read as in the formula.
  template <typename S>
  requires std::is_arithmetic_v<S> PackOf(S all) : first_(all), second_(all) {}

  template <typename S>
  static PackOf load(const S* from) {
    return {Half::load(from), Half::load(from + kCount / 2)};
  }
  void store(double* to) const {
    first_.store(to);
    second_.store(to + kCount / 2);
  }
  void store_whole(std::int32_t* to) const {
    first_.store_whole(to);
    second_.store_whole(to + kCount / 2);
  }
  double operator[](int lane) const { return lane < kCount / 2 ? first_[lane] : second_[lane - kCount / 2]; }

  friend PackOf operator+(const PackOf& a, const PackOf& b) { return {a.first_ + b.first_, a.second_ + b.second_}; }
  friend PackOf operator-(const PackOf& a, const PackOf& b) { return {a.first_ - b.first_, a.second_ - b.second_}; }
  friend PackOf operator*(const PackOf& a, const PackOf& b) { return {a.first_ * b.first_, a.second_ * b.second_}; }
  friend PackOf operator/(const PackOf& a, const PackOf& b) { return {a.first_ / b.first_, a.second_ / b.second_}; }
  friend PackOf operator-(const PackOf& a) { return {-a.first_, -a.second_}; }
  friend PackOf select_less(const PackOf& a, const PackOf& b, const PackOf& yes, const PackOf& no) {
    return {select_less(a.first_, b.first_, yes.first_, no.first_), select_less(a.second_, b.second_, yes.second_, no.second_)};
  }
  friend bool any_less(const PackOf& a, const PackOf& b) {
    return any_less(a.first_, b.first_) || any_less(a.second_, b.second_);
  }
  friend PackOf sqrt(const PackOf& a) { return {sqrt(a.first_), sqrt(a.second_)}; }
  friend PackOf exp(const PackOf& a) { return {exp(a.first_), exp(a.second_)}; }
  friend PackOf log(const PackOf& a) { return {log(a.first_), log(a.second_)}; }
  friend PackOf sin(const PackOf& a) { return {sin(a.first_), sin(a.second_)}; }
  friend PackOf cos(const PackOf& a) { return {cos(a.first_), cos(a.second_)}; }

 private:
  Half first_, second_;
};

template <int kWidth>
class PackOf<kWidth, kWidth> {
  using Lane = typename batch::Register<kWidth>::Real;

 public:
  static constexpr int kLanes = kWidth;

  PackOf() = default;
  // By the register: compilers copy a plain struct in halves, which who loads the whole must wait for.
  PackOf(const PackOf& p) : v_(p.v_) {}
  PackOf& operator=(const PackOf& p) {
    v_ = p.v_;
    return *this;
  }
  template <typename S>
  requires std::is_arithmetic_v<S> PackOf(S all) : v_(Lane{} + static_cast<double>(all)) {}
  PackOf(double a, double b, double c, double d) requires(kWidth == 4) : v_{a, b, c, d} {}

  static PackOf load(const double* from) {
    PackOf p;
    std::memcpy(&p.v_, from, sizeof p.v_);
    return p;
  }
  static PackOf load(const float* from) {
    typename batch::Register<kWidth>::Single single;
    std::memcpy(&single, from, sizeof single);
    return of(__builtin_convertvector(single, Lane));
  }
  void store(double* to) const { std::memcpy(to, &v_, sizeof v_); }
  // The whole part of each, which must fit.
  void store_whole(std::int32_t* to) const {
    const auto whole = __builtin_convertvector(v_, typename batch::Register<kWidth>::Whole);
    std::memcpy(to, &whole, sizeof whole);
  }
  double operator[](int lane) const { return v_[lane]; }
  // As sum_of adds.
  double sum() const requires(kWidth == 4) {
    using Half [[gnu::vector_size(16)]] = double;
    const Half halves = __builtin_shufflevector(v_, v_, 0, 1) + __builtin_shufflevector(v_, v_, 2, 3);
    return halves[0] + halves[1];
  }

  friend PackOf operator+(const PackOf& a, const PackOf& b) { return of(a.v_ + b.v_); }
  friend PackOf operator-(const PackOf& a, const PackOf& b) { return of(a.v_ - b.v_); }
  friend PackOf operator*(const PackOf& a, const PackOf& b) { return of(a.v_ * b.v_); }
  friend PackOf operator/(const PackOf& a, const PackOf& b) { return of(a.v_ / b.v_); }
  friend PackOf operator-(const PackOf& a) { return of(-a.v_); }
  // Lane by lane: a < b ? yes : no.
  friend PackOf select_less(const PackOf& a, const PackOf& b, const PackOf& yes, const PackOf& no) {
    return of(a.v_ < b.v_ ? yes.v_ : no.v_);
  }
  // Whether a < b in any lane.
  friend bool any_less(const PackOf& a, const PackOf& b) {
    return batch::any_of<kWidth>(std::bit_cast<typename batch::Register<kWidth>::Bits>(a.v_ < b.v_));
  }
  friend PackOf sqrt(const PackOf& a) {
    PackOf r;
    for (int i = 0; i < kWidth; ++i) r.v_[i] = std::sqrt(a.v_[i]);
    return r;
  }
  friend PackOf exp(const PackOf& a) { return of(batch::exp_of<kWidth>(a.v_)); }
  friend PackOf log(const PackOf& a) { return of(batch::log_of<kWidth>(a.v_)); }
  friend PackOf sin(const PackOf& a) { return of(batch::sines_cosines_of_turns<kWidth>(a.v_ * kTurnsPerRad).sine); }
  friend PackOf cos(const PackOf& a) { return of(batch::sines_cosines_of_turns<kWidth>(a.v_ * kTurnsPerRad).cosine); }

 private:
  static constexpr double kTurnsPerRad = 0.15915494309189535;

  static PackOf of(const Lane& v) {
    PackOf p;
    p.v_ = v;
    return p;
  }

  Lane v_;
};

template <int W, int N>
PackOf<W, N>& operator+=(PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return a = a + b;
}
template <int W, int N>
PackOf<W, N>& operator-=(PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return a = a - b;
}
template <int W, int N>
PackOf<W, N>& operator*=(PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return a = a * b;
}
template <int W, int N>
PackOf<W, N>& operator/=(PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return a = a / b;
}
// b where a is not a number.
template <int W, int N>
PackOf<W, N> max(const PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return select_less(b, a, a, b);
}
template <int W, int N>
PackOf<W, N> min(const PackOf<W, N>& a, const std::type_identity_t<PackOf<W, N>>& b) {
  return select_less(a, b, a, b);
}
template <int W, int N>
PackOf<W, N> clamp(const PackOf<W, N>& a, double low, double high) {
  const PackOf<W, N> not_above = select_less(high, a, high, a);  // one instruction each, unlike a nested choice
  return select_less(not_above, low, low, not_above);
}
template <int W, int N>
PackOf<W, N> abs(const PackOf<W, N>& a) {
  return select_less(a, 0.0, -a, a);
}
// atan(a) = 8 atan(y): y = a / (1 + sqrt(1 + a^2)) halves the angle; three times brings |y| below tan(pi/16) = 0.199. There its
// series to the eleventh term: what is left out is below 1e-17. Within 3 units of the last digit.
template <int W, int N>
PackOf<W, N> atan(const PackOf<W, N>& a) {
  PackOf<W, N> y = clamp(a, -1e100, 1e100);  // whose square is finite; the angle is pi/2 to the last bit
  for (int half = 0; half < 3; ++half) y = y / (1.0 + sqrt(1.0 + y * y));
  const PackOf<W, N> z = y * y;
  PackOf<W, N> sum = 1.0 / 23.0;
  for (int k = 21; k >= 1; k -= 2) sum = 1.0 / k - z * sum;
  return 8.0 * (y * sum);
}
// Of all lanes, added in pairs: in the same order for every width.
template <int W, int N>
double sum_of(const PackOf<W, N>& a) {
  double lane[N];
  a.store(lane);
  for (int half = N / 2; half > 0; half /= 2)
    for (int i = 0; i < half; ++i) lane[i] += lane[i + half];
  return lane[0];
}

using Pack = PackOf<4, 4>;

}  // namespace slipstream

namespace Eigen {
template <int W, int N>
struct NumTraits<slipstream::PackOf<W, N>> : GenericNumTraits<slipstream::PackOf<W, N>> {
  using Real = slipstream::PackOf<W, N>;
  using NonInteger = slipstream::PackOf<W, N>;
  using Nested = slipstream::PackOf<W, N>;
  using Literal = double;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 4, AddCost = 4, MulCost = 4 };
};
}  // namespace Eigen
