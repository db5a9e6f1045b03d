#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "common/refusal.hpp"
#include "tests/identification/synthetic_stand.hpp"

namespace slipstream {
namespace {

const std::vector<std::string> kNoNoise{"sensor.wheel_speed.noise_radps=0.0", "sensor.motor_current.noise_a=0.0"};

TEST(Stand, WithoutNoiseTheTruthIsFound) {
  const StandResult r = identify_stand(test::record_of(test::stand_scenario(kNoNoise), 1), {});
  EXPECT_NEAR(r.residual_current_a.value, test::kResidualCurrent_a, 1e-12);  // rounding
  ASSERT_EQ(r.fits.size(), 2u);
  for (const StandFit& fit : r.fits) {
    // The low-pass turns steps into slopes: it spreads them over 2 / (2 pi 25 Hz)^2 = 8e-5 s^2, 8e-4 of tau^2 = 0.1 s^2.
    EXPECT_NEAR(fit.inertia_kgm2.value / 3.2e-3, 1.0, 8e-4) << fit.name;
    EXPECT_NEAR(fit.friction_nms.value / 0.01, 1.0, 8e-4) << fit.name;
    EXPECT_GT(fit.r2, 0.9999) << fit.name;  // the same 8e-4, of the accelerated part only, squared
  }
}

TEST(Stand, BothCostFunctionsAgree) {
  const StandResult r = identify_stand(test::record_of(test::stand_scenario(), 1), {});
  ASSERT_EQ(r.fits.size(), 2u);
  EXPECT_EQ(r.fits[0].name, "RK");
  EXPECT_EQ(r.fits[1].name, "LSIM");
  // A Runge-Kutta step of x = b h / J = 0.006 errs by x^5 / 120 = 1e-13; the swarm's tolerance leaves 1e-9 of 1 - R2, which is
  // a thirtieth of an interval.
  const StandFit &rk = r.fits[0], &lsim = r.fits[1];
  EXPECT_NEAR(rk.inertia_kgm2.value, lsim.inertia_kgm2.value, rk.inertia_kgm2.half_width / 30.0);
  EXPECT_NEAR(rk.friction_nms.value, lsim.friction_nms.value, rk.friction_nms.half_width / 30.0);
  EXPECT_NEAR(rk.r2, lsim.r2, 1e-6);  // the tolerance
  for (const StandFit& fit : r.fits) {
    EXPECT_LE(fit.iterations, 50);
    EXPECT_GT(fit.r2, 0.989);  // the document's 0.98892
  }
}

TEST(Stand, SeriesOfFigures16And17) {
  const StandRecord record = test::record_of(test::stand_scenario(), 1);
  const StandResult r = identify_stand(record, {}, {Method::kExact});
  const std::size_t n = 6001;  // 12 s at 500 Hz, both ends
  EXPECT_EQ(r.time_s.size(), n);
  EXPECT_EQ(r.raw_current_a, record.current_a);
  EXPECT_EQ(r.measured_radps, record.wheel_speed_radps);
  ASSERT_EQ(r.filtered_current_a.size(), n);
  ASSERT_EQ(r.fits[0].simulated_radps.size(), n);
  EXPECT_TRUE(r.residual_current_a.contains(test::kResidualCurrent_a));
  EXPECT_NEAR(r.residual_current_a.half_width, 1.96 * 0.5 / std::sqrt(450.0), 0.02);  // white noise, 0.5 A, 0.9 s; lags scatter
  // On the plateau of 14 A, far from its edges: noise of 0.5 A passes with tan(pi 25/500) / 2 of its variance.
  double mean = 0.0, square = 0.0;
  for (std::size_t k = 1300; k < 1950; ++k) {
    mean += r.filtered_current_a[k] / 650.0;
    square += std::pow(r.filtered_current_a[k] - 14.0, 2) / 650.0;
  }
  EXPECT_NEAR(mean, 14.0, 4.0 * 0.5 * std::sqrt(1.0 / 650.0 + 1.0 / 450.0));  // four standard errors, residual current included
  EXPECT_LT(std::sqrt(square), 0.25);                                         // less than half of the raw noise
}

TEST(Stand, IntervalsGrowWithTheNoise) {
  const auto fit = [](const char* noise) {
    return identify_stand(test::record_of(test::stand_scenario({noise}), 1001), {}, {Method::kExact}).fits[0];
  };
  const StandFit one = fit("sensor.wheel_speed.noise_radps=1.0"), three = fit("sensor.wheel_speed.noise_radps=3.0");
  EXPECT_GT(three.inertia_kgm2.half_width, 1.5 * one.inertia_kgm2.half_width);  // 3, less what the current's noise has in it
  const StandFit current = fit("sensor.motor_current.noise_a=1.5");
  EXPECT_GT(current.friction_nms.half_width, 1.5 * one.friction_nms.half_width);
}

std::string message(const StandRecord& record, const StandSettings& settings) {
  try {
    identify_stand(record, settings, {Method::kExact});
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "(accepted)";
}

TEST(Stand, Refusals) {
  StandRecord good;
  for (int k = 0; k < 1000; ++k) {
    good.utime.push_back(2000 * k);
    good.current_a.push_back(k < 500 ? 0.0 : 10.0);
    good.wheel_speed_radps.push_back(k < 500 ? 0.0 : 20.0 * -std::expm1(-(k - 500) / 160.0));
  }
  EXPECT_EQ(message(good, {}), "(accepted)");
  StandRecord r = good;
  r.current_a.pop_back();
  EXPECT_EQ(message(r, {}), "stand: 1000 times, 999 currents and 1000 wheel speeds, expected as many of each");
  EXPECT_EQ(message({{0}, {0.0}, {0.0}}, {}), "stand: 1 samples, expected at least 2");
  r = good;
  r.utime[700] += 1;
  EXPECT_EQ(message(r, {}), "stand: sample 700 comes 2001 us after the one before, expected 2000 us like the first two");
  EXPECT_EQ(message(good, {.cutoff_hz = 250.0}),
            "stand: cutoff 250 Hz, expected more than 0 and less than half the sample rate, 250 Hz");
  EXPECT_EQ(message(good, {.standstill_s = 0.03}),
            "stand: 15 of 1000 samples within the standstill of 0.03 s, expected at least 20 and not all");
  EXPECT_EQ(message(good, {.standstill_s = 2.0}),
            "stand: 1000 of 1000 samples within the standstill of 2 s, expected at least 20 and not all");
  // Mean of 500 zeros and 450 points of the exponential: 20 (450 - (1 - e^(-450/160)) / (1 - e^(-1/160))) / 950 = 6.298.
  EXPECT_EQ(message(good, {.standstill_s = 1.9}),
            "stand: the wheel turns at 6.3 rad/s within the first 1.9 s, expected standstill");
  r = good;
  std::fill(r.wheel_speed_radps.begin(), r.wheel_speed_radps.end(), 0.0);
  EXPECT_EQ(message(r, {}), "identification: the measured series does not change");
  r = good;
  std::fill(r.current_a.begin(), r.current_a.end(), 0.0);
  EXPECT_EQ(message(r, {}), "identification: the measured series does not tell the parameters apart");
}

}  // namespace
}  // namespace slipstream
