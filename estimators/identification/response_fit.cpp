#include "estimators/identification/response_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "common/refusal.hpp"

namespace slipstream {
namespace {

double squared_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sum;
}

double spread(const std::vector<double>& z) {
  double mean = 0.0;
  for (const double v : z) mean += v / static_cast<double>(z.size());
  double sum = 0.0;
  for (const double v : z) sum += (v - mean) * (v - mean);
  return sum;
}

// dy/dtheta: central differences over 1e-5 of the value (error 1e-10 relative), or of the box where the value is 0.
Eigen::MatrixXd sensitivities(const FitProblem& p, const std::vector<double>& theta) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(p.measured.size()), static_cast<Eigen::Index>(theta.size()));
  std::vector<double> above, below;
  for (std::size_t i = 0; i < theta.size(); ++i) {
    const double step = 1e-5 * std::max(std::abs(theta[i]), 1e-3 * (p.upper[i] - p.lower[i]));
    std::vector<double> moved = theta;
    moved[i] = theta[i] + step;
    p.response(moved, above);
    moved[i] = theta[i] - step;
    p.response(moved, below);
    const auto column = static_cast<Eigen::Index>(i);
    for (std::size_t k = 0; k < above.size(); ++k)
      result(static_cast<Eigen::Index>(k), column) = (above[k] - below[k]) / (2.0 * step);
  }
  return result;
}

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double>& v) {
  return {v.data(), static_cast<Eigen::Index>(v.size())};
}

}  // namespace

Eigen::MatrixXd bartlett_covariance(const Eigen::MatrixXd& scores, int lag) {
  const Eigen::Index n = scores.rows();
  Eigen::MatrixXd sum = scores.transpose() * scores;
  for (Eigen::Index l = 1; l < std::min<Eigen::Index>(lag, n); ++l) {
    const Eigen::MatrixXd shifted = scores.topRows(n - l).transpose() * scores.bottomRows(n - l);
    sum += (1.0 - static_cast<double>(l) / lag) * (shifted + shifted.transpose());
  }
  return sum;
}

double fixed_fraction_quantile(double q) { return 1.96 + q * (2.9694 + q * (0.4160 - q * 0.5324)); }

ResponseFit fit_response(const FitProblem& p, const SwarmSettings& swarm) {
  const std::size_t n = p.measured.size();
  SLIPSTREAM_CHECK(p.names.size() == p.lower.size());
  if (n < 10 * p.names.size())
    throw Refusal("identification: " + std::to_string(n) + " samples, expected at least 10 for each of " +
                  std::to_string(p.names.size()) + " parameters");
  const double total = spread(p.measured);
  if (!(total > 0.0)) throw Refusal("identification: the measured series does not change");

  std::vector<double> y;
  const auto cost = [&](const std::vector<double>& theta) {
    p.response(theta, y);
    return squared_distance(p.measured, y) / total;
  };
  const SwarmResult found = minimise(cost, p.lower, p.upper, swarm);

  ResponseFit fit;
  fit.r2 = 1.0 - found.value;
  fit.iterations = found.iterations;
  fit.converged = found.converged;
  p.response(found.best, fit.simulated);
  SLIPSTREAM_CHECK(fit.simulated.size() == n);

  const Eigen::MatrixXd Y = sensitivities(p, found.best);
  // In units of their own columns, so that parameters of unlike size are told apart by the data and not by rounding.
  const Eigen::VectorXd size = Y.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = Y * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd A = scaled.transpose() * scaled;
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success || factor.rcond() < 1e-12)
    throw Refusal("identification: the measured series does not tell the parameters apart");
  const Eigen::VectorXd residual = as_vector(p.measured) - as_vector(fit.simulated);
  const int lag = std::clamp(p.lag(found.best), 1, static_cast<int>(n));
  Eigen::MatrixXd S = bartlett_covariance(residual.asDiagonal() * scaled, lag);
  if (p.known_beforehand)
    for (const KnownBeforehand& d : p.known_beforehand(found.best)) {
      SLIPSTREAM_CHECK(d.derivative.size() == n);
      const Eigen::VectorXd g = scaled.transpose() * as_vector(d.derivative);
      S += d.variance * g * g.transpose();
    }
  const Eigen::MatrixXd covariance = factor.solve(factor.solve(S).transpose());
  const double c = fixed_fraction_quantile(static_cast<double>(lag) / static_cast<double>(n));
  for (std::size_t i = 0; i < found.best.size(); ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    fit.parameters.push_back({found.best[i], c * std::sqrt(covariance(j, j)) / size[j]});
  }
  return fit;
}

}  // namespace slipstream
