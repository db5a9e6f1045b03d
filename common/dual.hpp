// Forward-mode dual numbers: a value and its gradient with respect to N independent variables.
//
//   (a, a') + (b, b') = (a + b, a' + b')        (a, a') (b, b') = (ab, a'b + ab')        f(a, a') = (f(a), f'(a) a')
//
// Dual<double, N> gives exact Jacobians; nested, Dual<Dual<double, N>, N> gives exact Hessians. N is fixed, so nothing
// is allocated. Comparisons look at the value only. At the kinks of abs, min and max the derivative is that of the
// branch taken.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include "common/lanes.hpp"

namespace slipstream {

template <typename T, int N>
struct Dual {
  T value{};
  Lanes<T, N> grad{};

  constexpr Dual() = default;
  // Implicit on purpose: a constant has zero gradient, so `2.0 * x` and `T(0)` read as in the formula.
  template <typename S>
  requires std::is_arithmetic_v<S>
  constexpr Dual(S constant) : value(static_cast<double>(constant)) {}
  constexpr Dual(const T& v) requires(!std::is_arithmetic_v<T>) : value(v) {}
  constexpr Dual(const T& v, const Lanes<T, N>& g) : value(v), grad(g) {}

  // The i-th independent variable with value v.
  static constexpr Dual variable(const T& v, int i) {
    Dual d;
    d.value = v;
    d.grad.set(static_cast<std::size_t>(i), T(1.0));
    return d;
  }

  constexpr Dual& operator+=(const Dual& b) { return *this = *this + b; }
  constexpr Dual& operator-=(const Dual& b) { return *this = *this - b; }
  constexpr Dual& operator*=(const Dual& b) { return *this = *this * b; }
  constexpr Dual& operator/=(const Dual& b) { return *this = *this / b; }
  constexpr Dual& operator*=(double s) { return *this = *this * s; }

  friend constexpr Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.grad + b.grad}; }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.grad - b.grad}; }
  friend constexpr Dual operator-(const Dual& a) { return {-a.value, a.grad * -1.0}; }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.grad * b.value + b.grad * a.value};
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const T inverse = T(1.0) / b.value;
    const T quotient = a.value * inverse;
    return {quotient, (a.grad - b.grad * quotient) * inverse};
  }

  // A double factor or term needs no product rule: the models are full of them.
  friend constexpr Dual operator*(const Dual& a, double s) { return {a.value * s, a.grad * s}; }
  friend constexpr Dual operator*(double s, const Dual& a) { return a * s; }
  friend constexpr Dual operator/(const Dual& a, double s) { return a * (1.0 / s); }
  friend constexpr Dual operator+(const Dual& a, double s) { return {a.value + s, a.grad}; }
  friend constexpr Dual operator+(double s, const Dual& a) { return a + s; }
  friend constexpr Dual operator-(const Dual& a, double s) { return {a.value - s, a.grad}; }
  friend constexpr Dual operator-(double s, const Dual& a) { return {s - a.value, a.grad * -1.0}; }

  // Neither does a factor or term of the underlying scalar (a pack of inputs, say).
  friend constexpr Dual operator*(const Dual& a, const T& s) requires(!std::is_arithmetic_v<T>) {
    return {a.value * s, a.grad * s};
  }
  friend constexpr Dual operator*(const T& s, const Dual& a) requires(!std::is_arithmetic_v<T>) { return a * s; }
  friend constexpr Dual operator/(const Dual& a, const T& s) requires(!std::is_arithmetic_v<T>) { return a * (T(1.0) / s); }
  friend constexpr Dual operator+(const Dual& a, const T& s) requires(!std::is_arithmetic_v<T>) {
    return {a.value + s, a.grad};
  }
  friend constexpr Dual operator+(const T& s, const Dual& a) requires(!std::is_arithmetic_v<T>) { return a + s; }
  friend constexpr Dual operator-(const Dual& a, const T& s) requires(!std::is_arithmetic_v<T>) {
    return {a.value - s, a.grad};
  }
  friend constexpr Dual operator-(const T& s, const Dual& a) requires(!std::is_arithmetic_v<T>) {
    return {s - a.value, a.grad * -1.0};
  }

  friend constexpr bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend constexpr bool operator>(const Dual& a, const Dual& b) { return b < a; }
  friend constexpr bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend constexpr bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }
  friend constexpr bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
};

// a < b ? yes : no, for scalars that are one number or several (pack.hpp).
inline double select_less(double a, double b, double yes, double no) { return a < b ? yes : no; }
// x inside [low, high], else the end that is nearer.
inline double clamp(double x, double low, double high) { return x < low ? low : high < x ? high : x; }
template <typename T, int N>
Dual<T, N> clamp(const Dual<T, N>& x, double low, double high) {
  return x < low ? Dual<T, N>(low) : Dual<T, N>(high) < x ? Dual<T, N>(high) : x;
}

// The plain value underneath any depth of nesting.
inline double value_of(double x) { return x; }
template <typename T, int N>
double value_of(const Dual<T, N>& x) {
  return value_of(x.value);
}

namespace dual_detail {
// f(a) with outer derivative df.
template <typename T, int N>
Dual<T, N> chain(const Dual<T, N>& a, const T& f, const T& df) {
  return {f, a.grad * df};
}
}  // namespace dual_detail

template <typename T, int N>
Dual<T, N> sqrt(const Dual<T, N>& a) {
  using std::sqrt;
  const T root = sqrt(a.value);
  return dual_detail::chain(a, root, T(0.5) / root);
}
template <typename T, int N>
Dual<T, N> sin(const Dual<T, N>& a) {
  using std::cos, std::sin;
  return dual_detail::chain(a, T(sin(a.value)), T(cos(a.value)));
}
template <typename T, int N>
Dual<T, N> cos(const Dual<T, N>& a) {
  using std::cos, std::sin;
  return dual_detail::chain(a, T(cos(a.value)), T(-sin(a.value)));
}
template <typename T, int N>
Dual<T, N> tan(const Dual<T, N>& a) {
  using std::tan;
  const T t = tan(a.value);
  return dual_detail::chain(a, t, T(T(1.0) + t * t));
}
template <typename T, int N>
Dual<T, N> atan(const Dual<T, N>& a) {
  using std::atan;
  return dual_detail::chain(a, T(atan(a.value)), T(T(1.0) / (T(1.0) + a.value * a.value)));
}
template <typename T, int N>
Dual<T, N> exp(const Dual<T, N>& a) {
  using std::exp;
  const T e = exp(a.value);
  return dual_detail::chain(a, e, e);
}
template <typename T, int N>
Dual<T, N> abs(const Dual<T, N>& a) {
  return value_of(a) < 0.0 ? -a : a;
}

}  // namespace slipstream

namespace Eigen {
template <typename T, int N>
struct NumTraits<slipstream::Dual<T, N>> : GenericNumTraits<slipstream::Dual<T, N>> {
  using Real = slipstream::Dual<T, N>;
  using NonInteger = slipstream::Dual<T, N>;
  using Nested = slipstream::Dual<T, N>;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = N + 1,
    AddCost = N + 1,
    MulCost = 3 * N + 1
  };
};
template <typename T, int N, typename BinaryOp>
struct ScalarBinaryOpTraits<slipstream::Dual<T, N>, double, BinaryOp> {
  using ReturnType = slipstream::Dual<T, N>;
};
template <typename T, int N, typename BinaryOp>
struct ScalarBinaryOpTraits<double, slipstream::Dual<T, N>, BinaryOp> {
  using ReturnType = slipstream::Dual<T, N>;
};
}  // namespace Eigen
