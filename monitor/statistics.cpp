#include "monitor/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slipstream {

Band mean_chi_square_band(std::int64_t samples, double dimension) {
  const double n = static_cast<double>(samples);
  const double k = n * dimension;
  return {chi_square_quantile(0.025, k) / n, chi_square_quantile(0.975, k) / n};
}

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const double n = static_cast<double>(values.size());
  const auto rank = static_cast<std::size_t>(std::clamp(std::ceil(p * n), 1.0, n));
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank - 1);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace slipstream
