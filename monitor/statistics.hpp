// Chi-square distribution, the bands that consistency is judged by, and percentiles.
//
//   F(x; k) = P(k/2, x/2),   P(a, x) = 1/Gamma(a) int_0^x t^(a-1) e^-t dt
//
// P by its power series for x < a + 1, else Q = 1 - P by its continued fraction (Abramowitz and Stegun 6.5.29, and the even
// part of 6.5.31 by Lentz's method). The quantile is F's inverse by Newton's method inside a shrinking bracket, started from
// Wilson and Hilferty (Abramowitz and Stegun 26.4.17). Valid for any k > 0 that a run can reach (tested to 1e6).
#pragma once

#include <cstdint>
#include <vector>

namespace slipstream {

double chi_square_cdf(double x, double degrees_of_freedom);

// x with F(x; k) = p, for 0 < p < 1.
double chi_square_quantile(double p, double degrees_of_freedom);

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
