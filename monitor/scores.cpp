#include "monitor/scores.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/check.hpp"

namespace slipstream {
namespace {
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> finite_of(const std::vector<double>& all) {
  std::vector<double> known;
  std::copy_if(all.begin(), all.end(), std::back_inserter(known), [](double x) { return std::isfinite(x); });
  return known;
}
}  // namespace

double truth_at(std::span<const Utime> utime, std::span<const double> value, Utime t, Utime gap) {
  SLIPSTREAM_CHECK(utime.size() == value.size());
  const auto after = std::lower_bound(utime.begin(), utime.end(), t);
  if (after == utime.end()) return kNan;
  const auto i = static_cast<std::size_t>(after - utime.begin());
  if (*after == t) return value[i];
  if (i == 0) return kNan;
  const Utime before_gap = t - utime[i - 1];
  const Utime after_gap = utime[i] - t;
  if (before_gap > gap || after_gap > gap) return kNan;
  const double fraction = static_cast<double>(before_gap) / static_cast<double>(before_gap + after_gap);
  return value[i - 1] + (value[i] - value[i - 1]) * fraction;
}

std::vector<double> truth_at_all(std::span<const Utime> utime, std::span<const double> value, std::span<const Utime> at,
                                 Utime gap) {
  std::vector<double> result;
  result.reserve(at.size());
  for (const Utime t : at) result.push_back(truth_at(utime, value, t, gap));
  return result;
}

StateScore score_state(std::span<const double> truth, std::span<const double> estimate) {
  SLIPSTREAM_CHECK(truth.size() == estimate.size());
  const auto known = [&](std::size_t i) { return std::isfinite(truth[i]) && std::isfinite(estimate[i]); };
  StateScore score{0, kNan, kNan, kNan, 0};
  double truth_sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!known(i)) continue;
    ++score.samples;
    truth_sum += truth[i];
  }
  if (score.samples == 0) return score;
  const double n = static_cast<double>(score.samples);
  const double mean = truth_sum / n;
  double ss_res = 0.0, ss_tot = 0.0;
  score.max_abs_error = -1.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!known(i)) continue;
    const double e = estimate[i] - truth[i];
    ss_res += e * e;
    ss_tot += (truth[i] - mean) * (truth[i] - mean);
    if (std::abs(e) > score.max_abs_error) {
      score.max_abs_error = std::abs(e);
      score.max_index = i;
    }
  }
  score.rmse = std::sqrt(ss_res / n);
  // A constant truth leaves only the rounding of its mean in SS_tot: below (n eps mean)^2 per sample there is no variance.
  const double rounding = n * std::numeric_limits<double>::epsilon() * mean;
  if (ss_tot > n * rounding * rounding) score.r2 = 1.0 - ss_res / ss_tot;
  return score;
}

BoundScore score_bound(std::span<const double> truth, std::span<const double> estimate, std::span<const double> bound) {
  SLIPSTREAM_CHECK(truth.size() == estimate.size() && truth.size() == bound.size());
  double n = 0.0, squares = 0.0, variances = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double e = estimate[i] - truth[i];
    if (!std::isfinite(e) || !std::isfinite(bound[i])) continue;
    n += 1.0;
    squares += e * e;
    variances += bound[i];
  }
  return {n > 0.0 ? std::sqrt(variances / n) : kNan, squares > 0.0 ? variances / squares : kNan};
}

double normalised_square(std::span<const double> e, std::span<const double> S) {
  SLIPSTREAM_CHECK(S.size() == e.size() * e.size());
  if (e.empty()) return kNan;
  const auto n = static_cast<Eigen::Index>(e.size());
  const Eigen::Map<const Eigen::MatrixXd> matrix(S.data(), n, n);  // symmetric: the storage order does not matter
  const Eigen::Map<const Eigen::VectorXd> error(e.data(), n);
  if (!matrix.allFinite() || !error.allFinite()) return kNan;
  const Eigen::LLT<Eigen::MatrixXd> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) return kNan;
  const Eigen::VectorXd whitened = cholesky.matrixL().solve(error);
  const double q = whitened.squaredNorm();
  return std::isfinite(q) ? q : kNan;
}

std::vector<double> sub_block(std::span<const double> matrix, std::size_t n, std::span<const std::size_t> keep) {
  SLIPSTREAM_CHECK(matrix.size() == n * n);
  std::vector<double> block;
  block.reserve(keep.size() * keep.size());
  for (const std::size_t r : keep)
    for (const std::size_t c : keep) block.push_back(matrix[r * n + c]);
  return block;
}

Consistency score_consistency(std::span<const double> q, std::span<const int> dimension) {
  SLIPSTREAM_CHECK(q.size() == dimension.size());
  Consistency score{0, 0.0, kNan, {kNan, kNan}, false};
  double sum = 0.0, dimensions = 0.0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) continue;
    ++score.samples;
    sum += q[i];
    dimensions += dimension[i];
  }
  if (score.samples == 0) return score;
  const double n = static_cast<double>(score.samples);
  score.mean = sum / n;
  score.dimension = dimensions / n;
  score.band = mean_chi_square_band(score.samples, score.dimension);
  score.within = score.band.contains(score.mean);
  return score;
}

Consistency score_consistency(std::span<const double> q, int dimension) {
  Consistency score = score_consistency(q, std::vector<int>(q.size(), dimension));
  score.dimension = dimension;
  return score;
}

double consistency_ratio(std::span<const double> q, std::span<const int> dimension) {
  SLIPSTREAM_CHECK(q.size() == dimension.size());
  double sum = 0.0, dimensions = 0.0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) continue;
    sum += q[i];
    dimensions += dimension[i];
  }
  return dimensions > 0.0 ? sum / dimensions : kNan;
}

StepTimes score_step_times(const std::vector<double>& step_time_us, double deadline_s) {
  StepTimes score{kNan, kNan, kNan, kNan, 0};
  const std::vector<double> known = finite_of(step_time_us);
  if (known.empty()) return score;
  score.mean = std::accumulate(known.begin(), known.end(), 0.0) / static_cast<double>(known.size());
  score.p50 = percentile(known, 0.50);
  score.p99 = percentile(known, 0.99);
  score.max = *std::max_element(known.begin(), known.end());
  if (deadline_s > 0.0)
    score.deadline_misses = std::count_if(known.begin(), known.end(), [&](double t) { return t * 1e-6 > deadline_s; });
  return score;
}

Residuals score_residuals(const std::vector<double>& kkt_residual) {
  const std::vector<double> known = finite_of(kkt_residual);
  if (known.empty()) return {0, kNan, kNan, kNan};
  return {std::ssize(known), percentile(known, 0.50), percentile(known, 0.99), *std::max_element(known.begin(), known.end())};
}

}  // namespace slipstream
