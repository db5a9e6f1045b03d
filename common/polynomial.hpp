// Least-squares polynomial through points, in the scaled abscissa s = x / x_last: sum of c_i s^i, by a QR decomposition of the
// powers.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "common/check.hpp"

namespace slipstream {

// degree + 1 coefficients of s, lowest power first. Needs more points than the degree, and x_last != 0.
inline std::vector<double> fit_polynomial(const std::vector<double>& x, const std::vector<double>& y, int degree) {
  SLIPSTREAM_CHECK(x.size() == y.size() && x.size() > static_cast<std::size_t>(degree) && x.back() != 0.0);
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd powers(n, degree + 1);
  Eigen::VectorXd values(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double s = x[static_cast<std::size_t>(k)] / x.back();
    powers(k, 0) = 1.0;
    for (Eigen::Index i = 1; i <= degree; ++i) powers(k, i) = powers(k, i - 1) * s;
    values[k] = y[static_cast<std::size_t>(k)];
  }
  const Eigen::VectorXd fit = powers.colPivHouseholderQr().solve(values);
  return {fit.data(), fit.data() + fit.size()};
}

}  // namespace slipstream
