// A weighted set of particles as plain arrays, one per column: log-weights, moments, resampling, for any model.
//
//   w_i = exp(l_i - max l)                       l: log-weights, so that no likelihood underflows
//   N_eff = (sum_i w_i)^2 / sum_i w_i^2
//   mean = sum_i w_i x_i / sum_i w_i,   covariance = sum_i w_i (x_i - mean)(x_i - mean)' / sum_i w_i
//
// A set has n state columns, and kExtra more that are only carried along. Moments are taken in one pass about a value near the
// mean; where the difference leaves fewer than seven digits, in a second about the mean itself.
//
// Arrays are padded to whole packs of 32. Lanes beyond N repeat the last particle, without weight: no loop has a tail. Sums run
// in 16 fixed lanes, whatever the registers: the same bits on every processor.
// Arulampalam et al., IEEE Trans. Signal Processing 50 (2002), algorithms 2 to 4.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "common/pack.hpp"
#include "common/types.hpp"
#include "common/widest.hpp"
#include "estimators/resampling.hpp"

namespace slipstream {

inline constexpr std::size_t kPackLanes = 32;  // most that one operation takes
inline constexpr std::size_t kSumLanes = 16;
inline std::size_t padded_to_packs(std::size_t size) { return (size + kPackLanes - 1) / kPackLanes * kPackLanes; }

template <int n, int kExtra = 0>
class ParticleSet {
  static constexpr double kNothing = -std::numeric_limits<double>::infinity();

 public:
  static constexpr int kColumns = n + kExtra;
  using State = Vector<double, n>;

  struct Moments {
    State mean;
    Matrix<double, n> covariance;
  };

  ParticleSet(int particles, Resampling method)
      : size_(static_cast<std::size_t>(particles)),
        padded_(padded_to_packs(size_)),
        x_(kColumns * padded_),
        moved_(kColumns * padded_),
        even_weight_(padded_, 0.0),
        even_log_weight_(padded_, kNothing),
        weight_(padded_),
        log_weight_(padded_),
        new_log_weight_(padded_),
        resampler_(method, size_) {
    for (std::size_t i = 0; i < size_; ++i) even_weight_[i] = 1.0 / static_cast<double>(size_), even_log_weight_[i] = 0.0;
  }

  std::size_t size() const { return size_; }
  std::size_t padded() const { return padded_; }
  double* column(int c) { return x_.data() + static_cast<std::size_t>(c) * padded_; }
  const double* column(int c) const { return x_.data() + static_cast<std::size_t>(c) * padded_; }
  const double* weights() const { return even_ ? even_weight_.data() : weight_.data(); }
  const double* log_weights() const { return even_ ? even_log_weight_.data() : log_weight_.data(); }
  double total_weight() const { return total_; }
  // Where log-weights after a measurement are written, for weigh().
  double* new_log_weights() { return new_log_weight_.data(); }

  State particle(std::size_t i) const {
    State at;
    for (int s = 0; s < n; ++s) at[s] = column(s)[i];
    return at;
  }
  void put(std::size_t i, const State& at) {
    for (int s = 0; s < n; ++s) column(s)[i] = at[s];
  }
  void repeat_last(double* a) const {
    for (std::size_t i = size_; i < padded_; ++i) a[i] = a[size_ - 1];
  }

  void forget_weights() {
    seen_.reset();
    even_ = true;
    total_ = 1.0;
  }

  // Takes over new_log_weights(), whose greatest is given, and returns N_eff. Log-weights that are not numbers get no weight.
  // If all have vanished: 0, and the weights are as before. Moments are taken on the way, about `near`, for moments().
  double weigh(double greatest, const State& near) {
    seen_.reset();
    if (!std::isfinite(greatest)) return 0.0;
    double squares = 0.0;
    Sums sums;
    with_widest([&](auto width) {
      using P = PackOf<width, kSumLanes>;
      const double* const l = new_log_weight_.data();
      double* const w = weight_.data();
      const std::size_t padded = padded_;
      const P most(greatest);
      PackSums<P> of(x_.data(), padded, near);
      P sum(0.0), square(0.0);
      for (std::size_t i = 0; i < padded; i += kSumLanes) {
        const P here = exp(max(P::load(l + i) - most, batch::kExpLowest));
        here.store(w + i);
        sum += here;
        square += here * here;
        of.add(here, i);
      }
      total_ = sum_of(sum);
      squares = sum_of(square);
      of.put(sums);
    });
    log_weight_.swap(new_log_weight_);
    greatest_ = greatest;
    even_ = false;
    seen_ = finish(sums, near);
    return total_ * total_ / squares;
  }

  // Mean and covariance; `near` is a value that should not be far off. Those that weigh() saw where nothing has moved since.
  Moments moments(const State& near) const {
    Accuracy at = seen_ ? *seen_ : moments_about(near);
    if (at.left < 1e-9) at = moments_about(at.moments.mean);
    return at.moments;
  }
  // Columns have been written to since the last weigh().
  void touch() { seen_.reset(); }

