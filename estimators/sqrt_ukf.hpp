// Unscented Kalman filter in square-root form: it keeps the triangular factor L of its covariance and never forms P, so that P
// stays positive where its condition is beyond half the digits of a double (unscented.hpp).
//
//   L L' = A A',  A = [rows  sqrt(v)  sqrt(g) c]:   A = L Q,  Q Q' = I, by modified Gram-Schmidt on A's rows
//   g < 0:  L L' = A A' - |g| c c' by a downdate of rank one, where that is positive
//   K = Pxz S^-1:  two triangular solutions
//
// Van der Merwe and Wan, The Square-Root Unscented Kalman Filter (ICASSP 2001), but for the update: they downdate the prior's
// factor by each column of K sqrt(S), which may fail; here A holds the twin of the Joseph form, and all of it is added.
// The triangular factor of modified Gram-Schmidt is as accurate as Householder's: Bjorck, BIT 7 (1967).
#pragma once

#include "estimators/unscented.hpp"

namespace slipstream {

template <int N>
class RootSpread {
  static constexpr int kPacks = packs_of(N);
  static constexpr bool kFull = N % Pack::kLanes == 0;  // no lane is left beside sqrt(v)

 public:
  void start(const Matrix<double, N>& p) { semidefinite_factor(p, l_); }

  // L L' = rows rows' + diag(v) + g c c'. False where that would be indefinite: g c c' is left out then.
  template <int Packs>
  bool assign(const RowPacks<N, Packs>& rows, const Vector<double, N>& v, double g, const Vector<double, N>& c) {
    RowPacks<N, Packs + kPacks + (kFull ? 1 : 0)> a;
    const double root = g > 0.0 ? std::sqrt(g) : 0.0;
    for (int i = 0; i < N; ++i) {
      const double deviation = std::sqrt(v[i]);
      for (int p = 0; p < Packs; ++p) a.at[i][p] = rows.at[i][p];
      for (int p = 0; p < kPacks + (kFull ? 1 : 0); ++p)
        a.at[i][Packs + p] = pack_of<N + 1>(p, [&](int k) { return k == i ? deviation : k == N ? root * c[i] : 0.0; });
    }
    triangularise(a);
    return g >= 0.0 || downdate(std::sqrt(-g) * c);
  }

  RowPacks<N, kPacks> root() const { return rows_of(l_); }

  void covariance_into(Matrix<double, N>& p) const {
    for (int i = 0; i < N; ++i)
      for (int j = 0; j <= i; ++j) {
        double sum = l_[i][0] * l_[j][0];
        for (int k = 1; k <= j; ++k) sum += l_[i][k] * l_[j][k];
        p(i, j) = p(j, i) = sum;
      }
  }

  // A P^-1: x L' = a, y L = x, row by row.
  template <int Rows>
  Matrix<double, Rows, N> divide(const Matrix<double, Rows, N>& a) const {
    Matrix<double, Rows, N> y = a;
    double inverse[N];
    for (int k = 0; k < N; ++k) inverse[k] = 1.0 / l_[k][k];
    for (int r = 0; r < Rows; ++r) {
      for (int k = 0; k < N; ++k) {
        for (int j = 0; j < k; ++j) y(r, k) -= l_[k][j] * y(r, j);
        y(r, k) *= inverse[k];
      }
      for (int k = N - 1; k >= 0; --k) {
        for (int j = k + 1; j < N; ++j) y(r, k) -= l_[j][k] * y(r, j);
        y(r, k) *= inverse[k];
      }
    }
    return y;
  }

 private:
  template <int Packs>
  void triangularise(RowPacks<N, Packs>& a) {
    constexpr double kDigits = 1e-28;  // of a squared length against what it was: rounding of a row that depends on those above
    double before[N];
    for (int i = 0; i < N; ++i) before[i] = a.dot(i, i);
    for (int i = 0; i < N; ++i) {
      const double squared = i == 0 ? before[0] : a.dot(i, i);
      const bool none = squared <= kDigits * before[i];
      const double length = none ? 0.0 : std::sqrt(squared), inverse = none ? 0.0 : 1.0 / length;
      l_[i][i] = length;
      for (int j = i + 1; j < N; ++j) {
        const double along = a.dot(j, i) * inverse;
        for (int p = 0; p < Packs; ++p) a.at[j][p] -= (along * inverse) * a.at[i][p];
        l_[j][i] = along;
      }
    }
  }

  // By hyperbolic rotations; false, and L as it was, where L L' - d d' is not positive.
  bool downdate(Vector<double, N> d) {
    double l[N][N];
    std::copy(&l_[0][0], &l_[0][0] + N * N, &l[0][0]);
    for (int k = 0; k < N; ++k) {
      if (d[k] == 0.0) continue;
      const double squared = (l[k][k] - d[k]) * (l[k][k] + d[k]);
      if (squared <= 0.0) return false;
      const double root = std::sqrt(squared), cosine = root / l[k][k], sine = d[k] / l[k][k];
      l[k][k] = root;
      for (int i = k + 1; i < N; ++i) {
        l[i][k] = (l[i][k] - sine * d[i]) / cosine;
        d[i] = cosine * d[i] - sine * l[i][k];
      }
    }
    std::copy(&l[0][0], &l[0][0] + N * N, &l_[0][0]);
    return true;
  }

  double l_[N][N]{};
};

template <ProcessModel M>
using SqrtUkf = Unscented<M, RootSpread>;

}  // namespace slipstream
