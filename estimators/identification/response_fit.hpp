// Parameters of a simulated response that come nearest to a measured one, with confidence intervals.
//
//   minimise 1 - R2 = sum (z_k - y_k(theta))^2 / sum (z_k - mean z)^2      by particle swarm
//
//   covariance of theta = A^-1 (S + sum_j var(d_j) g_j g_j') A^-1,   95 % interval = +- c sqrt(its diagonal)
//     A = Y' Y,  Y = dy/dtheta (central differences),  g_j = Y' dy/dd_j
//     S = sum over |l| < L of (1 - |l|/L) sum_k s_k s_(k+l)',  s_k = Y_k (z_k - y_k)
//
// Neighbouring residuals are correlated: the wheel integrates the noise of the current, and a model is never quite right. S
// counts that up to the lag L (Newey and West, Econometrica 55, 1987). c is 1.96 for L << n and grows with L/n because S then
// is itself uncertain: c = 1.96 + 2.9694 q + 0.4160 q^2 - 0.5324 q^3, q = L/n (Kiefer and Vogelsang, Econometric Theory 21,
// 2005). d_j are quantities that were estimated beforehand and taken as known, such as a residual current: an error of theirs
// shifts the whole series and leaves no trace in s.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "estimators/identification/particle_swarm.hpp"

namespace slipstream {

// y(theta), as long as the measured series.
using Response = std::function<void(const std::vector<double>& theta, std::vector<double>& y)>;

struct KnownBeforehand {
  std::vector<double> derivative;  // dy_k/dd at the optimum; as long as the measured series
  double variance = 0.0;
};

struct FitProblem {
  Response response;
  std::vector<double> measured;
  std::vector<std::string> names;  // of the parameters, for whoever prints them
  std::vector<double> lower, upper;
  // Samples over which residuals may be correlated, given the optimum: L above. At least 1.
  std::function<int(const std::vector<double>& theta)> lag;
  std::function<std::vector<KnownBeforehand>(const std::vector<double>& theta)> known_beforehand;  // may be empty
};

struct Interval {
  double value = 0.0;
  double half_width = 0.0;  // 95 %
  bool contains(double x) const { return x >= value - half_width && x <= value + half_width; }
};

struct ResponseFit {
  std::vector<Interval> parameters;
  double r2 = 0.0;
  int iterations = 0;
  bool converged = false;
  std::vector<double> simulated;  // y at the optimum
};

// Refuses fewer than 10 samples per parameter, and a response that does not tell the parameters apart.
ResponseFit fit_response(const FitProblem& problem, const SwarmSettings& swarm);

// S above for scores in rows, L = lag.
Eigen::MatrixXd bartlett_covariance(const Eigen::MatrixXd& scores, int lag);

// c above, for a fraction q = L/n from 0 to 1.
double fixed_fraction_quantile(double fraction);

}  // namespace slipstream
