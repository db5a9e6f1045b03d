#include "estimators/interval_finder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/pack.hpp"
#include "common/widest.hpp"

namespace slipstream {

namespace {
constexpr double kReach = 4.0;  // sigma, on either side
constexpr double kInner = 2.1;
}  // namespace

IntervalFinder::IntervalFinder(std::size_t most_particles)
    : is_outer_((most_particles + kLanes - 1) / kLanes * kLanes), outer_(most_particles + 1), bucket_of_(most_particles) {
  low_.members.resize(most_particles);
  high_.members.resize(most_particles);
}

void IntervalFinder::fill(std::span<const double> x, std::span<const double> weight, double mean, double sigma, double inner) {
  with_widest([&](auto width) {
    using P = PackOf<width, kLanes>;
    const double* const values = x.data();
    const std::size_t size = x.size();
    const P centre(mean), square(inner * std::abs(inner));
    std::int32_t* const is_outer = is_outer_.data();
    for (std::size_t i = 0; i < size; i += kLanes) {
      const P off = P::load(values + i) - centre;
      select_less(square, off * off, 1.0, 0.0).store_whole(is_outer + i);
    }
  });
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < x.size(); ++i) {  // each is written, and stays where it counts
    outer_[count] = i;
    count += static_cast<std::uint32_t>(is_outer_[i]);
  }
  outer_count_ = count;
  bucket_weight_.fill(0.0);
  const double scale = static_cast<double>(kBuckets) / (2.0 * kReach * sigma);
  for (std::size_t o = 0; o < outer_count_; ++o) {
    const double at = (x[outer_[o]] - mean) * scale + 0.5 * static_cast<double>(kBuckets);
    const double within = at > 0.0 ? std::min(at, static_cast<double>(kBuckets) - 1.0) : 0.0;
    bucket_of_[o] = static_cast<std::int32_t>(within);
    bucket_weight_[static_cast<std::size_t>(bucket_of_[o])] += weight[outer_[o]];
  }
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
    gather(x, weight, static_cast<std::int32_t>(low), static_cast<std::int32_t>(high));
    return {pick(low_, below, share, true), pick(high_, above, share, false)};
  }
  return {mean, mean};
}

void IntervalFinder::gather(std::span<const double> x, std::span<const double> weight, std::int32_t low, std::int32_t high) {
  low_.count = high_.count = 0;
  for (std::size_t o = 0; o < outer_count_; ++o) {
    const std::uint32_t i = outer_[o];
    if (!(weight[i] > 0.0)) continue;
    if (bucket_of_[o] == low) low_.members[low_.count++] = {x[i], weight[i]};
    if (bucket_of_[o] == high) high_.members[high_.count++] = {x[i], weight[i]};
  }
}

double IntervalFinder::pick(Bucket& bucket, double passed, double share, bool from_below) {
  if (bucket.count == 0) return std::numeric_limits<double>::quiet_NaN();  // no weight at all: never after a sound weighing
  const auto begin = bucket.members.begin(), end = begin + static_cast<std::ptrdiff_t>(bucket.count);
  std::sort(begin, end, [&](const Member& a, const Member& b) { return from_below ? a.value < b.value : b.value < a.value; });
  std::size_t at = 0;
  while (at + 1 < bucket.count && (passed += bucket.members[at].weight) < share) ++at;
  return bucket.members[at].value;
}

}  // namespace slipstream
