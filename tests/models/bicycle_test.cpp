// Closed forms of the linear single-track model: as a vehicle with its timetable, and as a process model.
#include "models/vehicles/bicycle.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/jacobian.hpp"
#include "common/rk4.hpp"
#include "models/processes/lateral_bicycle.hpp"

namespace slipstream {
namespace {

using State = Bicycle::State;

State state(double v_y, double w_z, double psi, double x, double y, double t) {
  State s;
  s << v_y, w_z, psi, x, y, t;
  return s;
}

Bicycle steady(double v, double delta, double c_1, double c_2) {
  Bicycle b;
  b.track.slip_speed_eps_mps = 1e-9;  // the textbook's model
  b.front_stiffness_npr = c_1;
  b.rear_stiffness_npr = c_2;
  b.steering_time_s = b.speed_time_s = {0.0};
  b.steering_rad = {delta};
  b.speed_mps = {v};
  b.prepare();
  return b;
}

State integrated(const Bicycle& b, State x, double duration_s) {
  const int steps = static_cast<int>(std::ceil(duration_s / 1e-3));
  const Bicycle::Mode mode = 1;
  for (int i = 0; i < steps; ++i) x = rk4_step([&](const State& s) { return b.derivative(s, mode); }, x, duration_s / steps);
  return x;
}

// Steady turn: w_z = v delta / (L + K v^2), K = m (a_2 C_2 - a_1 C_1) / (L C_1 C_2); the rear tyre carries a_1/L of the force,
// so v_y = a_2 w_z - v m a_1 a_y / (L C_2). Rajamani, Vehicle Dynamics and Control (2012), section 3.3.
TEST(Bicycle, SteadyTurnHasTheTextbooksYawRateGainAndRadius) {
  constexpr double kM = 2.8, kA1 = 0.134, kA2 = 0.122, kL = kA1 + kA2;
  const struct {
    double v, delta, c_1, c_2;
  } cases[]{{0.5, 0.5, 4.0, 4.0}, {0.35, 0.3, 4.0, 4.0}, {0.6, 0.1, 5.0, 6.0}, {0.6, -0.1, 6.0, 7.0}};
  for (const auto& c : cases) {
    const double k = kM * (kA2 * c.c_2 - kA1 * c.c_1) / (kL * c.c_1 * c.c_2);
    const double w_z = c.v * c.delta / (kL + k * c.v * c.v);
    const double v_y = kA2 * w_z - c.v * kM * kA1 * (w_z * c.v) / (kL * c.c_2);
    const Bicycle b = steady(c.v, c.delta, c.c_1, c.c_2);
    const State x = integrated(b, b.initial_state(), 30.0);  // its slower mode decays with about 1.3 /s: to exp(-39)
    EXPECT_NEAR(x[0], v_y, 1e-12);                           // rounding of 30000 steps
    EXPECT_NEAR(x[1], w_z, 1e-12);
    const State across = integrated(b, x, kPi / std::abs(w_z));  // half a lap later, on the other side
    const double radius = std::hypot(c.v, v_y) / std::abs(w_z);
    EXPECT_NEAR(std::hypot(across[3] - x[3], across[4] - x[4]), 2.0 * radius, 1e-10);  // Runge-Kutta of fourth order, 1 ms
    EXPECT_NEAR(b.truth(x, 1)[7], w_z * c.v, 1e-11);                                   // a_y = w_z v, centripetal
  }
}

TEST(Bicycle, GoesStraightWithTheWheelStraightAndCoversTheIntegralOfItsSpeed) {
  Bicycle b;  // pulls away to 0.5 m/s in 1.5 s
  b.steering_rad = {0.0, 0.0};
  b.prepare();
  State x = b.initial_state();
  Bicycle::Mode mode = b.initial_mode();
  double t = 0.0;
  for (const double end : {1.0, 1.5, 2.0, 3.0}) {
    for (int i = 0; i < 1000; ++i) x = rk4_step([&](const State& s) { return b.derivative(s, mode); }, x, (end - t) / 1000);
    t = end;
    mode = b.after_event(0, x, mode);
  }
  for (int i = 0; i < 3; ++i) EXPECT_EQ(x[i], 0.0);
  EXPECT_NEAR(x[3], 0.5 * 1.5 / 2.0 + 0.5 * 1.5, 1e-12);  // triangle and rectangle; rounding
  EXPECT_EQ(x[4], 0.0);
}

TEST(Bicycle, MirrorsWithTheSteering) {
  const Bicycle left = steady(0.5, 0.3, 4.0, 5.0), right = steady(0.5, -0.3, 4.0, 5.0);
  const State l = left.derivative(state(0.1, 0.6, 0.7, 2.0, 3.0, 4.0), 1);
  const State r = right.derivative(state(-0.1, -0.6, -0.7, 2.0, -3.0, 4.0), 1);
  EXPECT_EQ(r, state(-l[0], -l[1], -l[2], l[3], -l[4], l[5]));
}

TEST(Bicycle, StandsStillWithTheWheelTurned) {
  Bicycle b = steady(0.0, 0.5, 4.0, 4.0);
  b.track.slip_speed_eps_mps = 0.02;
  EXPECT_EQ(b.derivative(b.initial_state(), 1), state(0, 0, 0, 0, 0, 1.0));
  // and a push to the side dies with the rate that the head states: v_y' = -(C_1 + C_2) v_y / (m v_eps)
  EXPECT_NEAR(b.derivative(state(1e-3, 0, 0, 0, 0, 0), 1)[0], -8.0 * 1e-3 / (2.8 * 0.02), 1e-15);  // rounding
}

TEST(Bicycle, TimetablesAreLinearBetweenTheirPointsAndConstantOutside) {
  Bicycle b;
  b.steering_time_s = {1.0, 3.0};
  b.steering_rad = {0.2, -0.2};
  b.speed_time_s = {0.0, 2.0};
  b.speed_mps = {0.0, 1.0};
  b.prepare();
  const State start = b.initial_state();
  EXPECT_EQ(b.initial_mode(), 1U) << "the point at 0 s is past";
  const struct {
    double t;
    Bicycle::Mode mode;
    double delta, v, to_event;
  } cases[]{{0.0, 1, 0.2, 0.0, -1.0},
            {0.5, 1, 0.2, 0.25, -0.5},
            {1.5, 2, 0.1, 0.75, -0.5},
            {2.5, 3, -0.1, 1.0, -0.5},
            {9.0, 4, -0.2, 1.0, -1.0}};
  for (const auto& c : cases) {
    const State x = state(0, 0, 0, 0, 0, c.t);
    EXPECT_NEAR(b.inputs(x, c.mode)[0], c.delta, 1e-15);  // rounding
    EXPECT_NEAR(b.truth(x, c.mode)[8], c.v, 1e-15);
    EXPECT_NEAR(b.truth(x, c.mode)[9], c.v / 0.033, 1e-13);  // the wheel rolls
    EXPECT_EQ(b.events(x, c.mode)[0], c.to_event);
  }
  EXPECT_EQ(b.after_event(0, start, 3), 4U);
  EXPECT_EQ(b.after_event(0, start, 4), 4U) << "there is nothing after the last point";
}

template <typename Change>
std::string refusal(const Change& change) {
  Bicycle b;
  change(b);
  try {
    b.prepare();
  } catch (const Refusal& r) {
    return r.what();
  }
  return "(accepted)";
}

TEST(Bicycle, RefusalsWordForWord) {
  EXPECT_EQ(refusal([](Bicycle&) {}), "(accepted)");
  EXPECT_EQ(refusal([](Bicycle& b) { b.steering_rad.pop_back(); }),
            "vehicle.steering_rad: has 1 values, expected 2, one for each of vehicle.steering_time_s");
  EXPECT_EQ(refusal([](Bicycle& b) { b.speed_time_s.clear(); }), "vehicle.speed_time_s: is empty, expected at least one time");
  EXPECT_EQ(refusal([](Bicycle& b) {
              b.speed_time_s = {2.0, 1.0};
            }),
            "vehicle.speed_time_s: expected increasing times, or two that are equal for a step, found 1.000000 after 2.000000");
}

// --- lateral_bicycle --------------------------------------------------------------------------------------------------

// By hand, Table 10: v_x = 0.5 m/s, v_y = 0.1, w_z = 0.6, C = 4 each, delta = 0.5, psi = pi/2.
//   C_1 alpha_1 = 4 (0.5 - (0.1 + 0.134 * 0.6) / 0.5) = 0.5568,   C_2 alpha_2 = 4 (0.122 * 0.6 - 0.1) / 0.5 = -0.2144
//   a_y = 0.3424 / 2.8,   w_z' = (0.134 * 0.5568 + 0.122 * 0.2144) / 0.2 = 0.50384
TEST(LateralBicycle, ByHand) {
  LateralBicycle m;
  m.track.slip_speed_eps_mps = 1e-9;
  Vector<double, 7> x;
  x << 0.1, 0.6, kPi / 2.0, 1.0, 2.0, 4.0, 4.0;
  const Vector<double, 2> u(0.5, 0.5 / 0.033);
  const auto rate = m.derivative<double>(x, u);
  const double expected[]{0.3424 / 2.8 - 0.6 * 0.5, 0.50384, 0.6, -0.1, 0.5, 0.0, 0.0};
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(rate[i], expected[i], 1e-15) << i;  // rounding
  EXPECT_NEAR(m.output<double>(x, u)[0], 0.3424 / 2.8, 1e-15);
  EXPECT_EQ(m.output<double>(x, u)[1], 0.6);
}

// Why psi, X and Y are not observable: neither what is measured nor the other states depend on them.
TEST(LateralBicycle, NothingMeasuredDependsOnThePose) {
  const LateralBicycle m;
  Vector<double, 7> x, rate;
  x << 0.1, 0.6, 0.7, 1.0, 2.0, 4.0, 5.0;
  const Vector<double, 2> u(0.5, 15.0);
  Matrix<double, 7> f;
  value_and_jacobian<7>([&](const auto& d) { return m.derivative(d, u); }, x, rate, f);
  Vector<double, 2> z;
  Matrix<double, 2, 7> h;
  value_and_jacobian<2>([&](const auto& d) { return m.output(d, u); }, x, z, h);
  for (const int pose : {2, 3, 4}) {
    EXPECT_EQ(h.col(pose).norm(), 0.0);
    for (const int other : {0, 1, 5, 6}) EXPECT_EQ(f(other, pose), 0.0);
  }
}

// The bound on the step's length must hold where the model is fastest: at standstill its eigenvalues are real and their sum is
// the trace.
TEST(LateralBicycle, FastestRateBoundsTheRatesAtAnySpeed) {
  const LateralBicycle m;
  Vector<double, 7> x, rate;
  x << 0.0, 0.0, 0.0, 0.0, 0.0, 6.0, 5.0;
  for (const double wheel_radps : {0.0, 1.0, 15.0}) {
    Matrix<double, 7> f;
    value_and_jacobian<7>([&](const auto& d) { return m.derivative(d, Vector<double, 2>(0.0, wheel_radps)); }, x, rate, f);
    EXPECT_LE(f.eigenvalues().cwiseAbs().maxCoeff(), m.fastest_rate_hz(x)) << wheel_radps;
  }
}

}  // namespace
}  // namespace slipstream
