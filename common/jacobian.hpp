// Exact value and Jacobian of a vector function by dual numbers.
#pragma once

#include "common/dual.hpp"
#include "common/types.hpp"

namespace slipstream {

// x with every component an independent variable.
template <typename T, int N>
Vector<Dual<T, N>, N> independent(const Vector<T, N>& x) {
  Vector<Dual<T, N>, N> d;
  for (int i = 0; i < N; ++i) d[i] = Dual<T, N>::variable(x[i], i);
  return d;
}

// y = f(x) and J = df/dx (Rows x N), in one evaluation of f over Dual<T, N>. T may itself be a dual number.
template <int Rows, typename T, int N, typename F>
void value_and_jacobian(const F& f, const Vector<T, N>& x, Vector<T, Rows>& y, Matrix<T, Rows, N>& jacobian) {
  const Vector<Dual<T, N>, Rows> result = f(independent(x));
  for (int r = 0; r < Rows; ++r) {
    y[r] = result[r].value;
    for (int c = 0; c < N; ++c) jacobian(r, c) = result[r].grad[static_cast<std::size_t>(c)];
  }
}

}  // namespace slipstream
