#include "estimators/identification/wheel_response.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace slipstream {
namespace {

constexpr WheelParameters kWheel{3.2e-3, 0.01};
constexpr double kTau_s = 0.32;

std::vector<Utime> times(Utime period, std::size_t n) {
  std::vector<Utime> t(n);
  for (std::size_t k = 0; k < n; ++k) t[k] = period * static_cast<Utime>(k);
  return t;
}

TEST(WheelResponse, ExactForAStepAndARamp) {
  // Periods that make x = b h / J from 6e-6 to 3: both sides of the switch to the series.
  for (const Utime period : {2, 300, 319, 321, 2000, 1'000'000}) {
    const auto t = times(period, 200);
    std::vector<double> step(t.size(), 0.2), ramp, w;
    for (const Utime u : t) ramp.push_back(0.5 * seconds(u));
    wheel_response(Method::kExact, Hold::kLinear, kWheel, t, step, 3.0, w);
    for (std::size_t k = 0; k < t.size(); ++k) {
      const double decay = std::exp(-seconds(t[k]) / kTau_s);
      EXPECT_NEAR(w[k], 20.0 + (3.0 - 20.0) * decay, 1e-12 * 20.0) << period << " us, " << k;  // rounding of 200 steps
    }
    wheel_response(Method::kExact, Hold::kLinear, kWheel, t, ramp, 0.0, w);
    for (std::size_t k = 0; k < t.size(); ++k) {
      const double s = seconds(t[k]);  // w = a/b (t - tau (1 - e^(-t/tau))), a = 0.5 N m/s
      const double expected = 50.0 * (s + kTau_s * std::expm1(-s / kTau_s));
      EXPECT_NEAR(w[k], expected, 1e-11 * std::max(expected, 1e-3)) << period << " us, " << k;  // both cancel to 1e-5 of a term
    }
  }
}

TEST(WheelResponse, ExactWithoutFriction) {
  const auto t = times(2000, 501);
  std::vector<double> w;
  wheel_response(Method::kExact, Hold::kLinear, {0.5, 0.0}, t, std::vector<double>(t.size(), 2.0), 1.0, w);
  EXPECT_NEAR(w.back(), 1.0 + 4.0, 1e-12);  // w0 + T t / J, t = 1 s; rounding
}

TEST(WheelResponse, ConstantHoldKeepsTheTorqueUntilTheNextSample) {
  const std::vector<Utime> t{0, 100'000, 350'000};  // unequal steps
  const std::vector<double> torque{0.0, 0.1, 5.0};
  for (const Method method : {Method::kExact, Method::kRungeKutta}) {
    std::vector<double> w;
    wheel_response(method, Hold::kConstant, kWheel, t, torque, 0.0, w);
    EXPECT_EQ(w[1], 0.0);
    // 10 rad/s (1 - e^(-0.25 / 0.32)); one Runge-Kutta step of x = 0.78 errs by x^5 / 120 of 10 rad/s.
    EXPECT_NEAR(w[2], 10.0 * -std::expm1(-0.25 / kTau_s), method == Method::kExact ? 1e-14 : 0.03);
  }
}

// The error of Runge-Kutta falls by 2^4 when the step is halved.
TEST(WheelResponse, RungeKuttaIsOfFourthOrder) {
  const auto error = [](Utime period) {
    const auto t = times(period, static_cast<std::size_t>(1'600'000 / period) + 1);
    std::vector<double> torque, rk, exact;
    for (const Utime u : t) torque.push_back(u <= 800'000 ? 0.4 * seconds(u) : 0.32);  // the kink is a sample of every grid
    wheel_response(Method::kRungeKutta, Hold::kLinear, kWheel, t, torque, 5.0, rk);
    wheel_response(Method::kExact, Hold::kLinear, kWheel, t, torque, 5.0, exact);
    return std::abs(rk.back() - exact.back());
  };
  const double coarse = error(40'000), fine = error(20'000), finest = error(10'000);
  EXPECT_GT(finest, 1e-12);                          // above rounding
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.15);  // the next order adds x / 6 = 0.125 / 6 of itself, a few times
  EXPECT_NEAR(std::log2(fine / finest), 4.0, 0.15);
}

}  // namespace
}  // namespace slipstream
