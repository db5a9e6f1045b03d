// Which of two estimators is better, from what each of them did in the same runs (common random numbers).
//
//   d = (m_b - m_a) / max(m_a, m_b),   m = 1/n sum_r e_r          d > 0: a is better, its mean error is smaller than b's by d
//   of b's
//
// e_r >= 0: an error of run r, such as its eta (indices.hpp) or an RMSE. A ratio of means, not a mean of ratios: a run weighs
// by the size of its errors, and one in which b had hardly any does not decide. -1 <= d <= 1, 0 if both means are 0; d changes
// its sign when a and b change places.
//
// Interval of 95 % for d: bootstrap over runs, whose pairs stay together, with kResamples resamples. Its ends are the order
// statistics of d at p and 1 - p, p = Phi(-sqrt(n/(n-1)) t_(n-1)(0.975)) instead of 0.025: the expanded percentile interval
// (Hesterberg, The American Statistician 69, 2015), which makes up for the narrowness of small samples. With an
// interval that has 0 in it, or a d that only rounding can have made (below kNegligible), it is a tie. No interval for n below
// kFewest.
//
// The resamples are drawn from a stream of the two names, over the runs in the order of their index: the same bits whatever the
// order in which runs were finished, and but for the sign when a and b change places.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace slipstream {

struct Comparison {
  static constexpr std::size_t kFewest = 10;
  static constexpr std::size_t kResamples = 2000;
  static constexpr double kNegligible = 1e-6;

  enum class Verdict { kTie, kFirstIsBetter, kSecondIsBetter, kTooFewRuns };

  std::string first, second;  // a, b
  std::size_t runs = 0;       // all that were given
  std::size_t used = 0;       // n: those in which both gave a number
  std::size_t failed_first = 0, failed_second = 0;
  double mean_first, mean_second;  // m_a, m_b of the runs used; NaN without any
  double difference;               // d; NaN without any
  double low, high;                // its interval; NaN for n < kFewest
  Verdict verdict = Verdict::kTooFewRuns;

  // "ukf better than pf by 12 % +-3, n = 200" or "tie: ukf and pf differ by 0.4 % +-1.1, n = 200": |d|, and how far it is to
  // the end of the interval towards 0 and beyond, which decides. Then what was left out: "; 3 of 200 runs left out: pf gave no
  // estimate".
  std::string sentence() const;
};

// Entry i of `run`, a and b is of one run; no index comes twice. An error that is not finite: no estimate in that run. None is
// negative.
Comparison compare(const std::string& first, std::span<const double> a, const std::string& second, std::span<const double> b,
                   std::span<const std::uint64_t> run);

}  // namespace slipstream
