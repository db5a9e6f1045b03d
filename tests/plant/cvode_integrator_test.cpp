#include "plant/cvode_integrator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/types.hpp"

namespace slipstream {
namespace {

// What the error control allows to add up: every step may err by its tolerance, and these systems do not amplify errors.
double allowed(const CvodeIntegrator& integrator, const CvodeTolerances& tolerances, double size) {
  return static_cast<double>(integrator.steps()) * (tolerances.relative * size + tolerances.absolute);
}

OdeSystem linear(const Matrix<double, 2>& a) {
  OdeSystem s;
  s.states = 2;
  s.derivative = [a](const double* x, double* rate) {
    Eigen::Map<Vector<double, 2>> result(rate);
    result = a * Eigen::Map<const Vector<double, 2>>(x);
  };
  s.jacobian = [a](const double*, double* j) { Eigen::Map<Matrix<double, 2>>{j} = a; };  // column-major, as Eigen's
  return s;
}

// The textbook's stiff pair: eigenvalues -1 and -1000. From (1, 0): x = (2 e^-t - e^-1000t, -e^-t + e^-1000t).
Matrix<double, 2> stiff() {
  Matrix<double, 2> a;
  a << 998.0, 1998.0, -999.0, -1999.0;
  return a;
}

TEST(Cvode, StiffLinearSystemAgainstItsClosedForm) {
  for (const CvodeTolerances tolerances :
       {CvodeTolerances{1e-6, 1e-8}, CvodeTolerances{1e-8, 1e-10}, CvodeTolerances{1e-10, 1e-12}}) {
    CvodeIntegrator integrator(linear(stiff()), tolerances, std::array{1.0, 0.0});
    for (const double t : {0.001, 0.01, 0.1, 1.0, 5.0}) {
      EXPECT_FALSE(integrator.advance(t));
      EXPECT_EQ(integrator.time_s(), t);
      const double slow = std::exp(-t), fast = std::exp(-1000.0 * t);
      EXPECT_NEAR(integrator.state()[0], 2.0 * slow - fast, allowed(integrator, tolerances, 1.0)) << t;  // see allowed()
      EXPECT_NEAR(integrator.state()[1], -slow + fast, allowed(integrator, tolerances, 1.0)) << t;       // see allowed()
    }
    // An explicit method needs at least |l| t / 2.8 = 1800 steps for stability; an implicit one with the right Jacobian does
    // not.
    if (tolerances.relative > 1e-9) {
      EXPECT_LT(integrator.steps(), 1000);
    }
  }
}

TEST(Cvode, TighterTolerancesGiveSmallerErrors) {
  const auto error = [](CvodeTolerances tolerances) {
    CvodeIntegrator integrator(linear(stiff()), tolerances, std::array{1.0, 0.0});
    integrator.advance(1.0);
    return std::abs(integrator.state()[0] - 2.0 * std::exp(-1.0));
  };
  EXPECT_LT(error({1e-9, 1e-11}), 0.1 * error({1e-5, 1e-7}));  // ideally 1e-4 of it; the factor leaves room for luck
}

// Samples interpolate: a hundred times as many of them cost no step and move no value. The first sample is the same for both.
TEST(Cvode, FrequentSamplesDoNotRestartTheIntegrator) {
  CvodeIntegrator coarse(linear(stiff()), {}, std::array{1.0, 0.0}), fine(linear(stiff()), {}, std::array{1.0, 0.0});
  coarse.advance(0.001);
  for (int k = 1; k <= 10; ++k) {
    coarse.advance(0.1 * k);
    for (int i = 1; i <= 100; ++i) fine.advance(i == 100 ? 0.1 * k : 0.1 * (k - 1) + 0.001 * i);
    EXPECT_EQ(coarse.state()[0], fine.state()[0]) << k;
  }
  EXPECT_EQ(coarse.steps(), fine.steps());
}

TEST(Cvode, NeverGoesBack) {
  CvodeIntegrator integrator(linear(stiff()), {}, std::array{1.0, 0.0});
  EXPECT_EQ(integrator.time_s(), 0.0);
  EXPECT_FALSE(integrator.advance(0.0));
  EXPECT_EQ(integrator.state()[0], 1.0);
  integrator.advance(0.5);
  const double before = integrator.state()[0];
  EXPECT_FALSE(integrator.advance(0.4));
  EXPECT_EQ(integrator.time_s(), 0.5);
  EXPECT_EQ(integrator.state()[0], before);
}

// x'' = -x from (1, 0): x = cos t falls through 0 at pi/2 and rises through it at 3 pi/2; x' = -sin t at pi.
OdeSystem oscillator(std::vector<int> directions) {
  Matrix<double, 2> a;
  a << 0.0, 1.0, -1.0, 0.0;
  OdeSystem s = linear(a);
  s.events = 2;
  s.event_values = [](const double* x, double* g) {
    g[0] = x[0];
    g[1] = x[1];
  };
  s.crossing_direction = std::move(directions);
  return s;
}

constexpr CvodeTolerances kTight{1e-11, 1e-13};
constexpr double kEventTime_s = 1e-8;  // the bar for event times; kTight over some 1e3 steps would allow it

TEST(Cvode, EventTimesAndWhichEventInOrder) {
  CvodeIntegrator integrator(oscillator({0, 0}), kTight, std::array{1.0, 0.0});
  for (int k = 1; k <= 4; ++k) {  // cos at pi/2, sin at pi, cos at 3 pi/2, sin at 2 pi
    const auto event = integrator.advance(100.0);
    ASSERT_TRUE(event.has_value()) << k;
    EXPECT_EQ(*event, k % 2 == 1 ? 0 : 1);
    EXPECT_NEAR(integrator.time_s(), 0.5 * k * kPi, kEventTime_s) << k;
    EXPECT_NEAR(integrator.state()[static_cast<std::size_t>(*event)], 0.0, kEventTime_s) << k;  // slope 1: as the time
  }
}

TEST(Cvode, OnlyCrossingsInTheWantedDirectionCount) {
  CvodeIntegrator rising(oscillator({1, -1}), kTight, std::array{1.0, 0.0});  // x rising: 3 pi/2; x' falling: 2 pi (-sin t)
  EXPECT_EQ(rising.advance(100.0), std::optional(0));
  EXPECT_NEAR(rising.time_s(), 1.5 * kPi, kEventTime_s);
  EXPECT_EQ(rising.advance(100.0), std::optional(1));
  EXPECT_NEAR(rising.time_s(), 2.0 * kPi, kEventTime_s);
  CvodeIntegrator falling(oscillator({-1, 1}), kTight, std::array{1.0, 0.0});
  EXPECT_EQ(falling.advance(100.0), std::optional(0));
  EXPECT_NEAR(falling.time_s(), 0.5 * kPi, kEventTime_s);
  EXPECT_EQ(falling.advance(100.0), std::optional(1));
  EXPECT_NEAR(falling.time_s(), kPi, kEventTime_s);
}

TEST(Cvode, AnEventAfterTheAskedTimeWaits) {
  CvodeIntegrator integrator(oscillator({0, 0}), kTight, std::array{1.0, 0.0});
  EXPECT_FALSE(integrator.advance(1.5));  // before pi/2, although the internal step may already be past it
  EXPECT_EQ(integrator.time_s(), 1.5);
  EXPECT_NEAR(integrator.state()[0], std::cos(1.5), 1e-8);  // global error as for the event times
  EXPECT_EQ(integrator.advance(1.6), std::optional(0));
  EXPECT_FALSE(integrator.advance(1.6));  // the way from the event to the asked time
  EXPECT_EQ(integrator.time_s(), 1.6);
}

// A ball dropped from h = 1 m that keeps 0.8 of its speed at each bounce: t1 = sqrt(2h/g), then flights of 2 * 0.8^k
// sqrt(2h/g).
TEST(Cvode, RestartAfterADiscontinuityBouncingBall) {
  OdeSystem ball;
  ball.states = 2;
  ball.events = 1;
  ball.derivative = [](const double* x, double* rate) {
    rate[0] = x[1];
    rate[1] = -9.81;
  };
  ball.jacobian = [](const double*, double* j) {
    j[0] = j[1] = j[3] = 0.0;
    j[2] = 1.0;  // d(x0')/d(x1), column-major
  };
  ball.event_values = [](const double* x, double* g) { g[0] = x[0]; };
  ball.crossing_direction = {-1};
  CvodeIntegrator integrator(ball, kTight, std::array{1.0, 0.0});
  const double fall = std::sqrt(2.0 / 9.81);
  double time = fall, speed = 9.81 * fall;
  for (int bounce = 0; bounce < 6; ++bounce) {
    ASSERT_EQ(integrator.advance(100.0), std::optional(0)) << bounce;
    EXPECT_NEAR(integrator.time_s(), time, kEventTime_s) << bounce;
    EXPECT_NEAR(integrator.state()[1], -speed, 1e-7) << bounce;  // g times the error of the time
    speed *= 0.8;
    integrator.restart(std::array{0.0, speed});
    EXPECT_EQ(integrator.state()[1], speed);
    time += 2.0 * speed / 9.81;
  }
}

// restart from the integrator's own storage is what the simulation does.
TEST(Cvode, RestartInPlaceKeepsStateAndTime) {
  CvodeIntegrator integrator(oscillator({0, 0}), kTight, std::array{1.0, 0.0});
  integrator.advance(1.0);
  integrator.restart(integrator.state());
  EXPECT_EQ(integrator.time_s(), 1.0);
  EXPECT_NEAR(integrator.state()[0], std::cos(1.0), kEventTime_s);  // as the event times
  integrator.advance(1.5);
  EXPECT_NEAR(integrator.state()[0], std::cos(1.5), kEventTime_s);
}

// x' = x^2 from 1 is infinite at t = 1.
TEST(Cvode, FailureIsAnExceptionThatNamesTheCall) {
  OdeSystem blow_up;
  blow_up.states = 1;
  blow_up.derivative = [](const double* x, double* rate) { rate[0] = x[0] * x[0]; };
  blow_up.jacobian = [](const double* x, double* j) { j[0] = 2.0 * x[0]; };
  CvodeIntegrator integrator(blow_up, {}, std::array{1.0});
  ::testing::internal::CaptureStderr();  // CVODE writes its own lines there
  std::string message;
  try {
    integrator.advance(2.0);
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  ::testing::internal::GetCapturedStderr();
  EXPECT_EQ(message.substr(0, 31), "CVODE: CVode failed with flag -") << message;  // -1, -3 or -4, by where it gives up
}

}  // namespace
}  // namespace slipstream
