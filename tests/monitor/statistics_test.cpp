#include "monitor/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace slipstream {
namespace {

// NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.4, critical values of the chi-square distribution (three decimals).
TEST(ChiSquare, QuantilesAgreeWithThePrintedTable) {
  struct Entry {
    double degrees, p, x;
  };
  for (const Entry e : {Entry{1, 0.95, 3.841}, Entry{1, 0.99, 6.635}, Entry{2, 0.95, 5.991}, Entry{2, 0.975, 7.378},
                        Entry{3, 0.95, 7.815}, Entry{5, 0.975, 12.833}, Entry{10, 0.95, 18.307}, Entry{10, 0.99, 23.209},
                        Entry{30, 0.975, 46.979}, Entry{100, 0.95, 124.342}, Entry{100, 0.975, 129.561}, Entry{1, 0.05, 0.004},
                        Entry{2, 0.025, 0.051}, Entry{3, 0.025, 0.216}, Entry{10, 0.05, 3.940}, Entry{10, 0.025, 3.247},
                        Entry{30, 0.025, 16.791}, Entry{100, 0.025, 74.222}})
    EXPECT_NEAR(chi_square_quantile(e.p, e.degrees), e.x, 0.0005 + 1e-9)  // half the last printed digit
        << e.degrees << " degrees of freedom, p = " << e.p;
}

// With two degrees of freedom the distribution is exponential: F(x) = 1 - exp(-x/2), so the quantile is -2 ln(1 - p).
TEST(ChiSquare, TwoDegreesOfFreedomAreExponential) {
  for (const double p : {1e-6, 0.025, 0.5, 0.975, 0.999999})
    EXPECT_NEAR(chi_square_quantile(p, 2) / (-2.0 * std::log1p(-p)), 1.0, 1e-9);  // cdf - p cancels to eps/(1 - p)
  EXPECT_NEAR(chi_square_cdf(3.0, 2), 1.0 - std::exp(-1.5), 1e-15);               // rounding
}

// With one, F(x) = erf(sqrt(x/2)).
TEST(ChiSquare, OneDegreeOfFreedomIsTheSquareOfANormal) {
  for (const double x : {1e-8, 0.1, 1.0, 4.0, 25.0}) EXPECT_NEAR(chi_square_cdf(x, 1), std::erf(std::sqrt(x / 2.0)), 1e-14);
}

// For k degrees mean k, variance 2k; for large k normal up to a skewness of sqrt(8/k): Cornish-Fisher, first correction.
TEST(ChiSquare, ManyDegreesOfFreedomApproachANormal) {
  const double k = 1e6, z = 1.959963984540054;
  const double expected = k + z * std::sqrt(2.0 * k) + 2.0 / 3.0 * (z * z - 1.0);
  EXPECT_NEAR(chi_square_quantile(0.975, k), expected, 0.01);  // the next term is of order z^3 / sqrt(18 k) = 2e-3
}

TEST(ChiSquare, NothingLiesBelowZero) {
  EXPECT_EQ(chi_square_cdf(0.0, 3), 0.0);
  EXPECT_EQ(chi_square_cdf(-1.0, 3), 0.0);
}

// Bar-Shalom, Li, Kirubarajan 2001, example in section 5.4.2: N = 50 runs, n = 2: chi2_100 gives [74.2, 129.6]/50 =
// [1.48, 2.59].
TEST(ChiSquare, BandOfAMeanIsThatOfTheTextbook) {
  const Band band = mean_chi_square_band(50, 2);
  EXPECT_NEAR(band.low, 1.48444, 1e-5);   // half the last printed digit over 50
  EXPECT_NEAR(band.high, 2.59122, 1e-5);  // the same
  EXPECT_TRUE(band.contains(2.0));
  EXPECT_FALSE(band.contains(2.6));
}

TEST(Percentile, IsTheNearestRank) {
  const std::vector<double> v{15, 20, 35, 40, 50};  // the usual textbook list
  EXPECT_EQ(percentile(v, 0.05), 15);
  EXPECT_EQ(percentile(v, 0.30), 20);
  EXPECT_EQ(percentile(v, 0.40), 20);
  EXPECT_EQ(percentile(v, 0.50), 35);
  EXPECT_EQ(percentile(v, 1.00), 50);
  EXPECT_EQ(percentile({50, 15, 40, 20, 35}, 0.50), 35);  // the order does not matter
  EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
}

}  // namespace
}  // namespace slipstream