  // Weights of sum 1, and their logarithms.
  void normalise() {
    if (even_) return;
    const double scale = 1.0 / total_, constant = greatest_ + std::log(total_);
    double* const w = weight_.data();
    double* const l = log_weight_.data();
    for (std::size_t i = 0; i < padded_; ++i) w[i] *= scale, l[i] -= constant;
    total_ = 1.0;
    greatest_ = 0.0;
  }

  // N particles of equal weight. A number of each particle may go along.
  void resample(RandomStream& random, std::vector<double>* along = nullptr) {
    resampler_.draw({weights(), size_}, total_, random);
    resampler_.template inherit<kColumns>(x_.data(), moved_.data(), padded_);
    for (int c = 0; c < kColumns; ++c) repeat_last(moved_.data() + static_cast<std::size_t>(c) * padded_);
    x_.swap(moved_);
    if (along) {
      resampler_.template inherit<1>(along->data(), new_log_weight_.data(), 0);
      repeat_last(new_log_weight_.data());
      along->swap(new_log_weight_);
    }
    forget_weights();
  }
  // Replaces each particle that is not finite by the heaviest one that is, without weight. False if there is none.
  bool replace_lost() {
    const auto is_lost = [&](std::size_t i) {
      double zero = 0.0;
      for (int c = 0; c < kColumns; ++c) zero += 0.0 * column(c)[i];
      return zero != 0.0;
    };
    const double* const w = weights();
    std::size_t heaviest = size_;
    for (std::size_t i = 0; i < size_; ++i)
      if (!is_lost(i) && w[i] > (heaviest == size_ ? 0.0 : w[heaviest])) heaviest = i;
    if (heaviest == size_) return false;
    double greatest = kNothing;
    for (std::size_t i = 0; i < padded_; ++i) {
      const bool lost = is_lost(i);
      new_log_weight_[i] = lost ? kNothing : log_weights()[i];
      greatest = std::max(greatest, new_log_weight_[i]);
      for (int c = 0; lost && c < kColumns; ++c) column(c)[i] = column(c)[heaviest];
    }
    const bool any = weigh(greatest, State::Zero()) > 0.0;
    normalise();
    return any;
  }

 private:
  struct Sums {  // of w, about `near`
    double first[n], second[n][n];
  };
  struct Accuracy {
    Moments moments;
    double left;  // the least share of a second moment that is left as variance
  };

  template <typename P>
  class PackSums {
   public:
    PackSums(const double* x, std::size_t padded, const State& near) : x_(x), padded_(padded) {
      for (int s = 0; s < n; ++s) {
        near_[s] = P(near[s]);
        first_[s] = P(0.0);
        for (int t = 0; t <= s; ++t) second_[s][t] = P(0.0);
      }
    }
    void add(const P& weight, std::size_t i) {
      P d[n];
      for (int s = 0; s < n; ++s) {
        d[s] = P::load(x_ + static_cast<std::size_t>(s) * padded_ + i) - near_[s];
        const P weighted = weight * d[s];
        first_[s] += weighted;
        for (int t = 0; t <= s; ++t) second_[s][t] += weighted * d[t];
      }
    }
    void put(Sums& to) const {
      for (int s = 0; s < n; ++s) {
        to.first[s] = sum_of(first_[s]);
        for (int t = 0; t <= s; ++t) to.second[s][t] = sum_of(second_[s][t]);
      }
    }

   private:
    const double* x_;
    std::size_t padded_;
    P near_[n], first_[n], second_[n][n];
  };

  Accuracy finish(const Sums& sums, const State& near) const {
    Accuracy at;
    const double scale = 1.0 / total_;
    at.left = 1.0;
    for (int s = 0; s < n; ++s) {
      at.moments.mean[s] = near[s] + sums.first[s] * scale;
      for (int t = 0; t <= s; ++t)
        at.moments.covariance(s, t) = at.moments.covariance(t, s) =
            sums.second[s][t] * scale - (sums.first[s] * scale) * (sums.first[t] * scale);
      if (sums.second[s][s] > 0.0) at.left = std::min(at.left, at.moments.covariance(s, s) / (sums.second[s][s] * scale));
    }
    return at;
  }

  Accuracy moments_about(const State& near) const {
    Sums sums;
    with_widest([&](auto width) {
      using P = PackOf<width, kSumLanes>;
      const double* const w = weights();
      const std::size_t padded = padded_;
      PackSums<P> of(x_.data(), padded, near);
      for (std::size_t i = 0; i < padded; i += kSumLanes) of.add(P::load(w + i), i);
      of.put(sums);
    });
    return finish(sums, near);
  }

  std::size_t size_;              // N
  std::size_t padded_;            // N and the lanes that fill the last pack
  bool even_ = true;              // all particles have the same weight
  double total_ = 1.0;            // sum of the weights
  double greatest_ = 0.0;         // what was taken off the log-weights before the exponential
  std::optional<Accuracy> seen_;  // by weigh()
  std::vector<double> x_;
  std::vector<double> moved_;  // as x_, while resampling
  std::vector<double> even_weight_, even_log_weight_;
  std::vector<double> weight_, log_weight_, new_log_weight_;
  Resampler resampler_;
};

}  // namespace slipstream
