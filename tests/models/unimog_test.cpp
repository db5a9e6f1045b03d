#include "models/vehicles/unimog.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slipstream {
namespace {

constexpr double kIdle_radps = 800.0 * 2.0 * kPi / 60.0;
constexpr double kShift_radps = 2200.0 * 2.0 * kPi / 60.0;

Unimog prepared() {
  Unimog u;
  u.prepare();
  return u;
}

template <typename Change>
std::string refusal(const Change& change) {
  Unimog u;
  change(u);
  try {
    u.prepare();
  } catch (const Refusal& r) {
    return r.what();
  }
  return "(accepted)";
}

TEST(Unimog, RefusalsWordForWord) {
  EXPECT_EQ(refusal([](Unimog&) {}), "(accepted)");
  EXPECT_EQ(refusal([](Unimog& u) { u.engine_torque_nm.pop_back(); }),
            "vehicle.engine_torque_nm: has 7 values, expected 8, one for each of vehicle.engine_speed_rpm");
  EXPECT_EQ(refusal([](Unimog& u) {
              u.engine_speed_rpm.resize(5);
              u.engine_torque_nm.resize(5);
            }),
            "vehicle.engine_speed_rpm: has 5 values, expected at least 6 for a quintic");
  EXPECT_EQ(refusal([](Unimog& u) {
              u.engine_speed_rpm.resize(6);
              u.engine_torque_nm.resize(6);
            }),
            "(accepted)");
  EXPECT_EQ(refusal([](Unimog& u) { u.engine_speed_rpm[2] = 1000.0; }),
            "vehicle.engine_speed_rpm: expected increasing values, found 1000.000000 after 1000.000000");
  EXPECT_EQ(refusal([](Unimog& u) { u.initial_gear = 9.0; }), "vehicle.initial_gear: expected a whole number from 1 to 8");
  EXPECT_EQ(refusal([](Unimog& u) { u.initial_gear = 2.5; }), "vehicle.initial_gear: expected a whole number from 1 to 8");
  EXPECT_EQ(refusal([](Unimog& u) { u.initial_gear = 8.0; }), "(accepted)");
  EXPECT_EQ(refusal([](Unimog& u) {
              u.driveline.gear_ratio = {4.0, 2.0};
              u.initial_gear = 3.0;
            }),
            "vehicle.initial_gear: expected a whole number from 1 to 2");
}

TEST(Unimog, ParametersOfTables13And15) {
  const Unimog u;
  EXPECT_EQ(u.quarter.mass_kg, 2000.0);
  EXPECT_EQ(u.quarter.wheel_inertia_kgm2, 11.5);
  EXPECT_EQ(u.quarter.wheel_radius_m, 0.52);
  EXPECT_EQ(u.quarter.rolling_resistance, 0.02);
  EXPECT_EQ(u.quarter.air_density_kgpm3, 1.2);
  EXPECT_EQ(u.quarter.frontal_area_m2, 5.6);
  EXPECT_EQ(u.quarter.drag_coefficient, 0.6);
  EXPECT_EQ(u.driveline.final_drive, 6.94);
  EXPECT_EQ(u.driveline.efficiency, 0.9);
  EXPECT_EQ(u.rated_power_w, 160e3);
  EXPECT_EQ(u.rated_speed_rpm, 2200.0);
}

TEST(Unimog, StartsRollingWithoutSlipInThirdGearWithTheClutchSlipping) {
  const Unimog u = prepared();
  const auto x = u.initial_state();
  EXPECT_EQ(x[0], 0.5);
  EXPECT_NEAR(x[1], 0.26, 1e-16);  // 0.5 rad/s * 0.52 m; rounding
  EXPECT_EQ(x[2], 0.0);
  EXPECT_NEAR(u.slip(x[0], x[1]), 0.0, 1e-15);  // rounding
  EXPECT_EQ(u.initial_mode().gear, 3);
  EXPECT_TRUE(u.initial_mode().idling);  // 0.5 * 4.375 * 6.94 = 15.2 rad/s, below idle's 83.8
}

TEST(Unimog, ClutchIsClosedAtAStartAboveIdleSpeed) {
  Unimog u;
  u.initial_wheel_speed_radps = 1.001 * kIdle_radps / (4.375 * 6.94);
  u.prepare();
  EXPECT_FALSE(u.initial_mode().idling);
  u.initial_wheel_speed_radps = 0.999 * kIdle_radps / (4.375 * 6.94);
  EXPECT_TRUE(u.initial_mode().idling);
}

// T = demand T_m(w_m) eta i_cx i_dif / 4 (eqs 7.3-7.10) and the two accelerations, worked out here from the document's numbers.
TEST(Unimog, DerivativeAgainstTheDocumentsEquations) {
  const Unimog u = prepared();
  for (const bool idling : {false, true})
    for (const int gear : {1, 3, 5, 8}) {
      const double ratio[]{9.57, 6.635, 4.375, 3.219, 2.188, 1.517, 1.0, 0.736};
      const double i = ratio[gear - 1] * 6.94;
      const double w = (idling ? 0.5 : 1.6) * kIdle_radps / i, v = 0.52 * w / 1.012;  // a slip of 1.2 %
      const double t_m = u.curve().torque_nm(idling ? kIdle_radps : w * i);
      const double torque = 0.1 * 0.9 * i * t_m;
      const double l = (0.52 * w - v) / std::sqrt(v * v + 1e-4), bl = 10.0 * l;
      const double mu = std::sin(1.9 * std::atan(bl - 0.97 * (bl - std::atan(bl))));
      const double mg = 2000.0 * 9.81;
      const auto rate = u.derivative<double>({w, v, 5.0}, {gear, idling});
      // Tolerances: rounding, and 5e-7 / w^2 of the 204 N m of rolling torque for the regularised sign.
      EXPECT_NEAR(rate[0], (torque - mu * mg * 0.52 - 0.02 * mg * 0.52) / 11.5, 1e-10 + 204.0 * 6e-7 / (w * w) / 11.5) << gear;
      EXPECT_NEAR(rate[1], mu * 9.81 - 0.5 * 1.2 * 0.6 * 5.6 * v * v / 2000.0, 1e-12) << gear;
      EXPECT_EQ(rate[2], v);
      EXPECT_NEAR(u.inputs({w, v, 5.0}, {gear, idling})[0], torque, 1e-9) << gear;
    }
}

TEST(Unimog, TruthSaysWhatTheStatesAre) {
  const Unimog u = prepared();
  const double i = 4.375 * 6.94, w = 5.0, v = 2.58;
  const auto truth = u.truth({w, v, 7.0}, {3, false});
  const auto named = [&](std::string_view name) {
    for (std::size_t k = 0; k < Unimog::kTruth.size(); ++k)
      if (Unimog::kTruth[k].name == name) return truth[k];
    return std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_EQ(named("wheel_speed_radps"), w);
  EXPECT_EQ(named("speed_mps"), v);
  EXPECT_EQ(named("distance_m"), 7.0);
  EXPECT_EQ(named("gear"), 3.0);
  EXPECT_NEAR(named("slip"), (2.6 - 2.58) / 2.58, 8e-6 * 0.01);  // v_eps^2 / (2 v^2) = 7.5e-6 of 0.8 %
  EXPECT_NEAR(named("engine_speed_radps"), w * i, 1e-12);        // rounding
  // Torque at the wheel is a quarter of eta i T_m, with T_m at the demanded load.
  EXPECT_NEAR(named("drive_torque_nm"), 0.25 * 0.9 * i * named("engine_torque_nm"), 1e-10);  // rounding
  EXPECT_NEAR(named("engine_torque_nm"), 0.4 * u.curve().torque_nm(w * i), 1e-10);           // rounding
  const double bl = 10.0 * named("slip"), mu = std::sin(1.9 * std::atan(bl - 0.97 * (bl - std::atan(bl))));
  EXPECT_NEAR(named("friction"), mu, 1e-14);                                                  // rounding
  EXPECT_NEAR(named("a_x_mps2"), 9.81 * mu - 0.5 * 1.2 * 0.6 * 5.6 * v * v / 2000.0, 1e-13);  // rounding
  EXPECT_NEAR(u.truth({0.5, 0.26, 0.0}, {3, true})[7], kIdle_radps, 1e-13) << "the engine is held at idle";
}

TEST(Unimog, EventFunctionsAreZeroAtShiftAndIdleSpeed) {
  const Unimog u = prepared();
  for (int gear = 1; gear <= 7; ++gear) {
    const double i = u.driveline.total_ratio(gear);
    const auto at_shift = u.events({kShift_radps / i, 1.0, 0.0}, {gear, false});
    EXPECT_NEAR(at_shift[0], 0.0, 1e-12) << gear;  // rounding of 230 rad/s
    EXPECT_GT(at_shift[1], 0.0);
    EXPECT_GT(u.events({1.001 * kShift_radps / i, 1.0, 0.0}, {gear, false})[0], 0.0);
    EXPECT_LT(u.events({0.999 * kShift_radps / i, 1.0, 0.0}, {gear, false})[0], 0.0);
    const auto at_idle = u.events({kIdle_radps / i, 1.0, 0.0}, {gear, true});
    EXPECT_NEAR(at_idle[1], 0.0, 1e-12) << gear;  // rounding of 84 rad/s
    EXPECT_LT(at_idle[0], 0.0);
    EXPECT_LT(u.events({0.999 * kIdle_radps / i, 1.0, 0.0}, {gear, true})[1], 0.0);
  }
  EXPECT_EQ(Unimog::kCrossings[0], Crossing::kRising);  // no upshift while slowing down
  EXPECT_EQ(Unimog::kCrossings[1], Crossing::kBoth);
}

TEST(Unimog, NoUpshiftAboveTopGear) {
  const Unimog u = prepared();
  double before = u.events({0.0, 0.0, 0.0}, {8, false})[0];
  EXPECT_LT(before, 0.0);
  for (double w = 0.0; w < 200.0; w += 1.0) EXPECT_EQ(u.events({w, 0.52 * w, 0.0}, {8, false})[0], before) << w;
}

TEST(Unimog, ModeLogic) {
  const Unimog u = prepared();
  const auto at = [](double w) { return Unimog::State(w, 0.52 * w, 0.0); };
  // Upshift at speed: one gear up, clutch stays closed.
  Unimog::Mode m = u.after_event(0, at(kShift_radps / (4.375 * 6.94)), {3, false});
  EXPECT_EQ(m.gear, 4);
  EXPECT_FALSE(m.idling);  // 2200 * 3.219 / 4.375 = 1619 rpm
  // Upshift into a gear whose engine speed is below idle: the clutch slips.
  m = u.after_event(0, at(0.9 * kIdle_radps / (3.219 * 6.94)), {3, false});
  EXPECT_EQ(m.gear, 4);
  EXPECT_TRUE(m.idling);
  // Idle speed crossed: the clutch closes, and opens again; the gear stays.
  m = u.after_event(1, at(kIdle_radps / (4.375 * 6.94)), {3, true});
  EXPECT_EQ(m.gear, 3);
  EXPECT_FALSE(m.idling);
  m = u.after_event(1, at(kIdle_radps / (4.375 * 6.94)), m);
  EXPECT_EQ(m.gear, 3);
  EXPECT_TRUE(m.idling);
}

// Torque does not jump where the clutch closes: held at idle it is that of idle speed.
TEST(Unimog, TorqueIsContinuousWhereTheClutchCloses) {
  const Unimog u = prepared();
  const double w = kIdle_radps / (4.375 * 6.94);
  EXPECT_NEAR(u.inputs({w, 1.0, 0.0}, {3, true})[0], u.inputs({w, 1.0, 0.0}, {3, false})[0], 1e-9);  // rounding
  EXPECT_EQ(u.inputs({0.1, 1.0, 0.0}, {3, true})[0], u.inputs({0.9, 1.0, 0.0}, {3, true})[0]);
}

// Whatever the scenario asks for, an engine that starts above its shift speed must not stay in that gear for ever: either the
// start is refused or the gear goes up.
// The rising event would never come, and the quintic would be extrapolated.
TEST(Unimog, AStartAboveShiftSpeedIsRefused) {
  Unimog u;
  u.initial_gear = 1.0;
  u.initial_wheel_speed_radps = 1.5 * kShift_radps / (9.57 * 6.94);
  try {
    u.prepare();
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(),
                 "vehicle.initial_wheel_speed_radps: turns the engine beyond shift_speed_rpm in the initial gear");
  }
}

TEST(Unimog, AShiftSpeedBelowIdleIsRefused) {
  Unimog u;
  u.shift_speed_rpm = 700.0;
  try {
    u.prepare();
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(), "vehicle.shift_speed_rpm: found 700.000000, expected more than idle_speed_rpm");
  }
}

TEST(Unimog, QuadraticEngineAndSurfacesAreSelected) {
  Unimog u;
  u.engine = "quadratic";
  u.prepare();
  EXPECT_NEAR(u.curve().torque_nm(kShift_radps) * kShift_radps, 160e3, 1e-9);  // rated power; rounding
  EXPECT_NEAR(u.curve().torque_nm(0.0), 0.87 * 160e3 / kShift_radps, 1e-10);   // P1; rounding
  const double peak[]{1.0, 0.82, 0.3, 0.1};
  const char* names[]{"dry", "wet", "snow", "ice"};
  for (int k = 0; k < 4; ++k) {
    u.surface = names[k];
    u.prepare();
    EXPECT_EQ(u.tyre().d, peak[k]) << names[k];
  }
}

}  // namespace
}  // namespace slipstream
