// Closed forms of the car as a point mass: document 000, eq. 1.
#include "models/vehicles/point_mass.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/pack.hpp"
#include "common/rk4.hpp"
#include "models/processes/point_mass_motion.hpp"

namespace slipstream {
namespace {

using State = PointMass::State;

PointMass driven(double accelerator, double steering_rad) {
  PointMass p;
  p.accelerator = {accelerator};
  p.steering_rad = {steering_rad};
  p.prepare();
  return p;
}
State integrated(const PointMass& p, State x, double duration_s) {
  const int steps = static_cast<int>(std::ceil(duration_s / 1e-3));
  const PointMass::Mode mode = 1;
  for (int i = 0; i < steps; ++i) x = rk4_step([&](const State& s) { return p.derivative(s, mode); }, x, duration_s / steps);
  return x;
}
State at(double v, double heading_rad) {
  State x;
  x << 0.0, 0.0, v, heading_rad, 0.0;
  return x;
}

// P/v = A C_d v^2.
TEST(PointMass, TopSpeedIsTheCubeRootOfPowerOverDrag) {
  const PointMass p = driven(1.0, 0.0);
  const double v = std::cbrt(1e5 / (1.0 * 0.3));                            // 69.3 m/s with the document's car
  EXPECT_NEAR(p.derivative(at(v, 0.3), PointMass::Mode{1})[2], 0.0, 1e-4);  // v_eps takes 5e-5 of 1.15 m/s^2
  EXPECT_NEAR(integrated(p, at(30.0, 0.0), 300.0)[2], v, 2e-3);             // and v_eps^2/(3 v) of the speed
}

// Without power 1/v grows by A C_d t/M, and the way is M/(A C_d) log(v_0/v).
TEST(PointMass, CoastsDownByItsDrag) {
  const State x = integrated(driven(0.0, 0.0), at(50.0, 0.6), 20.0);
  const double k = 0.3 / 1250.0, v = 1.0 / (1.0 / 50.0 + k * 20.0), way = std::log(50.0 / v) / k;
  EXPECT_NEAR(x[2], v, 1e-9 * v);  // Runge-Kutta's error at 1 ms is below rounding here
  EXPECT_NEAR(x[0], way * std::cos(0.6), 1e-9 * way);
  EXPECT_NEAR(x[1], way * std::sin(0.6), 1e-9 * way);
}

// At constant speed (power balances drag) the way is a circle of radius L/tan(u_psi).
TEST(PointMass, DrivesACircleOfTheWheelbaseOverTheTangent) {
  const double v = 20.0, u_psi = 0.1, radius = 2.5 / std::tan(u_psi);
  const double push = 0.3 * v * v * (v * v + 0.25) / (1e5 * v);  // u_a that keeps v, with v_eps = 0.5
  const State x = integrated(driven(push, u_psi), at(v, 0.0), kPi * radius / v);
  EXPECT_NEAR(x[3], kPi, 1e-9);
  EXPECT_NEAR(x[0], 0.0, 1e-8);
  EXPECT_NEAR(x[1], 2.0 * radius, 1e-8);
}

TEST(PointMass, StandsAndStaysFinite) {
  const State rate = driven(1.0, 0.2).derivative(at(0.0, 1.0), PointMass::Mode{1});
  EXPECT_TRUE(rate.allFinite());
  EXPECT_EQ(rate[2], 0.0);  // v/(v^2 + v_eps^2) vanishes: who stands must be pushed
}

TEST(PointMassMotion, IsTheVehicleAndShowsWhatIsMeasured) {
  const PointMassMotion model;
  const Vector<double, 4> x{3.0, -4.0, 25.0, 0.7};
  const Vector<double, 2> u{0.5, 0.01};  // the vehicle's defaults
  PointMass vehicle;
  vehicle.prepare();
  State all;
  all << x, 0.0;
  EXPECT_EQ((model.derivative(x, u)), (vehicle.derivative(all, PointMass::Mode{1}).head<4>()));
  EXPECT_EQ((model.output(x, u)), (Vector<double, 3>{3.0, -4.0, 25.0}));
}

// Four states at once are four states one after the other; sine and cosine are those of batch_math.hpp, to rounding.
TEST(PointMassMotion, MovesFourAtOnce) {
  const PointMassMotion model;
  const Vector<double, 2> u{0.8, 0.02};
  Vector<Pack, 4> together;
  std::array<Vector<double, 4>, 4> apart;
  for (int s = 0; s < 4; ++s) {
    double lane[4];
    for (int i = 0; i < 4; ++i) lane[i] = apart[static_cast<std::size_t>(i)][s] = 1.0 + 0.3 * s - 0.7 * i;
    together[s] = Pack::load(lane);
  }
  const Vector<Pack, 4> rate = model.derivative(together, u);
  for (int i = 0; i < 4; ++i) {
    const Vector<double, 4> expected = model.derivative(apart[static_cast<std::size_t>(i)], u);
    for (int s = 0; s < 4; ++s) EXPECT_NEAR(rate[s][i], expected[s], 1e-14 * (1.0 + std::abs(expected[s])));
  }
}

}  // namespace
}  // namespace slipstream
