// Four numbers that go through the same arithmetic at once: a scalar for models, as dual numbers are, so that one evaluation of
// f(x, u) moves four particles or sigma points.
//
//   (a_1 ... a_4) op (b_1 ... b_4) = (a_1 op b_1 ... a_4 op b_4)
//
// Each lane has the bits that plain doubles would have, with whatever registers the processor has (two of two lanes, or one of
// four); only sin, cos, exp and log are those of batch_math.hpp, which have no branches. Code that must know which way a lane
// goes takes both ways and chooses: select, clamp, abs.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "common/batch_math.hpp"

namespace slipstream {

class Pack {
  using Lane [[gnu::vector_size(32)]] = double;
  using Mask [[gnu::vector_size(32)]] = long long;

 public:
  static constexpr int kLanes = 4;

  Pack() = default;
  // By the register: compilers copy a plain struct in halves, which who loads the whole must wait for.
  Pack(const Pack& p) : v_(p.v_) {}
  Pack& operator=(const Pack& p) {
    v_ = p.v_;
    return *this;
  }
  // Implicit on purpose: `2.0 * x` and `T(0)` read as in the formula.
  template <typename S>
  requires std::is_arithmetic_v<S> Pack(S all)
      : v_{static_cast<double>(all), static_cast<double>(all), static_cast<double>(all), static_cast<double>(all)} {}

  Pack(double a, double b, double c, double d) : v_{a, b, c, d} {}

  static Pack load(const double* from) {
    Pack p;
    std::memcpy(&p.v_, from, sizeof p.v_);
    return p;
  }
  void store(double* to) const { std::memcpy(to, &v_, sizeof v_); }
  double operator[](int lane) const { return v_[lane]; }
  // (1st + 3rd) + (2nd + 4th)
  double sum() const {
    using Half [[gnu::vector_size(16)]] = double;
    const Half halves = __builtin_shufflevector(v_, v_, 0, 1) + __builtin_shufflevector(v_, v_, 2, 3);
    return halves[0] + halves[1];
  }

  friend Pack operator+(const Pack& a, const Pack& b) { return Pack(a.v_ + b.v_); }
  friend Pack operator-(const Pack& a, const Pack& b) { return Pack(a.v_ - b.v_); }
  friend Pack operator*(const Pack& a, const Pack& b) { return Pack(a.v_ * b.v_); }
  friend Pack operator/(const Pack& a, const Pack& b) { return Pack(a.v_ / b.v_); }
  friend Pack operator-(const Pack& a) { return Pack(-a.v_); }
  Pack& operator+=(const Pack& b) { return *this = *this + b; }
  Pack& operator-=(const Pack& b) { return *this = *this - b; }
  Pack& operator*=(const Pack& b) { return *this = *this * b; }
  Pack& operator/=(const Pack& b) { return *this = *this / b; }

  // Lane by lane: a < b ? yes : no.
  friend Pack select_less(const Pack& a, const Pack& b, const Pack& yes, const Pack& no) {
    return Pack(a.v_ < b.v_ ? yes.v_ : no.v_);
  }
  friend Pack clamp(const Pack& a, double low, double high) { return select_less(a, low, low, select_less(high, a, high, a)); }
  friend Pack sqrt(const Pack& a) {
    Pack r;
    for (int i = 0; i < kLanes; ++i) r.v_[i] = std::sqrt(a.v_[i]);
    return r;
  }
  friend Pack abs(const Pack& a) { return select_less(a, 0.0, -a, a); }
  friend Pack sin(const Pack& a) {
    return of_each(a, [](double x) { return batch::sine_cosine_of_turns(x * kTurnsPerRad).sine; });
  }
  friend Pack cos(const Pack& a) {
    return of_each(a, [](double x) { return batch::sine_cosine_of_turns(x * kTurnsPerRad).cosine; });
  }

 private:
  static constexpr double kTurnsPerRad = 0.15915494309189535;

  explicit Pack(const Lane& v) : v_(v) {}
  template <typename F>
  static Pack of_each(const Pack& a, const F& f) {
    Pack r;
    for (int i = 0; i < kLanes; ++i) r.v_[i] = f(a.v_[i]);
    return r;
  }

  Lane v_;
};

}  // namespace slipstream

namespace Eigen {
template <>
struct NumTraits<slipstream::Pack> : GenericNumTraits<slipstream::Pack> {
  using Real = slipstream::Pack;
  using NonInteger = slipstream::Pack;
  using Nested = slipstream::Pack;
  using Literal = double;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 4, AddCost = 4, MulCost = 4 };
};
}  // namespace Eigen
