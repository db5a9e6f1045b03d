// Closed forms of the nonlinear car: its tyre, its steady turn, its balances of load, power and friction, and the process model
// that is the same car without roll and pitch in motion.
#include "models/vehicles/two_track.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/jacobian.hpp"
#include "common/random.hpp"
#include "common/rk4.hpp"
#include "models/processes/lateral_tyres.hpp"

namespace slipstream {
namespace {

using State = TwoTrack::State;

TwoTrack steady(double v, double delta) {
  TwoTrack car;
  car.steering_time_s = car.speed_time_s = {0.0};
  car.steering_rad = {delta};
  car.speed_mps = {v};
  car.speed_gain_hz = 30.0;  // holds the speed to 1 % of a_x per 1/s
  car.prepare();
  return car;
}

State integrated(const TwoTrack& car, State x, double duration_s) {
  const int steps = static_cast<int>(std::ceil(duration_s / 5e-4));
  for (int i = 0; i < steps; ++i)
    x = rk4_step([&](const State& s) { return car.derivative(s, car.initial_mode()); }, x, duration_s / steps);
  return x;
}

double true_value(const TwoTrack& car, const State& x, std::string_view name) {
  const auto truth = car.truth(x, car.initial_mode());
  for (std::size_t i = 0; i < truth.size(); ++i)
    if (TwoTrack::kTruth[i].name == name) return truth[i];
  ADD_FAILURE() << name;
  return 0.0;
}

// Somewhere in a hard turn under power or braking, drawn anew by `seed`.
State drawn(std::uint64_t seed) {
  RandomStream random(seed, 0, "two_track");
  State x = State::Zero();
  x << 2.0, 0.3 * random.normal(), 2.0 * random.normal(), 0.3, 0.0, 0.0, 0.02 * random.normal(), 0.1 * random.normal(),
      0.01 * random.normal(), 0.1 * random.normal(), 5.0;
  return x;
}

// --- The tyre ---------------------------------------------------------------------------------------------------------

TEST(LateralTyre, SlopeAndPeakAreThoseOfItsParametersAtTheReferenceLoad) {
  const LateralTyre tyre;
  const double k = 12.0, mu = 0.8, load = 4000.0;
  const auto aside = [&](double slip) { return tyre.force(slip, k, mu, load, load, 0.0).aside_n; };
  EXPECT_NEAR(aside(1e-6) / 1e-6, k * load, 1e-6 * k * load);  // the curve bends by (B t)^2, B = 11
  double peak = 0.0;
  for (double slip = 0.0; slip < 2.0; slip += 1e-3) peak = std::max(peak, aside(slip));
  EXPECT_NEAR(peak, mu * load, 1e-5 * load);  // at a step of 1e-3 the top is missed by (B 1e-3)^2 / 8
  EXPECT_EQ(aside(-0.1), -aside(0.1));
}

// q = 0.1 and twice the load: mu falls to mu / 1.1. s = 2.5: K(2 F_0) = 2 k F_0 (1 + 6.25) / (6.25 + 4).
TEST(LateralTyre, LoadTakesFrictionAndStiffness) {
  const LateralTyre tyre;
  const double k = 12.0, mu = 0.8, load = 4000.0;
  const auto aside = [&](double slip) { return tyre.force(slip, k, mu, 2.0 * load, load, 0.0).aside_n; };
  EXPECT_NEAR(aside(1e-6) / 1e-6, k * 2.0 * load * 7.25 / 10.25, 0.1);  // N/rad of 68000: bends by (B t)^2
  double peak = 0.0;
  for (double slip = 0.0; slip < 2.0; slip += 1e-3) peak = std::max(peak, aside(slip));
  EXPECT_NEAR(peak, mu * 2.0 * load / 1.1, 0.1);  // as above, N of 5818
}

// The friction ellipse: at the slip of the peak, what is delivered along and aside is together D, for any demand.
TEST(LateralTyre, CombinedForcesLieOnTheFrictionCircleAtThePeak) {
  const LateralTyre tyre;
  const double k = 12.0, mu = 0.8, load = 4000.0, d = mu * load;
  double best = 0.0, at = 0.0;
  for (double slip = 0.0; slip < 2.0; slip += 1e-4)
    if (const double f = tyre.force(slip, k, mu, load, load, 0.0).aside_n; f > best) best = f, at = slip;
  for (const double demand : {0.0, 0.1, 0.5, 0.9, 1.0, 2.0, 100.0, -0.5, -3.0}) {
    const auto f = tyre.force(at, k, mu, load, load, demand * d);
    EXPECT_NEAR(std::hypot(f.along_n, f.aside_n), d, 1e-6 * d) << demand;  // how near the search came to the peak
    EXPECT_GE(f.along_n * demand, 0.0);
    EXPECT_LE(std::abs(f.along_n), std::abs(demand) * d);
  }
  EXPECT_NEAR(tyre.force(at, k, mu, load, load, 0.5 * d).along_n, 0.5 * d, 0.016 * 0.5 * d);  // short by u^4 / 4 = 1/64
}

// --- The car ----------------------------------------------------------------------------------------------------------

// Small angles: delta = L / R + K a_y with the understeer gradient K = (1/k_1 - 1/k_2) / g, so w_z = v delta / (L + K v^2), and
// the rear tyre slips by a_y / (k_2 g): v_y = a_2 w_z - v a_y / (k_2 g). Gillespie, Fundamentals of Vehicle Dynamics, eqs 6-15
// and 6-16.
TEST(TwoTrack, SteadyTurnHasTheUndersteerGradientOfItsTyres) {
  const struct {
    double v, delta, k_1, k_2;
  } cases[]{{2.0, 2e-3, 5.0, 5.7}, {2.0, -2e-3, 5.0, 5.7}, {1.0, 2e-3, 7.0, 7.0}, {1.5, 2e-3, 6.0, 5.5}};
  for (const auto& c : cases) {
    TwoTrack car = steady(c.v, c.delta);
    car.car.chassis.slip_speed_eps_mps = 1e-6;  // the textbook's slip
    car.front_cornering_prad = c.k_1;
    car.rear_cornering_prad = c.k_2;
    const double length = car.car.chassis.wheelbase_m(), gradient = (1.0 / c.k_1 - 1.0 / c.k_2) / kGravity_mps2;
    const double w_z = c.v * c.delta / (length + gradient * c.v * c.v), a_y = c.v * w_z;
    const double v_y = car.car.chassis.rear_axle_m * w_z - c.v * a_y / (c.k_2 * kGravity_mps2);
    const State x = integrated(car, car.initial_state(), 20.0);
    // The tyre bends by (B t)^2, t < 1e-3: 1e-5; a wheel's load is 1e-4 off because it fades out smoothly (eps^2 / 4, eps = 2
    // %).
    EXPECT_NEAR(x[2], w_z, 1e-3 * std::abs(w_z));
    EXPECT_NEAR(x[1], v_y, 1e-3 * std::abs(c.v * a_y / (c.k_2 * kGravity_mps2)) + 1e-3 * std::abs(w_z));
    EXPECT_NEAR(x[0], c.v, 1e-5);
  }
}

// In a steady hard turn: the wheels carry the weight, the moment of what they carry about the road's centre line is that of
// the lateral force and of the body's lean, and the accelerometer reads a_y cos phi + g sin phi with K phi = m h a_y + m g h
// phi.
TEST(TwoTrack, LoadsCarryTheWeightAndBalanceTheRollMoment) {
  const TwoTrack car = steady(1.9, 0.35);
  const Chassis& c = car.car.chassis;
  const State x = integrated(car, car.initial_state(), 20.0);
  const auto w = car.wheels(x, car.initial_mode());
  const double weight = c.mass_kg * kGravity_mps2, fade = 2e-4 * weight;  // how far the smooth lift-off is from a load
  double sum = 0.0, moment = 0.0, along = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += w[i].load_n;
    moment += (i % 2 == 0 ? -0.5 : 0.5) * c.track_width_m * w[i].load_n;
    along += (i < 2 ? -1.0 : 0.0) * w[i].load_n;
  }
  const double a_y = x[0] * x[2];  // steady: v_y' = 0
  EXPECT_GT(a_y, 3.0) << "not a hard turn";
  EXPECT_NEAR(sum, weight, fade);
  EXPECT_NEAR(moment, c.mass_kg * c.cg_height_m * a_y + weight * c.cg_height_m * std::sin(x[6]), 0.1 * fade);
  EXPECT_NEAR(x[6], c.mass_kg * c.cg_height_m * a_y / (24.0 - weight * c.cg_height_m), 1e-6);  // it has settled
  EXPECT_NEAR(true_value(car, x, "a_y_mps2"), a_y * std::cos(x[6]) + kGravity_mps2 * std::sin(x[6]), 1e-6);
  // Front wheels: their static share and what m h a_x puts there, a_x = -w_z v_y.
  const double to_front = c.mass_kg * c.cg_height_m * x[2] * x[1] / c.wheelbase_m();
  EXPECT_NEAR(-along, weight * c.rear_axle_m / c.wheelbase_m() + to_front, fade);
}

// The tyres' forces on the body do the work that its kinetic energy gains, and a tyre's side force never works for the car.
TEST(TwoTrack, KineticEnergyGainsThePowerOfTheTyres) {
  TwoTrack car = steady(3.0, 0.2);
  const Chassis& c = car.car.chassis;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const State x = drawn(seed), rate = car.derivative(x, car.initial_mode());
    const auto w = car.wheels(x, car.initial_mode());
    double power = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double x_i = i < 2 ? c.front_axle_m : -c.rear_axle_m, y_i = (i % 2 == 0 ? 0.5 : -0.5) * c.track_width_m;
      const double v_x = x[0] - x[2] * y_i, v_y = x[1] + x[2] * x_i, delta = i < 2 ? 0.2 : 0.0;
      power += w[i].x_n * v_x + w[i].y_n * v_y;
      EXPECT_LE(w[i].aside_n * (v_y * std::cos(delta) - v_x * std::sin(delta)), 0.0) << seed;
      EXPECT_NEAR(std::hypot(w[i].x_n, w[i].y_n), std::hypot(w[i].along_n, w[i].aside_n), 1e-12);  // turned, not stretched
    }
    const double gain = c.mass_kg * (x[0] * rate[0] + x[1] * rate[1]) + c.yaw_inertia_kgm2 * x[2] * rate[2];
    EXPECT_NEAR(gain, power, 1e-11 * (1.0 + std::abs(power))) << seed;  // rounding
  }
}

