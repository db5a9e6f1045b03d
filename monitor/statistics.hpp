// The bands that consistency is judged by, and percentiles.
#pragma once

#include <cstdint>
#include <vector>

#include "common/chi_square.hpp"

namespace slipstream {

struct Band {
  double low = 0.0;
  double high = 0.0;
  bool contains(double x) const { return x >= low && x <= high; }
};

// Where the mean of N independent chi-square values lies with probability 95 %, d their mean degrees of freedom, whether equal
// or not (a sum of chi-squares of d_i degrees of freedom is one of sum d_i = N d):
//   [F^-1(0.025; N d) / N,  F^-1(0.975; N d) / N]            (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2)
Band mean_chi_square_band(std::int64_t samples, double dimension);

// Nearest rank: the value of rank ceil(p n) among n sorted ones; NaN for none. 0 < p <= 1. Values that are NaN must not occur.
double percentile(std::vector<double> values, double p);

}  // namespace slipstream
