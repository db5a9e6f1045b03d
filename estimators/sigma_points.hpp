// The scaled sigma points of the unscented transform: where they are, and what they weigh.
//
//   x_0 = x,   x_i+- = x +- r L_i,   P = L L',   r^2 = n + lambda = alpha^2 (n + kappa)
//   w = 1/(2 r^2),   w_0 = lambda/r^2 in the mean,   w_0 + 1 - alpha^2 + beta in the covariance
//
// Written about the point in the middle, y_i = f(x_i), d_i = y_i - y_0, the large negative w_0 cancels:
//
//   mean  y_0 + c,   c = sum w d_i,      covariance  sum w d_i d_i' + (beta - alpha^2) c c'
//
// Every term is positive semidefinite where beta >= alpha^2. alpha in (0, 1] is the spread, kappa a second one, beta tells of
// the fourth moment: 2 is best for a normal distribution. Julier, The Scaled Unscented Transformation (ACC 2002).
//
// L is the triangular factor of a semidefinite P: where a pivot is rounding against its diagonal, the column is zero and draws
// no points - a direction without variance, as at a start at truth or of a state left out.
#pragma once

#include <fmt/format.h>

#include <cmath>

#include "common/refusal.hpp"
#include "common/types.hpp"

namespace slipstream {

struct SigmaPoints {
  double reach = 1.0;   // r
  double weight = 0.5;  // w
  double middle = 0.0;  // beta - alpha^2
};

// Of n dimensions, which the refusal calls `what`.
inline SigmaPoints sigma_points(int n, const char* what, double alpha, double beta, double kappa) {
  if (!(n + kappa > 0.0)) throw Refusal(fmt::format("ukf_kappa = {} must be more than -{}, the number of {}", kappa, n, what));
  const double squared_reach = alpha * alpha * (n + kappa);
  return {std::sqrt(squared_reach), 0.5 / squared_reach, beta - alpha * alpha};
}

// P = L L' by L D L', so that no pivot waits for the root of the last one. False if P is indefinite; what is not finite stays
// so.
template <int N>
bool semidefinite_factor(const Matrix<double, N>& p, double (&l)[N][N]) {
  constexpr double kDigits = 1e-14;  // of a pivot against its diagonal: what up to a score of subtractions leave of a zero
  bool semidefinite = true;
  double rest[N][N];
  for (int i = 0; i < N; ++i)
    for (int j = 0; j <= i; ++j) rest[i][j] = p(i, j);
  for (int c = 0; c < N; ++c) {
    const double pivot = rest[c][c];
    const double zero = kDigits * std::abs(p(c, c));
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

}  // namespace slipstream
