#include "estimators/interval_finder.hpp"

#include <algorithm>

#include "common/pack.hpp"
#include "common/widest.hpp"

namespace slipstream {

namespace {
constexpr double kReach = 4.0;  // sigma, on either side
constexpr double kInner = 2.0;
}  // namespace

IntervalFinder::IntervalFinder(std::size_t most_particles)
    : packs_((most_particles + kLanes - 1) / kLanes + 1), bucket_of_(packs_.size() * kLanes), candidates_(bucket_of_.size()) {}

void IntervalFinder::fill(std::span<const double> x, std::span<const double> weight, double mean, double sigma, double inner) {
  with_widest([&](auto width) {
    using P = PackOf<width, kLanes>;
    const double* const values = x.data();
    const std::size_t size = x.size();
    const double centre = mean, beyond = inner, scale = static_cast<double>(kBuckets) / (2.0 * kReach * sigma);
    std::uint32_t* const packs = packs_.data();
    std::int32_t* const bucket_of = bucket_of_.data();
    std::size_t count = 0;
    for (std::size_t i = 0; i < size; i += kLanes) {  // each is written, and stays where it counts
      const P off = P::load(values + i) - centre;
      const P bucket = off * scale + 0.5 * static_cast<double>(kBuckets);
      min(max(bucket, 0.0), static_cast<double>(kBuckets) - 1.0).store_whole(bucket_of + count * kLanes);
      packs[count] = static_cast<std::uint32_t>(i);
      count += any_less(P(beyond), abs(off)) ? 1U : 0U;
    }
    pack_count_ = count;
  });
  bucket_weight_.fill(0.0);
  const double* const w = weight.data();
  for (std::size_t p = 0; p < pack_count_; ++p)
    for (std::size_t k = 0; k < kLanes; ++k)
      bucket_weight_[static_cast<std::size_t>(bucket_of_[p * kLanes + k])] += w[packs_[p] + k];
}

std::pair<double, double> IntervalFinder::find(std::span<const double> x, std::span<const double> weight, double total,
                                               double mean, double sigma, double tail) {
  if (!(sigma > 0.0)) return {mean, mean};
  // A bucket further in may have been seen in part only.
  constexpr auto kLowOuter = static_cast<std::size_t>((kReach - kInner) / (2.0 * kReach) * static_cast<double>(kBuckets)) - 1;
  constexpr std::size_t kHighOuter = kBuckets - 1 - kLowOuter;
  const double share = tail * total;
  for (const double inner : {kInner * sigma, -1.0}) {
    fill(x, weight, mean, sigma, inner);
    const bool all = inner < 0.0;
    const std::size_t last_low = all ? kBuckets - 1 : kLowOuter, last_high = all ? 0 : kHighOuter;
    std::size_t low = 0, high = kBuckets - 1;
    double below = 0.0, above = 0.0;
    while (low < last_low && below + bucket_weight_[low] < share) below += bucket_weight_[low++];
    while (high > last_high && above + bucket_weight_[high] < share) above += bucket_weight_[high--];
    if (!all && (low == last_low || high == last_high)) continue;
    return {pick(x, weight, static_cast<std::int32_t>(low), below, share, true),
            pick(x, weight, static_cast<std::int32_t>(high), above, share, false)};
  }
  return {mean, mean};
}

double IntervalFinder::pick(std::span<const double> x, std::span<const double> weight, std::int32_t bucket, double passed,
                            double share, bool from_below) {
  std::size_t count = 0;
  for (std::size_t p = 0; p < pack_count_; ++p) {
    const std::int32_t* const bucket_of = bucket_of_.data() + p * kLanes;
    std::int32_t any = 0;
    for (std::size_t k = 0; k < kLanes; ++k) any |= bucket_of[k] == bucket ? 1 : 0;
    if (any == 0) continue;
    for (std::size_t k = 0, i = packs_[p]; k < kLanes && i < x.size(); ++k, ++i)
      if (bucket_of[k] == bucket && weight[i] > 0.0) candidates_[count++] = {x[i], weight[i]};
  }
  if (count == 0) return x[0];  // no weight at all: never after a sound weighing
  const auto end = candidates_.begin() + static_cast<std::ptrdiff_t>(count);
  std::sort(candidates_.begin(), end, [&](const Candidate& a, const Candidate& b) {
    return from_below ? a.value < b.value : b.value < a.value;
  });
  std::size_t at = 0;
  while (at + 1 < count && (passed += candidates_[at].weight) < share) ++at;
  return candidates_[at].value;
}

}  // namespace slipstream
