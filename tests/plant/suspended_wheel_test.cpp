// The wheel on the stand: its current, its events, and CVODE against the closed form across every kink.
#include "models/vehicles/suspended_wheel.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "plant/vehicle_simulation.hpp"

namespace slipstream {
namespace {

constexpr CvodeTolerances kTolerances{1e-8, 1e-10};  // those of the scenarios

SuspendedWheel wheel(std::vector<double> time_s, std::vector<double> current_a) {
  SuspendedWheel w;
  w.current_time_s = std::move(time_s);
  w.current_a = std::move(current_a);
  w.prepare();
  return w;
}

double current_at(const SuspendedWheel& vehicle, double t_s) {
  VehicleSimulation<SuspendedWheel> run(vehicle, kTolerances);
  run.advance(t_s);
  return run.vehicle().truth(run.state(), run.mode())[1];
}

TEST(SuspendedWheel, TheCurrentFollowsItsPoints) {
  const SuspendedWheel w = wheel({0.5, 1.0, 1.0, 2.0}, {2.0, 4.0, -1.0, 3.0});  // a ramp, a step, a ramp
  // Time is a state, integrated to 1e-8.
  EXPECT_NEAR(current_at(w, 0.2), 2.0, 1e-7);
  EXPECT_NEAR(current_at(w, 0.75), 3.0, 1e-7);
  EXPECT_NEAR(current_at(w, 0.999), 3.996, 1e-7);
  EXPECT_NEAR(current_at(w, 1.001), -0.996, 1e-7);
  EXPECT_NEAR(current_at(w, 1.5), 1.0, 1e-7);
  EXPECT_NEAR(current_at(w, 7.0), 3.0, 1e-7);
  EXPECT_NEAR(current_at(wheel({0.0, 1.0}, {1.0, 2.0}), 0.0), 1.0, 0.0);  // a first point at the start
}

TEST(SuspendedWheel, EveryPointIsAnEventAndAStepIsOne) {
  VehicleSimulation<SuspendedWheel> run(wheel({0.5, 1.0, 1.0, 2.0}, {2.0, 4.0, -1.0, 3.0}), kTolerances);
  run.advance(5.0);
  ASSERT_EQ(run.changes().size(), 3u);
  const double expected_s[]{0.5, 1.0, 2.0};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(run.changes()[i].time_s, expected_s[i], 1e-9);  // root finding on a line
}

// w = w0 e^(-t/tau) + k_m/b times the convolution of the current, here a step and a ramp one after the other.
TEST(SuspendedWheel, SpeedIsTheClosedForm) {
  const SuspendedWheel w = wheel({1.0, 1.0, 2.0, 3.0}, {0.0, 10.0, 10.0, 4.0});
  VehicleSimulation<SuspendedWheel> run(w, kTolerances);
  const double k_m = 0.0027 * 70.0 * 30.0 / (13.0 * 19.0), tau = 3.2e-3 / 0.01, gain = k_m / 0.01;
  const auto step = [&](double t) { return t > 0.0 ? -std::expm1(-t / tau) : 0.0; };           // of 1 A at 0
  const auto ramp = [&](double t) { return t > 0.0 ? t + tau * std::expm1(-t / tau) : 0.0; };  // of 1 A/s from 0
  for (int k = 1; k <= 400; ++k) {
    const double t = 0.01 * k;
    run.advance(t);
    const double expected = gain * (10.0 * step(t - 1.0) - 6.0 * ramp(t - 2.0) + 6.0 * ramp(t - 3.0));
    EXPECT_NEAR(run.state()[0], expected, 1e-6 * 23.0) << t;  // hundred times the integrator's tolerance of the largest speed
    const auto truth = run.vehicle().truth(run.state(), run.mode());
    EXPECT_DOUBLE_EQ(truth[2], k_m * truth[1]);  // the factors of k_m in another order
    EXPECT_EQ(run.vehicle().inputs(run.state(), run.mode())[0], truth[2]);
  }
}

std::string refusal(std::vector<double> time_s, std::vector<double> current_a) {
  try {
    wheel(std::move(time_s), std::move(current_a));
  } catch (const Refusal& r) {
    return r.what();
  }
  return "(accepted)";
}

TEST(SuspendedWheel, Refusals) {
  EXPECT_EQ(refusal({0.0, 1.0}, {1.0}), "vehicle.current_a: has 1 values, expected 2, one for each of vehicle.current_time_s");
  EXPECT_EQ(refusal({}, {}), "vehicle.current_time_s: is empty, expected at least one time");
  EXPECT_EQ(
      refusal({0.0, 2.0, 1.0}, {1.0, 2.0, 3.0}),
      "vehicle.current_time_s: expected increasing times, or two that are equal for a step, found 1.000000 after 2.000000");
  EXPECT_EQ(refusal({0.0, 1.0, 1.0}, {1.0, 2.0, 3.0}), "(accepted)");
}

}  // namespace
}  // namespace slipstream
