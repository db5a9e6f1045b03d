// The scores, each defined here before it is used: pure functions on series. They know no message, no file and no estimator.
//
// NaN means "not known" in every series; what is not known is not scored. A score that does not exist is NaN too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/types.hpp"
#include "monitor/statistics.hpp"

namespace slipstream {

// How far a truth sample may be from an instant that it is interpolated to.
inline constexpr Utime kMaxTruthGap = 200'000;

// Truth at the instant t from samples (t_i, y_i), t_i increasing:
//   y_i                                               if t = t_i
//   y_i + (y_(i+1) - y_i) (t - t_i)/(t_(i+1) - t_i)   if t_i < t < t_(i+1), t - t_i <= gap and t_(i+1) - t <= gap
//   NaN                                               otherwise, and where a neighbour is NaN
double truth_at(std::span<const Utime> utime, std::span<const double> value, Utime t, Utime gap = kMaxTruthGap);

// truth_at for every instant of `at`.
std::vector<double> truth_at_all(std::span<const Utime> utime, std::span<const double> value, std::span<const Utime> at,
                                 Utime gap = kMaxTruthGap);

// Over the n samples where both truth y and estimate x are known, e = x - y:
//   RMSE          = sqrt(1/n sum e^2)
//   R2            = 1 - SS_res/SS_tot,  SS_res = sum e^2,  SS_tot = sum (y - mean y)^2;  NaN if SS_tot = 0
//   max_abs_error = max |e|, first reached at sample `max_index`
// R2: 1 is perfect, 0 no better than the mean of the truth, negative worse than that.
struct StateScore {
  std::int64_t samples = 0;
  double rmse;
  double r2;
  double max_abs_error;
  std::size_t max_index = 0;
};
StateScore score_state(std::span<const double> truth, std::span<const double> estimate);

// Over the n samples where truth y, estimate x and the bound's variance b (bound.hpp) are known, e = x - y:
//   rmse_bound = sqrt(1/n sum b),  efficiency = sum b / sum e^2;  NaN if sum e^2 = 0
// Efficiency: 1 is best, on the average of many runs; that of a single run scatters around its mean and may exceed 1.
struct BoundScore {
  double rmse_bound;
  double efficiency;
};
BoundScore score_bound(std::span<const double> truth, std::span<const double> estimate, std::span<const double> bound);

// q = e' S^-1 e by Cholesky, S row-major and symmetric; NaN if S is not positive definite or anything is not finite.
//   NEES (normalised estimation error squared): e = estimate - truth, S = P, the estimate's covariance
//   NIS (normalised innovation squared): e = measurement - prediction, S = the innovation's covariance
// For a consistent, linear and Gaussian estimator q is chi-square with dim(e) degrees of freedom, so its mean is dim(e).
double normalised_square(std::span<const double> e, std::span<const double> S);

// The rows and columns `keep` of a row-major n x n matrix.
std::vector<double> sub_block(std::span<const double> matrix, std::size_t n, std::span<const std::size_t> keep);

// Over the N known values q_i of dimension d_i:
//   mean      = sum q / N
//   dimension = sum d / N, which the mean of a consistent estimator is near to
//   band      = [F^-1(0.025; sum d), F^-1(0.975; sum d)] / N, 95 % of the means of such independent values
// Innovations of a good filter are white, so the band is exact for NIS, also where sensors of unequal rates make steps of
// unequal dimension. Estimation errors are correlated in time: within one run the band is too narrow for NEES, it is exact
// over independent runs.
struct Consistency {
  std::int64_t samples = 0;
  double dimension = 0.0;  // fractional where the d_i differ
  double mean;
  Band band;  // NaN without samples
  bool within = false;
};
Consistency score_consistency(std::span<const double> q, std::span<const int> dimension);
Consistency score_consistency(std::span<const double> q, int dimension);  // one for all; kept where nothing is known

// sum q / sum d over the known q, whatever their dimensions: 1 for a consistent estimator, below 1 for a cautious one.
double consistency_ratio(std::span<const double> q, std::span<const int> dimension);

// Percentiles by nearest rank (statistics.hpp) and the number of steps that took longer than the deadline.
struct StepTimes {
  double mean;
  double p50;
  double p99;
  double max;
  std::int64_t deadline_misses = 0;
};
StepTimes score_step_times(const std::vector<double>& step_time_us, double deadline_s);

// Of the KKT residuals of the programs that an estimator solved (estimate.lcm); NaN without any.
struct Residuals {
  std::int64_t programs = 0;
  double p50;
  double p99;
  double max;
};
Residuals score_residuals(const std::vector<double>& kkt_residual);

}  // namespace slipstream
