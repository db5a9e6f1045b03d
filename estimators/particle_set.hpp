// A weighted set of particles as plain arrays: weights, resampling and credible intervals, for any model.
//
//   w_i = exp(l_i - max l) / sum_j exp(l_j - max l)      l: log-weights, so that no likelihood underflows
//   N_eff = 1 / sum_i w_i^2
//   systematic resampling: point j, (u + j)/N with one u ~ U[0, 1), falls to the first i with c_i = w_1 + ... + w_i above it,
//   so particle i gets floor or ceil of N w_i offspring
//
// Document 002, Table 2 (after Silva 2012); Arulampalam et al., IEEE Trans. Signal Processing 50 (2002), algorithms 2 to 4.
// Sums run in four fixed lanes: the same bits with every vector length, and so on every processor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "models/sensors/noise.hpp"

namespace slipstream {

// Sum of f(i), i < n.
template <typename F>
double lane_sum(std::size_t n, const F& f) {
  constexpr std::size_t kLanes = 4;
  double sum[kLanes]{};
  const std::size_t whole = n - n % kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += f(i + lane);
  for (std::size_t i = whole; i < n; ++i) sum[i - whole] += f(i);
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// Writes the normalised weights and returns N_eff; takes the normalising constant out of the log-weights. Log-weights that are
// not numbers get no weight. If all have vanished: 0, and nothing is written.
double normalise(std::span<double> log_weight, std::span<double> weight);

// Takes off each log-weight what z says against a particle whose output is h: (z - h)^2 / (2 R) + log(R)/2, R = sigma(h)^2.
void weigh_by_normal(double z, const NoiseLaw& law, std::span<const double> h, std::span<double> log_weight);

// Adds sigma xi, xi ~ N(0, 1), to each; the draws are left in `xi`.
void disturb_normally(RandomStream& random, double sigma, std::span<double> x, std::span<double> xi);

// The ancestor of each offspring, ascending. `ancestor` has one element more than `weight`, of no meaning. u in [0, 1).
void resample_systematic(std::span<const double> weight, double u, std::span<std::int32_t> ancestor);

// The values that leave `tail` of the weight below and above. Exact: by buckets around mean +- 4 sigma, then by sorting the two
// buckets that matter.
class IntervalFinder {
 public:
  explicit IntervalFinder(std::size_t most_particles);
  std::pair<double, double> find(std::span<const double> x, std::span<const double> weight, double mean, double sigma,
                                 double tail);

 private:
  static constexpr std::int32_t kBuckets = 256;

  // The values of one bucket, sorted from the end that the tail lies at; the first whose weight, with `passed`, reaches `tail`.
  double pick(std::span<const double> x, std::span<const double> weight, std::int32_t bucket, double passed, double tail,
              bool from_below);

  std::vector<std::int32_t> bucket_of_;
  std::vector<double> bucket_weight_;
  std::vector<std::pair<double, double>> candidates_;  // value, weight
};

}  // namespace slipstream
