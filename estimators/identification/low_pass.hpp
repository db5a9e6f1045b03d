// First-order Butterworth low-pass, and how its delay is removed.
//
//   H(s) = w_c / (s + w_c), sampled by the bilinear transform with prewarping:
//   y_k = (K (x_k + x_(k-1)) + (1 - K) y_(k-1)) / (1 + K),   K = tan(pi f_c / f_s)
//
// One pass: gain 1 at 0 Hz, exactly 1/sqrt 2 (-3 dB) at f_c, and a delay. The delay is removed by a second pass backwards in
// time: the phases cancel, the gain is that of one pass squared (1/2 at f_c). Document 002, section 5.1, and Figure 16.
//
// Edges: both passes start in the steady state of their first sample, and the series is continued beyond its ends by its own
// mirror image about the end point, 2 x_0 - x_k, as long as the filter remembers (to e^-10) and the series reaches.
#pragma once

#include <algorithm>
#include <cmath>
#include <ranges>
#include <vector>

#include "common/check.hpp"
#include "common/types.hpp"

namespace slipstream {

class ButterworthLowPass {
 public:
  // 0 < cutoff_hz < sample_rate_hz / 2.
  ButterworthLowPass(double cutoff_hz, double sample_rate_hz) : k_(std::tan(kPi * cutoff_hz / sample_rate_hz)) {
    SLIPSTREAM_CHECK(cutoff_hz > 0.0 && cutoff_hz < 0.5 * sample_rate_hz);
  }

  // One pass: causal, delayed. x of any length.
  std::vector<double> forward(std::vector<double> x) const {
    pass(x);
    return x;
  }

  // Both passes: no delay. x of any length.
  std::vector<double> without_delay(const std::vector<double>& x) const {
    if (x.empty()) return {};
    const double remembered = 10.0 / std::abs(std::log(std::abs((1.0 - k_) / (1.0 + k_))));
    const std::size_t edge = static_cast<std::size_t>(std::min(std::ceil(remembered), static_cast<double>(x.size() - 1)));
    std::vector<double> y;
    y.reserve(x.size() + 2 * edge);
    for (std::size_t k = edge; k > 0; --k) y.push_back(2.0 * x.front() - x[k]);
    y.insert(y.end(), x.begin(), x.end());
    for (std::size_t k = 1; k <= edge; ++k) y.push_back(2.0 * x.back() - x[x.size() - 1 - k]);
    pass(y);
    auto backwards = std::views::reverse(y);
    pass(backwards);
    return {y.begin() + static_cast<std::ptrdiff_t>(edge), y.end() - static_cast<std::ptrdiff_t>(edge)};
  }

 private:
  template <typename Range>
  void pass(Range& x) const {
    if (std::ranges::empty(x)) return;
    double previous = *std::ranges::begin(x), y = previous;
    for (double& value : x) {
      y = (k_ * (value + previous) + (1.0 - k_) * y) / (1.0 + k_);
      previous = value;
      value = y;
    }
  }

  double k_;
};

}  // namespace slipstream
