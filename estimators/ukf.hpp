// Unscented Kalman filter that keeps its covariance P, and draws its points along the columns of P's triangular factor
// (equations in unscented.hpp).
//
//   P = sum of squares,   L: L L' = P, lower triangular
//
// Where a pivot is rounding against its diagonal the column is zero: a direction without variance.
#pragma once

#include <Eigen/Dense>

#include "estimators/unscented.hpp"

namespace slipstream {

template <int N>
class SquaredSpread {
  static constexpr double kDigits = 1e-14;  // of a pivot against its diagonal: what the subtractions leave of a zero

 public:
  void start(const Matrix<double, N>& p) { p_ = p; }

  // P = rows rows' + diag(variance) + g c c'; false where g c c' had to be left out.
  template <int Packs>
  bool assign(const RowPacks<N, Packs>& rows, const Vector<double, N>& variance, double g, const Vector<double, N>& c) {
    for (int i = 0; i < N; ++i)
      for (int j = 0; j <= i; ++j) {
        const double p = rows.dot(i, j) + g * (c[i] * c[j]);
        p_(i, j) = p_(j, i) = i == j ? p + variance[i] : p;
      }
    if (g >= 0.0) return true;
    double l[N][N];
    if (factor(l)) return true;
    assign(rows, variance, 0.0, c);
    return false;
  }

  void root(RowPacks<N, packs_of(N)>& rows) const {
    double l[N][N];
    factor(l);
    for (int i = 0; i < N; ++i)
      for (int g = 0; g < packs_of(N); ++g) rows.at[i][g] = pack_of<N>(g, [&](int k) { return k <= i ? l[i][k] : 0.0; });
  }

  void covariance(Matrix<double, N>& p) const { p = p_; }

  // to = a P^-1
  template <int Rows>
  void divide(const Matrix<double, Rows, N>& a, Matrix<double, Rows, N>& to) const {
    if constexpr (N <= 4) {
      to = a.lazyProduct(Matrix<double, N>(p_.inverse()));  // closed form
    } else {
      to = p_.llt().solve(a.transpose()).transpose();
    }
  }

 private:
  // By L D L', so that the root of a pivot is not waited for by the next. False if P is indefinite; what is not finite goes on.
  bool factor(double (&l)[N][N]) const {
    bool semidefinite = true;
    double rest[N][N];
    for (int i = 0; i < N; ++i)
      for (int j = 0; j <= i; ++j) rest[i][j] = p_(i, j);
    for (int c = 0; c < N; ++c) {
      const double pivot = rest[c][c];
      const double zero = kDigits * std::abs(p_(c, c));
      semidefinite &= !(pivot < -zero);
      const bool none = pivot <= zero;
      const double inverse = none ? 0.0 : 1.0 / pivot;
      const double root = none ? 0.0 : std::sqrt(pivot);
      l[c][c] = root;
      for (int r = c + 1; r < N; ++r) {
        const double share = rest[r][c] * inverse;
        for (int k = c + 1; k <= r; ++k) rest[r][k] -= share * rest[k][c];
        l[r][c] = share * root;
      }
    }
    return semidefinite;
  }

  Matrix<double, N> p_ = Matrix<double, N>::Zero();
};

template <ProcessModel M>
using Ukf = Unscented<M, SquaredSpread>;

}  // namespace slipstream
