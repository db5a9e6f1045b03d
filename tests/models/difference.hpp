// Jacobian by central differences, to be compared with the dual one.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/types.hpp"

namespace slipstream {

template <int Rows, int N, typename F>
Matrix<double, Rows, N> central_difference(const F& f, const Vector<double, N>& x) {
  Matrix<double, Rows, N> jacobian;
  for (int c = 0; c < N; ++c) {
    const double h = 1e-6 * std::max(1.0, std::abs(x[c]));
    Vector<double, N> above = x, below = x;
    above[c] += h;
    below[c] -= h;
    jacobian.col(c) = (Vector<double, Rows>(f(above)) - Vector<double, Rows>(f(below))) / (above[c] - below[c]);
  }
  return jacobian;
}

// Largest difference of the two, as a multiple of what central differences may miss. With h = 1e-6 the truncation is (h / L)^2
// / 6 of the slope where the function bends over the length L; the shortest here is 5e-4 (slip at standstill): 7e-7, taken as
// 5e-6. Rounding is 1e-16 |f| / h, with |f| < 1e4 below 1e-6.
template <int Rows, int N>
double difference_error(const Matrix<double, Rows, N>& dual, const Matrix<double, Rows, N>& difference) {
  double worst = 0.0;
  for (int r = 0; r < Rows; ++r) {
    const double allowed = 5e-6 * difference.row(r).cwiseAbs().maxCoeff() + 1e-6;
    worst = std::max(worst, (dual.row(r) - difference.row(r)).cwiseAbs().maxCoeff() / allowed);
  }
  return worst;
}

}  // namespace slipstream