TEST(TwoTrack, NoForceExceedsTheFriction) {
  for (const double mu : {0.1, 0.7}) {
    TwoTrack car = steady(4.0, 0.5);
    car.friction = {mu};
    car.prepare();
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      const State x = drawn(seed);
      for (const auto& w : car.wheels(x, car.initial_mode())) {
        // A wheel that carries less than its static load has up to mu / (1 - q) of its load.
        EXPECT_LE(std::hypot(w.along_n, w.aside_n), mu / 0.9 * w.load_n);
        EXPECT_GT(w.load_n, 0.0);
      }
    }
    // However hard it is steered, the car turns with less than mu g.
    const State x = integrated(car, car.initial_state(), 5.0);
    EXPECT_LE(true_value(car, x, "friction_used"), 1.0);
    EXPECT_GT(true_value(car, x, "friction_used"), 0.8) << "it slides";
  }
}

TEST(TwoTrack, RightIsTheMirrorOfLeft) {
  const TwoTrack left = steady(1.9, 0.3), right = steady(1.9, -0.3);
  const State a = integrated(left, left.initial_state(), 1.0), b = integrated(right, right.initial_state(), 1.0);
  constexpr double kSign[]{1, -1, -1, -1, 1, -1, -1, -1, 1, 1, 1};
  for (int i = 0; i < TwoTrack::kStates; ++i) EXPECT_NEAR(a[i], kSign[i] * b[i], 1e-12) << i;  // sums in another order
}

