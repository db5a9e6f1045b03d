// Unscented Kalman filter that keeps its covariance P, and draws its points along the columns of P's triangular factor
// (unscented.hpp).
//
//   P = sum of squares + diag(v) + g c c',   L L' = P
#pragma once

#include <Eigen/Dense>

#include "estimators/unscented.hpp"

namespace slipstream {

template <int N>
class SquaredSpread {
 public:
  void start(const Matrix<double, N>& p) { p_ = p; }

  // P = rows rows' + diag(v) + g c c'. False where it would be indefinite: g c c' is left out then.
  template <int Packs>
  bool assign(const RowPacks<N, Packs>& rows, const Vector<double, N>& v, double g, const Vector<double, N>& c) {
    for (int i = 0; i < N; ++i)
      for (int j = 0; j <= i; ++j) {
        const double p = rows.dot(i, j) + g * (c[i] * c[j]);
        p_(i, j) = p_(j, i) = i == j ? p + v[i] : p;
      }
    double l[N][N];
    if (g >= 0.0 || semidefinite_factor(p_, l)) return true;
    assign(rows, v, 0.0, c);
    return false;
  }

  RowPacks<N, packs_of(N)> root() const {
    double l[N][N];
    semidefinite_factor(p_, l);
    return rows_of(l);
  }

  void covariance_into(Matrix<double, N>& p) const { p = p_; }

  // A P^-1
  template <int Rows>
  Matrix<double, Rows, N> divide(const Matrix<double, Rows, N>& a) const {
    if constexpr (N <= 4) {
      return a.lazyProduct(Matrix<double, N>(p_.inverse()));  // closed form
    } else {
      return p_.llt().solve(a.transpose()).transpose();
    }
  }

 private:
  Matrix<double, N> p_ = Matrix<double, N>::Zero();
};

template <ProcessModel M>
using Ukf = Unscented<M, SquaredSpread>;

}  // namespace slipstream
