#include "estimators/identification/low_pass.hpp"

#include <gtest/gtest.h>

#include <complex>

#include "common/random.hpp"

namespace slipstream {
namespace {

constexpr double kRate_hz = 500.0;

std::vector<double> sine(double frequency_hz, std::size_t n) {
  std::vector<double> x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = std::sin(2.0 * kPi * frequency_hz * static_cast<double>(k) / kRate_hz);
  return x;
}
// Amplitude and phase at a frequency over the middle of the series, whole periods, where no edge is felt.
std::complex<double> at(const std::vector<double>& x, double frequency_hz) {
  std::complex<double> sum = 0.0;
  const std::size_t from = 1000, to = x.size() - 1000;
  for (std::size_t k = from; k < to; ++k)
    sum += x[k] * std::polar(1.0, -2.0 * kPi * frequency_hz * static_cast<double>(k) / kRate_hz);
  return 2.0 / static_cast<double>(to - from) * sum;
}

TEST(LowPass, HalfThePowerAtTheCutoff) {
  for (const double cutoff_hz : {5.0, 25.0, 125.0, 200.0}) {
    const ButterworthLowPass filter(cutoff_hz, kRate_hz);
    const auto x = sine(cutoff_hz, 4000);  // 2000 in the middle: whole periods of each
    const std::complex<double> one = at(filter.forward(x), cutoff_hz) / at(x, cutoff_hz),
                               two = at(filter.without_delay(x), cutoff_hz) / at(x, cutoff_hz);
    // Butterworth of order 1 at its cutoff: 1 / (1 + i). Rounding of 2000 terms.
    EXPECT_NEAR(std::abs(one - 1.0 / std::complex<double>(1.0, 1.0)), 0.0, 1e-11) << cutoff_hz;
    EXPECT_NEAR(std::abs(two - 0.5), 0.0, 1e-11) << cutoff_hz;  // |1 / (1 + i)|^2, no phase
  }
}

TEST(LowPass, AttenuatesByTheBilinearFrequencyElsewhere) {
  const ButterworthLowPass filter(25.0, kRate_hz);
  for (const double f : {1.0, 10.0, 50.0, 150.0}) {
    const auto x = sine(f, 4000);
    const double ratio = std::tan(kPi * f / kRate_hz) / std::tan(kPi * 25.0 / kRate_hz);  // the warped frequencies
    EXPECT_NEAR(std::abs(at(filter.forward(x), f) / at(x, f)), 1.0 / std::sqrt(1.0 + ratio * ratio), 1e-11) << f;  // rounding
  }
}

TEST(LowPass, LeavesConstantsAndStraightLinesAlone) {
  std::vector<double> constant(300, 7.0), line(300);
  for (std::size_t k = 0; k < line.size(); ++k) line[k] = 2.0 - 0.1 * static_cast<double>(k);
  const ButterworthLowPass filter(25.0, kRate_hz);
  for (const double y : filter.forward(constant)) EXPECT_NEAR(y, 7.0, 1e-13);  // gain 1 at 0 Hz, and no start
  for (const double y : filter.without_delay(constant)) EXPECT_NEAR(y, 7.0, 1e-13);
  const auto y = filter.without_delay(line);
  ASSERT_EQ(y.size(), line.size());
  // The mirror image about the end points continues a line; what is left of the start is e^-10 of the delay, 0.1 * 3 samples.
  for (std::size_t k = 0; k < line.size(); ++k) EXPECT_NEAR(y[k], line[k], 1e-3) << k;
}

// Where the cross-correlation of noise and its filtered self peaks is the delay.
int delay(const std::vector<double>& x, const std::vector<double>& y) {
  double best = 0.0;
  int at_lag = 1000;
  for (int lag = -50; lag <= 50; ++lag) {
    double sum = 0.0;
    for (int k = 50; k < static_cast<int>(x.size()) - 50; ++k)
      sum += x[static_cast<std::size_t>(k)] * y[static_cast<std::size_t>(k + lag)];
    if (sum > best) {
      best = sum;
      at_lag = lag;
    }
  }
  return at_lag;
}

TEST(LowPass, TheDelayIsRemoved) {
  // A smooth signal: noise filtered twice by another filter.
  RandomStream random(1000, 0, "low_pass_test");
  std::vector<double> x(5000);
  for (double& v : x) v = random.normal();
  x = ButterworthLowPass(5.0, kRate_hz).without_delay(x);
  const ButterworthLowPass filter(10.0, kRate_hz);
  EXPECT_EQ(delay(x, filter.without_delay(x)), 0);
  EXPECT_GE(delay(x, filter.forward(x)), 3);  // 1 / (2 pi 10 Hz) = 8 samples at 0 Hz, less above
}

TEST(LowPass, SeriesShorterThanItsMemory) {
  const ButterworthLowPass filter(0.1, kRate_hz);
  EXPECT_TRUE(filter.without_delay({}).empty());
  EXPECT_EQ(filter.without_delay({3.0}), std::vector<double>{3.0});
  EXPECT_EQ(filter.without_delay({3.0, 3.0}), (std::vector<double>{3.0, 3.0}));
}

}  // namespace
}  // namespace slipstream
