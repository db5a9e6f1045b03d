// Chi-square distribution.
//
//   F(x; k) = P(k/2, x/2),   P(a, x) = 1/Gamma(a) int_0^x t^(a-1) e^-t dt
//
// P by its power series for x < a + 1, else Q = 1 - P by its continued fraction (Abramowitz and Stegun 6.5.29, and the even
// part of 6.5.31 by Lentz's method). The quantile is F's inverse by Newton's method inside a shrinking bracket, started from
// Wilson and Hilferty (Abramowitz and Stegun 26.4.17). Valid for any k > 0 that a run can reach (tested to 1e6).
#pragma once

namespace slipstream {

double chi_square_cdf(double x, double degrees_of_freedom);

// x with F(x; k) = p, for 0 < p < 1.
double chi_square_quantile(double p, double degrees_of_freedom);

}  // namespace slipstream
