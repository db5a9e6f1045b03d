// The road between Table 1's surfaces, when one of them can be known, and a plant whose road changes under way.
#include "models/parts/surface_family.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "models/parts/surface_evidence.hpp"
#include "models/processes/tyre_friction.hpp"
#include "models/vehicles/torque_car.hpp"

namespace slipstream {
namespace {

// At a surface's own D the curve is that of the document's eq. 3.3 with its row of Table 1.
TEST(SurfaceFamily, IsTheSurfaceAtItsOwnPeak) {
  const double table[4][4]{{10, 1.9, 1, 0.97}, {12, 2.3, 0.82, 1}, {5, 2, 0.3, 1}, {4, 2, 0.1, 1}};
  for (const auto& [b, c, d, e] : table)
    for (const double slip : {-0.4, -0.02, 0.0, 0.01, 0.1, 1.5}) {
      const double bl = b * slip, mu = d * std::sin(c * std::atan(bl - e * (bl - std::atan(bl))));
      EXPECT_NEAR(SurfaceFamily::friction(slip, d), mu, 1e-14) << d << " " << slip;  // rounding
    }
}

TEST(SurfaceFamily, BetweenAndBeyondTheSurfaces) {
  // Half way from ice to snow: B = 4.5, C = 2, E = 1; mu = D sin(C atan(atan(B l))).
  EXPECT_NEAR(SurfaceFamily::friction(0.05, 0.2), 0.2 * std::sin(2.0 * std::atan(std::atan(0.225))), 1e-15);
  EXPECT_NEAR(SurfaceFamily::friction(0.05, 1.2), 1.2 * SurfaceFamily::friction(0.05, 1.0), 1e-15);  // the shape of dry
  EXPECT_EQ(SurfaceFamily::friction(0.3, 0.0), 0.0);
}

TEST(SurfaceFamily, ArcTangentOfManyIsTheLibrarys) {
  for (double x = -60.0; x <= 60.0; x += 0.37) {
    const Pack p(x);
    EXPECT_NEAR(arc_tangent(p)[0], std::atan(x), 4e-16 * 8.0) << x;  // eight times the rounding of y
  }
}

// Small slip: l_j = mu / (B C D), so between dry (19) and wet (22.632) at mu = 0.02 ten samples of 5 % give
// 5 ((0.02/19 - 0.02/22.632) / 0.05)^2 = 5.71e-5; the curves bend by (B l)^2 (C^2/6 + 2/3) of it: 1.4e-4, 1.7e-4.
TEST(SurfaceEvidence, SaysThatGentleDrivingShowsNothing) {
  const double mu = 0.02;
  EXPECT_NEAR(slip_for(kSurfaces[0].tyre, mu), mu / 19.0, 1.5e-4 * mu / 19.0);
  EXPECT_NEAR(slip_for(kSurfaces[1].tyre, -mu), -mu / 22.632, 2e-4 * mu / 22.632);
  const double expected = 5.0 * std::pow((mu / 19.0 - mu / 22.632) / 0.05, 2);
  EXPECT_NEAR(surface_evidence(0, slip_for(kSurfaces[0].tyre, mu), mu, 0.05, 10), expected, 0.01 * expected);
  EXPECT_LT(surface_evidence(0, 0.005, 0.1, 0.05, 10), 1e-3);
}

TEST(SurfaceEvidence, IsSufficientWhereTheOthersWouldSpin) {
  // 0.9 of the weight: only dry carries it. 5 (2.9 / 0.05)^2 is more than 1e4.
  EXPECT_GT(surface_evidence(0, slip_for(kSurfaces[0].tyre, 0.9), 0.9, 0.05, 10), 1e4);
  EXPECT_EQ(slip_for(kSurfaces[3].tyre, 0.11), kSpinningSlip);
  // On ice at a slip of 0.3 mu is 0.098; snow carries that at l = 0.0335: 5 (0.267/0.05)^2 = 142.
  const double mu = kSurfaces[3].tyre.friction(0.3);
  EXPECT_NEAR(surface_evidence(3, 0.3, mu, 0.05, 10), 142.0, 3.0);  // two digits of the slip above
  EXPECT_GE(142.0, kSufficientEvidence);
}

// By hand on wet, w = 20 rad/s, v = 10 m/s, T = 3000 N m: l = 0.04, B l = 0.48.
TEST(TyreFriction, ByHand) {
  TyreFriction m;
  m.wheel.quarter.viscous_friction_nms = 2.0;
  const double mu = 0.82 * std::sin(2.3 * std::atan(std::atan(0.48)));
  const Vector<double, 3> x(20.0, 10.0, 0.82);
  const auto rate = m.derivative<double>(x, Vector<double, 1>(3000.0));
  constexpr double kRegularised = 1e-6;  // v_eps^2 / (2 v^2) = 5e-7 of the slip
  EXPECT_NEAR(rate[0], (3000.0 - 40.0 - (mu + 0.02) * 2000.0 * 9.81 * 0.52) / 11.5, 500.0 * kRegularised);
  EXPECT_NEAR(rate[1], mu * 9.81 - 0.1008, 10.0 * kRegularised);
  EXPECT_EQ(rate[2], 0.0);
  EXPECT_NEAR(m.output<double>(x, Vector<double, 1>(3000.0))[1], rate[1], 1e-14);
  EXPECT_EQ(TyreFriction::regime_value(0), 1.0);
  EXPECT_EQ(TyreFriction::regime_value(3), 0.1);
}

TEST(TorqueCarSurfaces, ChangeAtTheirTimes) {
  TorqueCar c;
  c.surface = "dry", c.surface_time_s = {1.0, 2.0}, c.surfaces = {"ice", "wet"};
  c.torque_time_s = {0.0}, c.torque_nm = {100.0};
  c.prepare();
  TorqueCar::State x;
  x << 34.0, 10.0, 0.0, 0.0, 0.5;  // l = 0.02
  const auto truth = [&](TorqueCar::Mode m, std::string_view name) {
    for (std::size_t i = 0; i < TorqueCar::kTruth.size(); ++i)
      if (TorqueCar::kTruth[i].name == name) return c.truth(x, m)[i];
    return -1.0;
  };
  TorqueCar::Mode mode = c.initial_mode();
  EXPECT_EQ(truth(mode, "available_friction"), 1.0);
  x[4] = 1.0;
  EXPECT_EQ(c.events(x, mode)[0], 0.0);
  mode = c.after_event(0, x, mode);
  EXPECT_EQ(truth(mode, "available_friction"), 0.1);
  EXPECT_NEAR(truth(mode, "friction"), 0.1 * std::sin(2.0 * std::atan(std::atan(0.08))), 1e-6);  // v_eps: 5e-7 of it
  mode = c.after_event(0, x, mode);
  EXPECT_EQ(truth(mode, "available_friction"), 0.82);
  x[4] = 99.0;
  EXPECT_LT(c.events(x, mode)[0], 0.0);
  c.friction = "constant";
  c.prepare();
  EXPECT_TRUE(std::isnan(truth(c.initial_mode(), "available_friction"))) << "an imposed friction says nothing of it";
}

TEST(TorqueCarSurfaces, RefusalsWordForWord) {
  const auto refusal = [](auto change) {
    TorqueCar c;
    change(c);
    try {
      c.prepare();
    } catch (const Refusal& r) {
      return std::string(r.what());
    }
    return std::string("(accepted)");
  };
  EXPECT_EQ(refusal([](TorqueCar& c) { c.surfaces = {"ice"}; }),
            "vehicle.surfaces: has 1 values, expected 0, one for each of vehicle.surface_time_s");
  EXPECT_EQ(refusal([](TorqueCar& c) {
              c.surfaces = {"ice", "wet"}, c.surface_time_s = {2.0, 2.0};
            }),
            "vehicle.surface_time_s: expected increasing times, found 2.000000 after 2.000000");
  EXPECT_EQ(refusal([](TorqueCar& c) { c.surfaces = {"ice", "ice"}, c.surface_time_s = {2.0, 3.0}; }), "(accepted)");
}

}  // namespace
}  // namespace slipstream
