// A wheel that hardly slips on a slope, against the equations it was derived from, worked out here; and the Unimog's hill and
// brake.
#include "models/parts/rolling_wheel.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "models/processes/torque_friction.hpp"
#include "models/processes/torque_friction_load.hpp"
#include "models/vehicles/unimog.hpp"

namespace slipstream {
namespace {

// Table 15 with a bearing friction of 3 N m s; up a hill of 10 %, 2600 kg.
RollingWheel wheel() {
  RollingWheel w;
  w.wheel.quarter.viscous_friction_nms = 3.0;
  return w;
}
constexpr double kM = 2600.0, kR = 0.52, kJ = 11.5, kG = 9.81, kGrade = 0.1, kTorque_nm = 2500.0;
const double kA = std::atan(kGrade);

// At the demanded friction the wheel, by its own equation, and the vehicle, by its own, accelerate together: r w' = v'.
TEST(RollingWheel, AtTheDemandedFrictionWheelAndVehicleAccelerateTogether) {
  const double w = 12.0, v = 6.2;
  const RollingWheel rolling = wheel();
  const double mu = rolling.demanded_friction(RollingWheel::road(kM, kGrade), kTorque_nm, w, v);
  const double n = kM * kG * std::cos(kA);
  const double w_dot = (kTorque_nm - 3.0 * w - (mu + 0.02) * n * kR) / kJ;
  const double v_dot = mu * n / kM - 0.5 * 1.2 * 0.6 * 5.6 * v * v / kM - kG * std::sin(kA);
  EXPECT_NEAR(kR * w_dot, v_dot, 1e-11);  // rounding of terms of 2500 / 11.5 m/s^2
  EXPECT_GT(mu, 0.1);                     // T / (N r) = 0.19, minus the rolling resistance
}

// tau against the slope of the plant's own slip equation: l = (r w - v)/v, mu = C l, so -1/tau = d(l')/dl.
TEST(RollingWheel, RelaxesAsTheSlipOfATyreDoes) {
  const double v = 5.0;
  RollingWheel rolling = wheel();
  rolling.least_relaxation_s = 1e-12;
  const double n = kM * kG;
  const auto slip_rate = [&](double l) {
    const double w_dot = (kTorque_nm - 19.0 * l * n * kR) / kJ, v_dot = 19.0 * l * kG;
    return (kR * w_dot - v_dot) / v;  // without l v', which is left out
  };
  const double rate = (slip_rate(1e-3) - slip_rate(0.0)) / 1e-3;
  EXPECT_NEAR(rolling.relaxation_s(RollingWheel::road(kM, 0.0), v) * rate, -1.0, 1e-7);  // sqrt(v^2 + eps^2): 2e-8
}

// A step of the torque: after five tau + tau_0 the friction is there, and the wheel turns with its slip.
TEST(RollingWheel, FrictionFollowsAStepOfTheTorqueWithinASample) {
  TorqueFriction model;
  const double v = 8.0, before = 0.03;
  const Vector<double, 3> x(v * (1.0 + before / 19.0) / kR, v, before);
  const Vector<double, 3> after = [&] {
    Vector<double, 3> y = x;
    for (int i = 0; i < 100; ++i) {  // 10 ms by Euler steps of 0.1 ms, 20 to a tau
      y += 1e-4 * model.derivative<double>(y, Vector<double, 1>(2000.0));
    }
    return y;
  }();
  // By hand: ((2000 + 11.5/0.52 * 0.5*1.2*0.6*5.6*64/2000) / (2000*9.81*0.52) - 0.02) / (1 + 11.5/(2000*0.2704)) = 0.17245; v'
  // g moves v
  const double drag = 0.5 * 1.2 * 0.6 * 5.6 * 64.0 / 2000.0;
  const double mu = ((2000.0 + kJ / kR * drag) / (2000.0 * kG * kR) - 0.02) / (1.0 + kJ / (2000.0 * kR * kR));
  EXPECT_NEAR(after[2], mu, 0.0015);                                     // exp(-10 ms / 1.9 ms) = 0.5 % of the step of 0.14
  EXPECT_NEAR(after[0], after[1] * (1.0 + after[2] / 19.0) / kR, 1e-3);  // v' l tau / r: 3e-5 rad/s; Euler
  EXPECT_NEAR(after[1] - v, kG * 0.01 * 0.8 * mu, 0.004);  // the mean friction is about 0.8 of the last, minus drag
}

// A heavier vehicle is a smaller friction; a_x is the specific force and does not know the mass but for the drag.
TEST(TorqueFrictionLoad, OutputsAndRatesByHand) {
  TorqueFrictionLoad model;
  Vector<double, 5> x;
  x << 12.0, 6.2, 0.15, kGrade, kM;
  const Vector<double, 1> u(kTorque_nm);
  const auto z = model.output<double>(x, u);
  EXPECT_EQ(z[0], 12.0);
  const double drag = 0.5 * 1.2 * 0.6 * 5.6 * 6.2 * 6.2 / kM;
  EXPECT_NEAR(z[1], 0.15 * kG * std::cos(kA) - drag, 1e-14);  // rounding
  const auto rate = model.derivative<double>(x, u);
  EXPECT_NEAR(rate[1], z[1] - kG * std::sin(kA), 1e-14);  // the accelerometer stands on the slope, v' does not
  EXPECT_EQ(rate[3], 0.0);
  EXPECT_EQ(rate[4], 0.0);
  x[4] = -50.0;  // a wild estimate stays finite
  EXPECT_TRUE(model.derivative<double>(x, u).allFinite());
  // On the level with the known mass both models are one.
  TorqueFriction level;
  Vector<double, 5> y;
  y << 12.0, 6.2, 0.15, 0.0, 2000.0;
  const auto five = model.derivative<double>(y, u);
  const auto three = level.derivative<double>(Vector<double, 3>(12.0, 6.2, 0.15), u);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(five[i], three[i], 1e-13 * (1.0 + std::abs(three[i]))) << i;  // rounding
}

// --- The plant ------------------------------------------------------------------------------------------------------------

Unimog hilly() {
  Unimog u;
  u.grade_at_m = {10.0, 20.0}, u.grade = {0.0, 0.1};
  u.brake_from_mps = 8.0;
  u.prepare();
  return u;
}

TEST(UnimogHill, GradeIsLinearBetweenItsPointsAndEachIsAnEvent) {
  const Unimog u = hilly();
  EXPECT_EQ(u.initial_mode().road, 0U);
  Unimog::Mode m{3, false};
  EXPECT_EQ(u.grade_at(5.0, m), 0.0);
  EXPECT_EQ(u.events({5.0, 2.6, 10.0}, m)[3], 0.0);
  m = u.after_event(3, {5.0, 2.6, 10.0}, m);
  EXPECT_EQ(m.road, 1U);
  EXPECT_EQ(m.gear, 3);
  EXPECT_NEAR(u.grade_at(15.0, m), 0.05, 1e-15);  // rounding
  EXPECT_EQ(u.events({5.0, 2.6, 20.0}, m)[3], 0.0);
  m = u.after_event(3, {5.0, 2.6, 20.0}, m);
  EXPECT_NEAR(u.grade_at(100.0, m), 0.1, 1e-15);
  EXPECT_LT(u.events({5.0, 2.6, 1e6}, m)[3], 0.0) << "nothing follows the last point";
}

// Worked out here: N = m g cos a everywhere, the weight's share along the road, and the felt acceleration.
TEST(UnimogHill, DerivativeOnTheSlope) {
  const Unimog u = hilly();
  const Unimog::Mode m{4, false, false, 2};
  const double w = 9.0, v = 0.52 * w / 1.01;
  const double l = (0.52 * w - v) / std::sqrt(v * v + 1e-4), bl = 10.0 * l;
  const double mu = std::sin(1.9 * std::atan(bl - 0.97 * (bl - std::atan(bl))));
  const double n = 2000.0 * kG * std::cos(kA), torque = u.inputs({w, v, 30.0}, m)[0];
  const auto rate = u.derivative<double>({w, v, 30.0}, m);
  EXPECT_NEAR(rate[0], (torque - (mu + 0.02) * n * kR) / kJ, 1e-6);  // regularised sgn: 6e-9 of 18 rad/s^2
  const double felt = mu * n / 2000.0 - 0.5 * 1.2 * 0.6 * 5.6 * v * v / 2000.0;
  EXPECT_NEAR(rate[1], felt - kG * std::sin(kA), 1e-13);  // rounding
  const auto truth = u.truth({w, v, 30.0}, m);
  EXPECT_EQ(Unimog::kTruth[3].name, "a_x_mps2");
  EXPECT_NEAR(truth[3], felt, 1e-13);
  EXPECT_EQ(Unimog::kTruth[10].name, "grade");
  EXPECT_NEAR(truth[10], 0.1, 1e-15);
  EXPECT_EQ(truth[11], 2000.0);
}

TEST(UnimogHill, BrakesFromOneSpeedToAnotherAndPullsAwayInAGearThatFits) {
  const Unimog u = hilly();
  Unimog::Mode m{5, false};
  EXPECT_LT(u.events({15.0, 7.9, 0.0}, m)[2], 0.0);
  EXPECT_GT(u.events({15.0, 8.1, 0.0}, m)[2], 0.0);
  m = u.after_event(2, {15.4, 8.0, 0.0}, m);
  EXPECT_TRUE(m.braking);
  EXPECT_NEAR(u.inputs({10.0, 5.0, 0.0}, m)[0], -4000.0, 1e-4);  // regularised sgn: 5e-9
  EXPECT_NEAR(u.inputs({0.0, 0.0, 0.0}, m)[0], 0.0, 1e-12) << "a wheel at rest is not turned back";
  EXPECT_EQ(u.truth({10.0, 5.0, 0.0}, m)[8], 0.0) << "the clutch is open: no engine torque";
  EXPECT_LT(u.events({1e3, 5.0, 0.0}, m)[0], 0.0) << "no upshift";
  EXPECT_LT(u.events({4.0, 2.1, 0.0}, m)[2], 0.0);
  EXPECT_GT(u.events({3.8, 1.9, 0.0}, m)[2], 0.0);
  m = u.after_event(2, {3.8, 2.0, 0.0}, m);
  EXPECT_FALSE(m.braking);
  EXPECT_EQ(m.gear, 3);  // 3.8 rad/s * 4.375 * 6.94 = 1102 rpm
  EXPECT_FALSE(m.idling);
  m = u.after_event(2, {8.5, 4.4, 0.0}, {6, false, true, 0});
  EXPECT_EQ(m.gear, 4);  // third: 2465 rpm, beyond 2200; fourth: 1813 rpm
}

TEST(UnimogHill, RefusalsWordForWord) {
  const auto refusal = [](auto change) {
    Unimog u;
    change(u);
    try {
      u.prepare();
    } catch (const Refusal& r) {
      return std::string(r.what());
    }
    return std::string("(accepted)");
  };
  EXPECT_EQ(refusal([](Unimog& u) {
              u.grade = {0.0, 0.1};
            }),
            "vehicle.grade: has 2 values, expected 1, one for each of vehicle.grade_at_m");
  EXPECT_EQ(refusal([](Unimog& u) { u.grade_at_m = {}, u.grade = {}; }),
            "vehicle.grade: is empty, expected at least one number");
  EXPECT_EQ(refusal([](Unimog& u) {
              u.grade_at_m = {2.0, 2.0}, u.grade = {0.0, 0.1};
            }),
            "vehicle.grade_at_m: expected increasing numbers, found 2.000000 after 2.000000");
  EXPECT_EQ(refusal([](Unimog& u) { u.brake_from_mps = 2.0; }),
            "vehicle.brake_until_mps: found 2.000000, expected less than brake_from_mps");
  EXPECT_EQ(refusal([](Unimog& u) { u.brake_from_mps = 2.5; }), "(accepted)");
}

}  // namespace
}  // namespace slipstream
