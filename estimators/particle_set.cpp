#include "estimators/particle_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/batch_math.hpp"

// Compiled twice, the wider for processors that have it; chosen when the program starts (which sanitizers do not survive).
#if defined(__x86_64__) && defined(__linux__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SLIPSTREAM_WIDE [[gnu::target_clones("avx2", "default"), gnu::flatten]]
#else
#define SLIPSTREAM_WIDE
#endif

namespace slipstream {

namespace {

// -infinity if none is a number.
double lane_greatest(std::size_t n, const double* x) {
  constexpr std::size_t kLanes = 8;
  double lane[kLanes];
  std::fill_n(lane, kLanes, -std::numeric_limits<double>::infinity());
  const std::size_t whole = n - n % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) lane[k] = x[i + k] > lane[k] ? x[i + k] : lane[k];
  for (std::size_t i = whole; i < n; ++i) lane[0] = x[i] > lane[0] ? x[i] : lane[0];
  return *std::max_element(lane, lane + kLanes);
}

}  // namespace

SLIPSTREAM_WIDE
void weigh_by_normal(double z, const NoiseLaw& law, std::span<const double> h, std::span<double> log_weight) {
  constexpr double kLeastVariance = 1e-300;  // where the law is relative and h is 0; else lost in rounding
  const NoiseLaw noise = law;
  const std::size_t n = h.size();
  const double* const from = h.data();
  double* const l = log_weight.data();
  for (std::size_t i = 0; i < n; ++i) {
    const double r = noise.variance(from[i]) + kLeastVariance;
    l[i] -= 0.5 * ((z - from[i]) * (z - from[i]) / r + batch::log(r));
  }
}

SLIPSTREAM_WIDE
void disturb_normally(RandomStream& random, double sigma, std::span<double> x, std::span<double> xi) {
  random.normals(xi);
  const std::size_t n = x.size();
  double* const to = x.data();
  const double* const draw = xi.data();
  for (std::size_t i = 0; i < n; ++i) to[i] += sigma * draw[i];
}

SLIPSTREAM_WIDE
double normalise(std::span<double> log_weight, std::span<double> weight) {
  const std::size_t n = log_weight.size();
  double* const l = log_weight.data();
  double* const w = weight.data();
  const double greatest = lane_greatest(n, l);
  if (!std::isfinite(greatest)) return 0.0;
  for (std::size_t i = 0; i < n; ++i) w[i] = l[i] - greatest > batch::kExpLowest ? l[i] - greatest : batch::kExpLowest;
  for (std::size_t i = 0; i < n; ++i) w[i] = batch::exp(w[i]);
  const double sum = lane_sum(n, [&](std::size_t i) { return w[i]; });
  const double scale = 1.0 / sum, constant = greatest + std::log(sum);
  for (std::size_t i = 0; i < n; ++i) {
    w[i] *= scale;
    l[i] -= constant;
  }
  return 1.0 / lane_sum(n, [&](std::size_t i) { return w[i] * w[i]; });
}

void resample_systematic(std::span<const double> weight, double u, std::span<std::int32_t> ancestor) {
  const auto n = static_cast<std::int32_t>(weight.size());
  std::fill(ancestor.begin(), ancestor.end(), 0);
  // Each particle leaves its mark where its offspring begin; those without offspring are overwritten by the next.
  double cumulated = 0.0;
  std::int32_t begin = 0;
  for (std::int32_t i = 0; i < n; ++i) {
    ancestor[static_cast<std::size_t>(begin)] = i;
    cumulated += weight[static_cast<std::size_t>(i)];
    begin = std::min(static_cast<std::int32_t>(cumulated * n + (1.0 - u)), n);
  }
  std::int32_t newest = 0;
  for (std::int32_t& a : ancestor) a = newest = std::max(newest, a);
}

IntervalFinder::IntervalFinder(std::size_t most_particles)
    : bucket_of_(most_particles), bucket_weight_(kBuckets), candidates_(most_particles) {}

std::pair<double, double> IntervalFinder::find(std::span<const double> x, std::span<const double> weight, double mean,
                                               double sigma, double tail) {
  constexpr double kReach = 4.0;
  if (!(sigma > 0.0)) return {mean, mean};
  const std::size_t n = x.size();
  const double lowest = mean - kReach * sigma, scale = kBuckets / (2.0 * kReach * sigma);
  for (std::size_t i = 0; i < n; ++i) {
    double at = (x[i] - lowest) * scale;
    at = at > 0.0 ? at : 0.0;
    at = at < kBuckets - 1.0 ? at : kBuckets - 1.0;
    bucket_of_[i] = static_cast<std::int32_t>(at);
  }
  std::fill(bucket_weight_.begin(), bucket_weight_.end(), 0.0);
  for (std::size_t i = 0; i < n; ++i) bucket_weight_[static_cast<std::size_t>(bucket_of_[i])] += weight[i];
  std::int32_t low = 0, high = kBuckets - 1;
  double below = 0.0, above = 0.0;
  while (low < kBuckets - 1 && below + bucket_weight_[static_cast<std::size_t>(low)] < tail)
    below += bucket_weight_[static_cast<std::size_t>(low++)];
  while (high > 0 && above + bucket_weight_[static_cast<std::size_t>(high)] < tail)
    above += bucket_weight_[static_cast<std::size_t>(high--)];
  return {pick(x, weight, low, below, tail, true), pick(x, weight, high, above, tail, false)};
}

double IntervalFinder::pick(std::span<const double> x, std::span<const double> weight, std::int32_t bucket, double passed,
                            double tail, bool from_below) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (bucket_of_[i] != bucket || weight[i] == 0.0) continue;
    candidates_[count++] = {x[i], weight[i]};
  }
  const auto end = candidates_.begin() + static_cast<std::ptrdiff_t>(count);
  std::sort(candidates_.begin(), end, [&](const auto& a, const auto& b) { return from_below ? a < b : b < a; });
  std::size_t at = 0;
  while (at + 1 < count && (passed += candidates_[at].second) < tail) ++at;
  return candidates_[at].first;
}

}  // namespace slipstream
