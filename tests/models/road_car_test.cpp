// A kinematic drive: its motion is the exact derivative of its path, and closed forms.
#include "models/vehicles/road_car.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/rk4.hpp"

namespace slipstream {
namespace {

using State = RoadCar::State;

// Everything at once: overlapping curve, hill, bank and bumps.
RoadCar winding() {
  RoadCar c;
  c.speed_time_s = {1.0, 6.0, 9.0, 12.0};
  c.speed_mps = {0.0, 12.0, 12.0, 5.0};
  c.curvature_distance_m = {10, 20, 40, 60, 70};
  c.curvature_radpm = {0.0, 0.05, 0.05, -0.04, 0.0};
  c.grade_distance_m = {15, 35, 60};
  c.grade = {0.0, 0.1, -0.05};
  c.bank_distance_m = {5, 25, 50};
  c.bank_rad = {0.0, -0.1, 0.05};
  c.bumps = {{22, 45, 55}, {6.0, 5.0, 5.0}, {0.1, -0.08, 0.06}};
  c.initial_yaw_rad = 2.0;
  c.prepare();
  return c;
}

RoadCar steady(double v, double curvature = 0.0, double grade = 0.0, double bank = 0.0) {
  RoadCar c;
  c.speed_time_s = {0.0};
  c.speed_mps = {v};
  c.curvature_distance_m = c.grade_distance_m = c.bank_distance_m = {0.0};
  c.curvature_radpm = {curvature};
  c.grade = {grade};
  c.bank_rad = {bank};
  c.prepare();
  return c;
}

State integrated(const RoadCar& c, State x, double duration_s, int steps) {
  const RoadCar::Mode mode;
  for (int i = 0; i < steps; ++i) x = rk4_step([&](const State& s) { return c.derivative(s, mode); }, x, duration_s / steps);
  return x;
}

RigidMotion motion_of(const RoadCar& c, const State& x) { return c.motion(x, RoadCar::Mode{}); }

// Whether a point of a profile lies between the two states: there the third derivatives jump.
bool crosses(const RoadCar& c, const State& a, const State& b) {
  const auto any = [](const std::vector<double>& points, double from, double to) {
    return std::any_of(points.begin(), points.end(), [&](double p) { return from <= p && p <= to; });
  };
  bool found = any(c.speed_time_s, a[5], b[5]);
  for (const auto* points : {&c.curvature_distance_m, &c.grade_distance_m, &c.bank_distance_m, &c.bumps.position_m})
    found = found || any(*points, a[4], b[4]);
  for (std::size_t i = 0; i < c.bumps.position_m.size(); ++i)
    found = found || any({c.bumps.position_m[i] + c.bumps.length_m[i]}, a[4], b[4]);
  return found;
}

TEST(RoadCar, MotionIsTheDerivativeOfThePath) {
  const RoadCar c = winding();
  const double h = 2e-5;
  State x = c.initial_state();
  int checked = 0;
  for (int k = 0; k < 1200; ++k) {
    x = integrated(c, x, 0.0101, 10);
    const State before = integrated(c, x, -h, 1), after = integrated(c, x, h, 1);
    if (crosses(c, before, after)) continue;
    const RigidMotion m = motion_of(c, x), a = motion_of(c, before), b = motion_of(c, after);
    // Central differences: truncation h^2/6 times the third derivatives. The largest are those over the bump of 0.08 m and 5 m
    // at 12 m/s: v^4 d4h/ds4 = v^4 40 H k^4 = 1.0e4 m/s^4 of v, v^4 d5h/ds5 = v^4 160 H k^5 = 2.6e4 rad/s^4 of w (160 taken
    // roughly): 7e-7 and 2e-6. Rounding: 100 m * 1e-16 / h = 5e-10.
    EXPECT_LT(((b.p_WB - a.p_WB) / (2.0 * h) - m.v_WB).norm(), 1e-6) << x[5];
    EXPECT_LT(((b.v_WB - a.v_WB) / (2.0 * h) - m.a_WB).norm(), 1e-6) << x[5];
    EXPECT_LT((local_minus(b.q_WB, a.q_WB) / (2.0 * h) - m.w_WB_B).norm(), 1e-6) << x[5];
    EXPECT_LT(((b.w_WB_B - a.w_WB_B) / (2.0 * h) - m.alpha_WB_B).norm(), 1e-5) << x[5];
    // It moves along its own x axis.
    EXPECT_LT((m.q_WB.conjugate() * m.v_WB - m.v_WB.norm() * Vector3::UnitX()).norm(), 1e-13);  // rounding of 12 m/s
    ++checked;
  }
  EXPECT_GT(checked, 1100);
  EXPECT_GT(x[4], 70.0) << "it has seen the whole road";
}

TEST(RoadCar, MotionIsContinuousOverEveryPoint) {
  const RoadCar c = winding();
  const auto expect_same = [&](const State& below, const State& above) {
    const RigidMotion a = motion_of(c, below), b = motion_of(c, above);
    // 2e-9 m or s apart; the steepest is alpha over a bump, 1600 rad/s^3 (above).
    EXPECT_LT((a.a_WB - b.a_WB).norm(), 1e-5) << below.transpose();
    EXPECT_LT((a.w_WB_B - b.w_WB_B).norm(), 1e-5) << below.transpose();
    EXPECT_LT((a.alpha_WB_B - b.alpha_WB_B).norm(), 1e-5) << below.transpose();
  };
  for (const double s : {5., 10., 15., 20., 22., 25., 28., 35., 40., 45., 50., 55., 60., 70.}) {
    State x = c.initial_state();
    x[5] = 7.7;  // 12 m/s
    x[4] = s - 1e-9;
    State above = x;
    above[4] = s + 1e-9;
    expect_same(x, above);
  }
  for (const double t : c.speed_time_s) {
    State x = c.initial_state();
    x[4] = 30.0;
    x[5] = t - 1e-9;
    State above = x;
    above[5] = t + 1e-9;
    expect_same(x, above);
  }
}

// --- Closed forms -----------------------------------------------------------------------------------------------------

TEST(RoadCar, StandingItFeelsGravityAlone) {
  RoadCar c = winding();
  const RigidMotion m = motion_of(c, c.initial_state());
  EXPECT_LT((m.specific_force_of(Vector3::Zero(), 9.81) - Vector3(0.0, 0.0, 9.81)).norm(), 1e-14);  // rounding
  EXPECT_EQ(m.w_WB_B.norm(), 0.0);
  EXPECT_EQ(m.alpha_WB_B.norm(), 0.0);
  EXPECT_EQ(m.v_WB.norm(), 0.0);
}

TEST(RoadCar, OnALevelCircleTheForceIsCentripetal) {
  const double v = 10.0, radius = 20.0;
  const RoadCar c = steady(v, 1.0 / radius);
  const State x = integrated(c, c.initial_state(), kPi * radius / v, 2000);  // half a lap
  EXPECT_NEAR(x[0], 0.0, 1e-9);                                              // fourth order: 2000 steps of 1.6 mrad
  EXPECT_NEAR(x[1], 2.0 * radius, 1e-9);                                     // to the left
  const RigidMotion m = motion_of(c, x);
  EXPECT_LT((m.specific_force_of(Vector3::Zero(), 9.81) - Vector3(0.0, v * v / radius, 9.81)).norm(), 1e-12);  // rounding
  EXPECT_LT((m.w_WB_B - Vector3(0.0, 0.0, v / radius)).norm(), 1e-15);
  EXPECT_LT(m.alpha_WB_B.norm(), 1e-15);
}

TEST(RoadCar, UphillAndOnABankGravityTurns) {
  const double u = 0.1;
  const RigidMotion up = motion_of(steady(8.0, 0.0, u), State::Zero());
  EXPECT_LT((up.specific_force_of(Vector3::Zero(), 10.0) - Vector3(10.0 * u, 0.0, 10.0 * std::sqrt(1.0 - u * u))).norm(),
            1e-14);
  EXPECT_LT((up.v_WB - 8.0 * Vector3(std::sqrt(1.0 - u * u), 0.0, u)).norm(), 1e-14);
  const RoadCar hill = steady(8.0, 0.0, u);
  EXPECT_DOUBLE_EQ(hill.truth(State::Zero(), {})[7], -std::asin(u)) << "nose up is negative pitch";
  const RigidMotion left_up = motion_of(steady(8.0, 0.0, 0.0, 0.2), State::Zero());
  EXPECT_LT((left_up.specific_force_of(Vector3::Zero(), 10.0) - 10.0 * Vector3(0.0, std::sin(0.2), std::cos(0.2))).norm(),
            1e-14);
}

TEST(RoadCar, ABumpIsAsHighAsItSays) {
  RoadCar c = steady(5.0);
  c.bumps = {{10.0}, {6.0}, {0.12}};
  c.prepare();
  const State top = integrated(c, c.initial_state(), 13.0 / 5.0, 2600), behind = integrated(c, top, 4.0 / 5.0, 800);
  EXPECT_NEAR(top[2], 0.12, 1e-12);  // fourth order, 1 ms
  EXPECT_NEAR(behind[2], 0.0, 1e-12);
  EXPECT_LT(behind[0], 17.0) << "the way over a bump is longer";
  // The path's curvature at the top is h'' = -4 H k^2: v^2 of it presses less.
  const double k = kPi / 6.0;
  EXPECT_NEAR(motion_of(c, top).specific_force_of(Vector3::Zero(), 9.81)[2], 9.81 - 25.0 * 4.0 * 0.12 * k * k, 1e-9);
  EXPECT_NEAR(c.bumps.steepest(), 0.12 * k * 1.299038105676658, 1e-12);  // 3 sqrt(3) / 4
}

TEST(RoadCar, SpeedAndDistanceFollowTheSmoothStep) {
  const RoadCar c = winding();
  State x = c.initial_state();
  x[5] = 3.5;  // halfway between 1 and 6 s
  EXPECT_NEAR(c.truth(x, {})[9], 6.0, 1e-14);
  EXPECT_NEAR(motion_of(c, x).a_WB.norm(), 1.875 * 12.0 / 5.0, 1e-13);                   // S'(1/2) = 15/8
  EXPECT_NEAR(integrated(c, c.initial_state(), 6.0, 6000)[4], 0.5 * 12.0 * 5.0, 1e-10);  // S has the mean 1/2; fourth order
}

TEST(RoadCar, YawIsWrapped) {
  RoadCar c = steady(10.0, 0.1);
  State x = c.initial_state();
  x[3] = 3.0 * kPi + 0.5;
  EXPECT_NEAR(c.truth(x, {})[8], -kPi + 0.5, 1e-14);
  EXPECT_LT((to_rpy(motion_of(c, x).q_WB) - Vector3(0.0, 0.0, -kPi + 0.5)).norm(), 1e-14);
}

// --- Refusals ---------------------------------------------------------------------------------------------------------

template <typename Change>
std::string refusal(const Change& change) {
  RoadCar c = winding();
  change(c);
  try {
    c.prepare();
  } catch (const Refusal& r) {
    return r.what();
  }
  return "(accepted)";
}

TEST(RoadCar, RefusalsWordForWord) {
  EXPECT_EQ(refusal([](RoadCar&) {}), "(accepted)");
  EXPECT_EQ(refusal([](RoadCar& c) { c.speed_time_s.clear(); }), "vehicle.speed_time_s: is empty, expected at least one time");
  EXPECT_EQ(refusal([](RoadCar& c) { c.speed_mps.pop_back(); }),
            "vehicle.speed_mps: has 3 values, expected 4, one for each of vehicle.speed_time_s");
  EXPECT_EQ(refusal([](RoadCar& c) { c.grade_distance_m[1] = 15.0; }),
            "vehicle.grade_distance_m: expected increasing numbers, found 15.000000 after 15.000000");
  EXPECT_EQ(refusal([](RoadCar& c) { c.bumps.height_m.clear(); }),
            "vehicle.bump_height_m: has 0 values, expected 3, one for each of vehicle.bump_position_m");
  EXPECT_EQ(
      refusal([](RoadCar& c) { c.bumps.length_m[1] = 11.0; }),
      "vehicle.bump_length_m: the bump at 45.000000 m reaches into the one at 55.000000 m, expected one behind the other");
  EXPECT_EQ(refusal([](RoadCar& c) { c.bumps.height_m[2] = 1.0; }),
            "vehicle.bump_height_m: the steepest bump on the steepest grade climbs 0.916210 per metre of the path, expected at "
            "most 0.7");
}

}  // namespace
}  // namespace slipstream
