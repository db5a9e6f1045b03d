#include "estimators/interval_finder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/pack.hpp"
#include "common/widest.hpp"

namespace slipstream {

namespace {
constexpr double kReach = 3.2;  // sigma: the outermost buckets begin within it, and have all that is further out

// Sigma. 3 standard errors inside the 0.5 % quantile of N normal deviates: -2.58 +- 4.88/sqrt(N).
double inner_of(std::size_t particles) { return std::max(2.58 - 15.0 / std::sqrt(static_cast<double>(particles)), 0.0); }
}  // namespace

IntervalFinder::IntervalFinder(std::size_t most_particles)
    : outer_(padded(most_particles)), bucket_of_(padded(most_particles)) {
  low_.members.resize(most_particles);
  high_.members.resize(most_particles);
}

// A particle further out is a bit of its lane's whole number, one bit a pack; two sums, so that neither waits for the other.
void IntervalFinder::fill(std::span<const double> x, std::span<const double> weight, double mean, double inner, double reach) {
  constexpr std::size_t kPacks = 48;  // so many bits are exact in a double
  const double* const values = x.data();
  const double* const weights = weight.data();
  const std::size_t size = padded(x.size());
  with_widest([&](auto width) {
    using P = PackOf<width, kLanes>;
    const P centre(mean), square(inner > 0.0 ? inner * inner : -1.0);
    const auto bit_of = [&](const double* from, double bit) {
      const P off = P::load(from) - centre;
      return select_less(square, off * off, P(bit), P(0.0));
    };
    std::uint32_t* to = outer_.data();
    for (std::size_t begin = 0; begin < size; begin += kPacks * kLanes) {
      const std::size_t half = std::min(size - begin, kPacks * kLanes) / 2;
      P first(0.0), second(0.0);
      double bit = 1.0;
      for (std::size_t i = begin; i < begin + half; i += kLanes, bit += bit) {
        first += bit_of(values + i, bit);
        second += bit_of(values + i + half, bit);
      }
      const P bits = first + second * bit;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        for (auto left = static_cast<std::uint64_t>(bits[static_cast<int>(lane)]); left != 0; left &= left - 1)
          *to++ = static_cast<std::uint32_t>(begin + lane + kLanes * static_cast<std::size_t>(std::countr_zero(left)));
    }
    outer_count_ = static_cast<std::size_t>(to - outer_.data());
  });
  bucket_weight_.fill(0.0);
  const double scale = static_cast<double>(kSide) / (reach - inner);
  for (std::size_t o = 0; o < outer_count_; ++o) {
    const double off = values[outer_[o]] - mean;
    const double beyond = std::min(std::max(0.0, (std::abs(off) - inner) * scale), kSide - 0.5);
    bucket_of_[o] = static_cast<std::int32_t>(kSide + std::copysign(beyond, off));
    bucket_weight_[static_cast<std::size_t>(bucket_of_[o])] += weights[outer_[o]];
  }
}

std::pair<double, double> IntervalFinder::find(std::span<const double> x, std::span<const double> weight, double total,
                                               double mean, double sigma, double tail) {
  if (!(sigma > 0.0)) return {mean, mean};
  const double share = tail * total;
  for (const double inner : {inner_of(x.size()) * sigma, 0.0}) {
    fill(x, weight, mean, inner, kReach * sigma);
    const std::size_t last_low = inner > 0.0 ? kSide : 2 * kSide - 1, last_high = inner > 0.0 ? kSide - 1 : 0;
    std::size_t low = 0, high = 2 * kSide - 1;
    double below = 0.0, above = 0.0;
    while (low < last_low && below + bucket_weight_[low] < share) below += bucket_weight_[low++];
    while (high > last_high && above + bucket_weight_[high] < share) above += bucket_weight_[high--];
    if (inner > 0.0 && (low == last_low || high == last_high)) continue;  // further in
    gather(x, weight, static_cast<std::int32_t>(low), static_cast<std::int32_t>(high));
    return {pick(low_, below, share, true), pick(high_, above, share, false)};
  }
  return {mean, mean};
}

void IntervalFinder::gather(std::span<const double> x, std::span<const double> weight, std::int32_t low, std::int32_t high) {
  low_.count = high_.count = 0;
  for (std::size_t o = 0; o < outer_count_; ++o) {
    const std::uint32_t i = outer_[o];
    if (bucket_of_[o] != low && bucket_of_[o] != high) continue;
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