TEST(TwoTrack, FrictionMayChangeUnderWay) {
  TwoTrack car = steady(1.0, 0.1);
  car.friction_time_s = {2.0, 2.0};
  car.friction = {0.8, 0.2};
  car.prepare();
  EXPECT_EQ(car.truth(car.initial_state(), 1)[17], 0.8);
  EXPECT_EQ(car.truth(car.initial_state(), 2)[17], 0.2);
}

template <typename Change>
std::string refusal(const Change& change) {
  TwoTrack car;
  change(car);
  try {
    car.prepare();
  } catch (const Refusal& r) {
    return r.what();
  }
  return "";
}

TEST(TwoTrack, RefusesWhatDoesNotFit) {
  EXPECT_EQ(refusal([](TwoTrack& c) { c.car.chassis.cg_height_m = 1.0; }),
            "vehicle.front_roll_stiffness_nmprad: with the rear's it is 24.000000, expected more than mass_kg g cg_height_m = "
            "27.468000: the body would fall over");
  EXPECT_EQ(refusal([](TwoTrack& c) { c.friction.clear(); }),
            "vehicle.friction: has 0 values, expected 1, one for each of vehicle.friction_time_s");
  EXPECT_EQ(refusal([](TwoTrack& c) { c.speed_time_s = {}; }), "vehicle.speed_time_s: is empty, expected at least one time");
}

