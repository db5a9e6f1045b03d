// The credible interval of a weighted set: the values that leave a tail of the weight below and above.
//
// Exact. Buckets of equal width are filled with the weights, which shows the two buckets that matter; their members are sorted.
// What lies within mean +- 2.1 sigma is passed over at first, since the ends of a 99 % interval are rarely there: where one is,
// all are looked at. Linear, but for the members of the two buckets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace slipstream {

class IntervalFinder {
 public:
  explicit IntervalFinder(std::size_t most_particles);

  // Weights of sum `total`; of `tail` times that on each side. Both arrays go on for whole packs of 16, without weight.
  std::pair<double, double> find(std::span<const double> x, std::span<const double> weight, double total, double mean,
                                 double sigma, double tail);

 private:
  static constexpr std::size_t kLanes = 8;
  static constexpr int kSide = 16;  // buckets on either side of the mean

  struct Member {
    double value, weight;
  };
  struct Bucket {
    std::vector<Member> members;
    std::size_t count = 0;
  };

  static std::size_t padded(std::size_t particles) { return (particles + 2 * kLanes - 1) / (2 * kLanes) * (2 * kLanes); }

  // Lists what lies beyond mean +- `inner`, and fills the buckets up to mean +- `reach` with it; with all where `inner` is 0.
  void fill(std::span<const double> x, std::span<const double> weight, double mean, double inner, double reach);
  // The members of the two buckets that matter.
  void gather(std::span<const double> x, std::span<const double> weight, std::int32_t low, std::int32_t high);
  // The first value of a bucket, in the tail's direction, whose weight with `passed` reaches `share`.
  static double pick(Bucket& bucket, double passed, double share, bool from_below);

  std::vector<std::uint32_t> outer_;     // those that were looked at
  std::vector<std::int32_t> bucket_of_;  // of each of them
  std::size_t outer_count_ = 0;
  std::array<double, 2 * kSide> bucket_weight_{};
  Bucket low_, high_;
};

}  // namespace slipstream
