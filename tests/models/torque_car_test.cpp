#include "models/vehicles/torque_car.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace slipstream {
namespace {

using State = TorqueCar::State;

template <typename Change>
TorqueCar prepared(const Change& change) {
  TorqueCar c;
  change(c);
  c.prepare();
  return c;
}

template <typename Change>
std::string refusal(const Change& change) {
  try {
    prepared(change);
  } catch (const Refusal& r) {
    return r.what();
  }
  return "(accepted)";
}

double named(const TorqueCar& c, const State& x, TorqueCar::Mode mode, std::string_view name) {
  const auto truth = c.truth(x, mode);
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (TorqueCar::kTruth[k].name == name) return truth[k];
  ADD_FAILURE() << name;
  return 0.0;
}

State state(double w, double v, double motor_nm = 0.0, double t = 0.0) {
  State x;
  x << w, v, 7.0, motor_nm, t;
  return x;
}

TEST(TorqueCar, RefusalsWordForWord) {
  EXPECT_EQ(refusal([](TorqueCar&) {}), "(accepted)");
  EXPECT_EQ(refusal([](TorqueCar& c) { c.torque_time_s.clear(); }),
            "vehicle.torque_time_s: is empty, expected at least one time");
  EXPECT_EQ(refusal([](TorqueCar& c) {
              c.torque_nm = {1.0, 2.0};
            }),
            "vehicle.torque_nm: has 2 values, expected 1, one for each of vehicle.torque_time_s");
  EXPECT_EQ(
      refusal([](TorqueCar& c) {
        c.torque_time_s = {2.0, 2.0, 2.0}, c.torque_nm = {1.0, 2.0, 3.0};
      }),
      "vehicle.torque_time_s: expected increasing times, or two that are equal for a step, found 2.000000 after 2.000000");
  EXPECT_EQ(
      refusal([](TorqueCar& c) {
        c.torque_time_s = {0.0, 2.0, 1.5}, c.torque_nm = {1.0, 2.0, 3.0};
      }),
      "vehicle.torque_time_s: expected increasing times, or two that are equal for a step, found 1.500000 after 2.000000");
}

TEST(TorqueCar, ParametersOfTable3) {
  const TorqueCar c;
  EXPECT_EQ(c.quarter.mass_kg, 431.0);
  EXPECT_EQ(c.quarter.wheel_inertia_kgm2, 2.1);
  EXPECT_EQ(c.quarter.wheel_radius_m, 0.3);
  EXPECT_EQ(c.quarter.rolling_resistance, 0.015);
  EXPECT_EQ(c.quarter.viscous_friction_nms, 0.0);
  EXPECT_EQ(c.quarter.air_density_kgpm3, 1.225);
  EXPECT_EQ(c.quarter.frontal_area_m2, 2.0);
  EXPECT_EQ(c.quarter.drag_coefficient, 0.45);
}

// T is linear between the points and constant outside; every point begins a mode.
TEST(TorqueCar, TorqueFollowsItsPoints) {
  const TorqueCar c = prepared([](TorqueCar& p) { p.torque_time_s = {1.0, 2.0, 4.0}, p.torque_nm = {10.0, 30.0, 20.0}; });
  const auto torque = [&](double t, TorqueCar::Mode mode) { return c.inputs(state(1.0, 0.3, 0.0, t), mode)[0]; };
  EXPECT_EQ(c.initial_mode(), 0u);
  EXPECT_EQ(torque(0.25, 0), 10.0);
  EXPECT_NEAR(torque(1.25, 1), 15.0, 1e-13);  // rounding
  EXPECT_NEAR(torque(3.0, 2), 25.0, 1e-13);
  EXPECT_EQ(torque(9.0, 3), 20.0);
  const double points[]{1.0, 2.0, 4.0};
  for (TorqueCar::Mode m = 0; m < 3; ++m) {
    EXPECT_LT(c.events(state(1.0, 0.3, 0.0, points[m] - 0.1), m)[0], 0.0);
    EXPECT_EQ(c.events(state(1.0, 0.3, 0.0, points[m]), m)[0], 0.0);
    EXPECT_EQ(c.after_event(0, state(1.0, 0.3), m), m + 1);
  }
  EXPECT_LT(c.events(state(1.0, 0.3, 0.0, 1e6), 3)[0], 0.0) << "nothing follows the last point";
  EXPECT_EQ(prepared([](TorqueCar&) {}).initial_mode(), 1u) << "a point at the start is past";
}

// Both accelerations against the document's equations, worked out here.
TEST(TorqueCar, DerivativeAgainstTheDocumentsEquations) {
  const TorqueCar c = prepared([](TorqueCar& p) { p.torque_nm = {300.0}, p.quarter.viscous_friction_nms = 0.4; });
  const double w = 40.0, v = 10.0;
  const double l = (0.3 * w - v) / std::sqrt(v * v + 1e-4), bl = 5.0 * l;
  const double mu = 0.3 * std::sin(2.0 * std::atan(bl - 1.0 * (bl - std::atan(bl))));  // snow: Table 1
  const double mg = 431.0 * 9.81;
  const auto rate = c.derivative<double>(state(w, v), 1);
  EXPECT_NEAR(rate[0], (300.0 - mu * mg * 0.3 - 0.015 * mg * 0.3 - 0.4 * w) / 2.1,
              1e-8);                                                                  // regularised sgn: 3e-10 of 9 rad/s^2
  EXPECT_NEAR(rate[1], mu * 9.81 - 0.5 * 1.225 * 0.45 * 2.0 * v * v / 431.0, 1e-13);  // rounding
  EXPECT_EQ(rate[2], v);
  EXPECT_EQ(rate[3], 0.0);
  EXPECT_EQ(rate[4], 1.0);
}

TEST(TorqueCar, FrictionHistories) {
  const TorqueCar constant = prepared([](TorqueCar& p) { p.friction = "constant", p.friction_constant = 0.17; });
  for (const double w : {0.0, 3.0, 100.0}) EXPECT_EQ(named(constant, state(w, 5.0), 1, "friction"), 0.17);
  const TorqueCar step = prepared([](TorqueCar& p) {
    p.friction = "step", p.step_time_s = 3.0, p.torque_time_s = {1.0, 5.0}, p.torque_nm = {10.0, 50.0};
  });
  // The modes are the times -1 s, 1-3 s, 3-5 s, 5- s; the torque's line goes on through the friction's step.
  const double expected[]{0.1, 0.1, 0.25, 0.25};
  for (TorqueCar::Mode m = 0; m < 4; ++m) EXPECT_EQ(named(step, state(20.0, 5.0), m, "friction"), expected[m]) << m;
  EXPECT_NEAR(step.inputs(state(20.0, 5.0, 0.0, 3.0), 1)[0], 30.0, 1e-13);  // rounding
  EXPECT_NEAR(step.inputs(state(20.0, 5.0, 0.0, 3.0), 2)[0], 30.0, 1e-13);
  EXPECT_EQ(step.events(state(20.0, 5.0, 0.0, 3.0), 1)[0], 0.0);
}

// N = m (g + k a_x) and m a_x = mu N - R_aer at once; the torques of the ground grow with N.
TEST(TorqueCar, LoadTransferSatisfiesItsRelation) {
  for (const double k : {-0.3, 0.2, 0.5})
    for (const double w : {20.0, 60.0}) {
      const TorqueCar c = prepared([k](TorqueCar& p) { p.surface = "dry", p.load_transfer = k; });
      const State x = state(w, 5.0);
      const double a = named(c, x, 1, "a_x_mps2"), n = named(c, x, 1, "normal_force_n"), mu = named(c, x, 1, "friction");
      EXPECT_NEAR(n, 431.0 * (9.81 + k * a), 1e-9);                                              // rounding of 4e3 N
      EXPECT_NEAR(431.0 * a, mu * n - 0.5 * 1.225 * 0.45 * 2.0 * 25.0, 1e-9);                    // the same
      EXPECT_NEAR(c.derivative<double>(x, 1)[0], (200.0 - (mu + 0.015) * n * 0.3) / 2.1, 1e-7);  // regularised sgn
    }
  EXPECT_EQ(named(prepared([](TorqueCar&) {}), state(20.0, 5.0), 1, "normal_force_n"), 431.0 * 9.81);
}

TEST(TorqueCar, TheMotorLagsAndEstimatorsAreToldTheCommand) {
  const TorqueCar c = prepared([](TorqueCar& p) { p.motor_lag_s = 0.25; });
  const State x = state(30.0, 9.0, 120.0);
  EXPECT_EQ(named(c, x, 1, "drive_torque_nm"), 200.0);
  EXPECT_EQ(named(c, x, 1, "motor_torque_nm"), 120.0);
  EXPECT_EQ(c.inputs(x, 1)[0], 200.0);
  EXPECT_NEAR(c.derivative<double>(x, 1)[3], (200.0 - 120.0) / 0.25, 1e-12);  // rounding
  EXPECT_EQ(named(prepared([](TorqueCar&) {}), x, 1, "motor_torque_nm"), 200.0) << "no lag: the command";
}

}  // namespace
}  // namespace slipstream