// --- lateral_tyres ----------------------------------------------------------------------------------------------------

Vector<double, 6> belief_of(const State& x, const TwoTrack& car) {
  Vector<double, 6> b;
  b << x[1], x[2], car.front_cornering_prad, car.rear_cornering_prad, car.friction[0], 0.0;
  return b;
}

// In a steady turn roll and pitch stand still, and the model is the vehicle.
TEST(LateralTyres, IsTheVehicleInASteadyTurn) {
  for (const double delta : {0.05, 0.2, 0.35, -0.35}) {
    const TwoTrack car = steady(1.9, delta);
    const State x = integrated(car, car.initial_state(), 20.0);
    LateralTyres model;
    model.car = car.car;
    const Vector<double, 3> u(delta, true_value(car, x, "wheel_speed_radps"), true_value(car, x, "a_x_mps2"));
    const auto rate = model.derivative<double>(belief_of(x, car), u);
    const double a_y = true_value(car, x, "a_y_mps2");
    // Pitch is a_x's alone, to which the steered drag's cosine is missing (delta^2 / 2 of a_x), and cos phi is 1: per mille of
    // a_y.
    EXPECT_NEAR(rate[0], 0.0, 2e-3 * std::abs(a_y)) << delta;
    EXPECT_NEAR(rate[1], 0.0, 2e-3 * std::abs(a_y) / 0.1) << delta;
    EXPECT_NEAR(model.output<double>(belief_of(x, car), u)[0], a_y, 2e-3 * std::abs(a_y)) << delta;
  }
}

// What is measured depends on the slope at once and on the peak only with the third power of the slip.
TEST(LateralTyres, FrictionIsSeenOnlyWhereTheTyresYield) {
  const LateralTyres model;
  const auto sensitivity = [&](double v_y) {
    Vector<double, 6> x;
    x << v_y, 0.0, 5.0, 5.7, 0.7, 0.0;
    Vector<double, 2> z;
    Matrix<double, 2, 6> h;
    value_and_jacobian<2>([&](const auto& d) { return model.output(d, Vector<double, 3>(0.0, 2.0 / 0.033, 0.0)); }, x, z, h);
    return Vector<double, 2>(h(0, 2), h(0, 4));
  };
  const auto small = sensitivity(-0.01), large = sensitivity(-0.05);
  EXPECT_NEAR(large[0] / small[0], 5.0, 0.5);     // proportional to the slip, less (B t)^2 = 2 % of three times that
  EXPECT_NEAR(large[1] / small[1], 125.0, 15.0);  // its third power, less the same
  EXPECT_LT(std::abs(small[1]), 0.02 * small[0]);
}

TEST(LateralTyres, FastestRateBoundsTheRatesAtAnySpeed) {
  const LateralTyres model;
  Vector<double, 6> x, rate;
  x << 0.0, 0.0, 6.0, 5.0, 0.8, 0.0;
  for (const double wheel_radps : {0.0, 1.0, 15.0, 60.0}) {
    Matrix<double, 6> f;
    value_and_jacobian<6>([&](const auto& d) { return model.derivative(d, Vector<double, 3>(0.0, wheel_radps, 0.0)); }, x, rate,
                          f);
    EXPECT_LE(f.eigenvalues().cwiseAbs().maxCoeff(), model.fastest_rate_hz(x)) << wheel_radps;
  }
}

}  // namespace
}  // namespace slipstream
