// Closed forms of the parts: tyre, engine, driveline, quarter car, noise law.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/dual.hpp"
#include "common/random.hpp"
#include "common/rk4.hpp"
#include "models/parts/driveline.hpp"
#include "models/parts/engine.hpp"
#include "models/parts/pacejka.hpp"
#include "models/parts/quarter_car.hpp"
#include "models/sensors/noise.hpp"
#include "models/vehicles/unimog.hpp"

namespace slipstream {
namespace {

// --- Pacejka ----------------------------------------------------------------------------------------------------------

struct TableOne {
  const char* name;
  double b, c, d, e;
};
constexpr TableOne kTableOne[]{// document 002, Table 1
                               {"dry", 10, 1.9, 1, 0.97},
                               {"wet", 12, 2.3, 0.82, 1},
                               {"snow", 5, 2, 0.3, 1},
                               {"ice", 4, 2, 0.1, 1}};

TEST(Pacejka, SurfacesAreThoseOfTable1) {
  ASSERT_EQ(kSurfaces.size(), std::size(kTableOne));
  for (std::size_t i = 0; i < kSurfaces.size(); ++i) {
    EXPECT_EQ(kSurfaces[i].name, kTableOne[i].name);
    EXPECT_EQ(kSurfaces[i].tyre.b, kTableOne[i].b);
    EXPECT_EQ(kSurfaces[i].tyre.c, kTableOne[i].c);
    EXPECT_EQ(kSurfaces[i].tyre.d, kTableOne[i].d);
    EXPECT_EQ(kSurfaces[i].tyre.e, kTableOne[i].e);
  }
}

TEST(Pacejka, SlopeAtZeroIsBcd) {
  for (const Surface& s : kSurfaces) {
    const double bcd = s.tyre.b * s.tyre.c * s.tyre.d;
    EXPECT_NEAR(s.tyre.friction(Dual<double, 1>::variable(0.0, 0)).grad[0], bcd, 1e-13 * bcd) << s.name;  // rounding
    EXPECT_NEAR(s.tyre.friction(1e-6) / 1e-6, bcd, 1e-8 * bcd) << s.name;  // curvature: relative (B C l)^2 < 1e-9
  }
}

TEST(Pacejka, OddAndZeroAtZero) {
  for (const Surface& s : kSurfaces) {
    EXPECT_EQ(s.tyre.friction(0.0), 0.0);
    for (const double l : {0.001, 0.05, 0.3, 1.0, 20.0}) EXPECT_EQ(s.tyre.friction(-l), -s.tyre.friction(l)) << s.name << l;
  }
}

// The peak is where C atan(...) = pi/2: the argument is tan(pi / (2C)). Found by bisection on the argument, which rises with l.
TEST(Pacejka, PeakIsD) {
  for (const Surface& s : kSurfaces) {
    const PacejkaTyre& t = s.tyre;
    double low = 0.0, high = 100.0;
    for (int i = 0; i < 200; ++i) {
      const double l = 0.5 * (low + high), argument = t.b * l - t.e * (t.b * l - std::atan(t.b * l));
      (argument < std::tan(0.5 * kPi / t.c) ? low : high) = l;
    }
    ASSERT_LT(high, 99.0) << s.name << ": never reaches its peak";
    EXPECT_NEAR(t.friction(low), t.d, 1e-14) << s.name;  // rounding: flat at the top
    double largest = 0.0;
    for (int k = 1; k <= 20000; ++k) {
      const double mu = t.friction(k * 1e-3);
      largest = std::max(largest, mu);
      EXPECT_LE(mu, t.d * (1.0 + 1e-15)) << s.name;  // rounding
    }
    EXPECT_NEAR(largest, t.d, 1e-3 * t.d) << s.name;  // grid of 1 mm/m: misses the peak by (B C dl)^2 / 8 < 1e-4
    EXPECT_LT(t.friction(20.0), 0.999 * t.d) << s.name << ": does not fall beyond the peak";
  }
}

// Worked out by hand: dry at l = 0.1, B l = 1,
//   1 - 0.97 (1 - pi/4) = 0.79184, atan = 0.66967, C atan = 1.27238, sin = 0.95580
TEST(Pacejka, DryAtTenPerCent) {
  EXPECT_NEAR(kSurfaces[0].tyre.friction(0.1), std::sin(1.9 * std::atan(0.03 + 0.97 * kPi / 4.0)), 1e-14);  // rounding
  EXPECT_NEAR(kSurfaces[0].tyre.friction(0.1), 0.9558, 5e-4);  // by hand, to three digits
}

TEST(Slip, RegularisationErrorIsAsTheHeadSays) {
  const double r = 0.52, eps = 0.01;
  for (const double v : {0.1, 0.26, 1.0, 5.0}) {
    const double w = 1.03 * v / r, exact = (w * r - v) / v;
    const double relative = 1.0 - longitudinal_slip(w, v, r, eps) / exact;
    const double leading = eps * eps / (2.0 * v * v);
    EXPECT_NEAR(relative, leading, 0.75 * eps * eps / (v * v) * leading + 1e-13) << v;  // next term: 3/4 (eps/v)^2 of it
  }
}

TEST(Slip, SignsAndStandstill) {
  EXPECT_EQ(longitudinal_slip(0.0, 0.0, 0.52, 0.01), 0.0);
  EXPECT_NEAR(longitudinal_slip(1.0, 0.0, 0.52, 0.01), 52.0, 1e-12);   // w r / v_eps; rounding
  EXPECT_GT(longitudinal_slip(10.0, 5.0, 0.52, 0.01), 0.0);            // driving
  EXPECT_LT(longitudinal_slip(9.0, 5.0, 0.52, 0.01), 0.0);             // braking
  EXPECT_NEAR(longitudinal_slip(0.0, 5.0, 0.52, 0.01), -1.0, 2.1e-6);  // locked: -1 to v_eps^2 / (2 v^2) = 2e-6
  EXPECT_EQ(longitudinal_slip(-10.0, -5.0, 0.52, 0.01), -longitudinal_slip(10.0, 5.0, 0.52, 0.01));  // mirror
}

// --- Engine -----------------------------------------------------------------------------------------------------------

constexpr double kRatedPower_w = 160e3;  // OM 924 LA: 160 kW at 2200 rpm
constexpr double kRated_radps = 2200.0 * 2.0 * kPi / 60.0;

TEST(Engine, QuadraticIsJazarsEquation) {
  const EngineCurve curve = quadratic_curve(kRatedPower_w, kRated_radps);
  const double p1 = 0.87 * kRatedPower_w / kRated_radps, p2 = 1.13 * kRatedPower_w / std::pow(kRated_radps, 2),
               p3 = kRatedPower_w / std::pow(kRated_radps, 3);
  for (const double rpm : {0.0, 800.0, 1500.0, 2200.0}) {
    const double w = rpm * 2.0 * kPi / 60.0;
    EXPECT_NEAR(curve.torque_nm(w), p1 + p2 * w - p3 * w * w, 1e-10) << rpm;  // rounding of sums of 1e3
  }
  EXPECT_NEAR(curve.torque_nm(kRated_radps) * kRated_radps, kRatedPower_w, 1e-9);  // rounding: 1e-15 of the power
}

TEST(Engine, QuadraticHasItsTorquePeakAtP2Over2P3) {
  const EngineCurve curve = quadratic_curve(kRatedPower_w, kRated_radps);
  const auto slope = [&](double w) { return curve.torque_nm(Dual<double, 1>::variable(w, 0)).grad[0]; };
  EXPECT_NEAR(slope(0.5 * 1.13 * kRated_radps), 0.0, 1e-13);  // rounding of slopes of 4 N m s
  EXPECT_GT(slope(0.4 * kRated_radps), 0.0);
  EXPECT_LT(slope(0.9 * kRated_radps), 0.0);
}

TEST(Engine, QuinticReproducesAQuinticExactly) {
  const auto f = [](double s) { return 1.0 - 2.0 * s + 3.0 * s * s - 0.5 * s * s * s + 4.0 * std::pow(s, 4) - std::pow(s, 5); };
  std::vector<double> rpm, torque;
  for (int k = 1; k <= 9; ++k) {
    rpm.push_back(250.0 * k);
    torque.push_back(f(k / 9.0));
  }
  const EngineCurve curve = quintic_curve(rpm, torque);
  for (const double s : {0.15, 0.5, 0.77, 1.0})
    EXPECT_NEAR(curve.torque_nm(s * 2250.0 * 2.0 * kPi / 60.0), f(s), 1e-10) << s;  // condition of the fit 1e5 times 1e-16
}

// Least squares: residuals are orthogonal to every power of the speed.
TEST(Engine, QuinticsResidualsAreOrthogonalToThePowers) {
  const Unimog u;
  const EngineCurve curve = quintic_curve(u.engine_speed_rpm, u.engine_torque_nm);
  for (int power = 0; power <= 5; ++power) {
    double product = 0.0, size = 0.0;
    for (std::size_t k = 0; k < u.engine_speed_rpm.size(); ++k) {
      const double basis = std::pow(u.engine_speed_rpm[k] / 2200.0, power);
      product += basis * (curve.torque_nm(u.engine_speed_rpm[k] * 2.0 * kPi / 60.0) - u.engine_torque_nm[k]);
      size += basis;
    }
    EXPECT_NEAR(product / size, 0.0, 1e-8) << power;  // N m; condition of the fit 1e4 times 1e-16 of 800 N m
  }
}

TEST(Engine, UnimogsQuinticMeetsItsPointsAndRatedPower) {
  Unimog u;
  u.prepare();
  ASSERT_EQ(u.engine_speed_rpm.size(), u.engine_torque_nm.size());
  for (std::size_t k = 0; k < u.engine_speed_rpm.size(); ++k)
    EXPECT_NEAR(u.curve().torque_nm(u.engine_speed_rpm[k] * 2.0 * kPi / 60.0), u.engine_torque_nm[k], 3.0)  // 0.4 % of 800 N m
        << u.engine_speed_rpm[k] << " rpm";
  EXPECT_NEAR(u.curve().torque_nm(kRated_radps) * kRated_radps, kRatedPower_w, 0.005 * kRatedPower_w);  // data sheets: 0.5 %
  // Between its points too it stays an engine: no wiggle above the 810 N m that the peak of Figure 40 implies (+ 1 %).
  for (double rpm = 800.0; rpm <= 2200.0; rpm += 10.0) {
    const double torque = u.curve().torque_nm(rpm * 2.0 * kPi / 60.0);
    EXPECT_GT(torque, 480.0) << rpm;  // least of the points found by the search of the reference: 485 N m (- 1 %)
    EXPECT_LT(torque, 818.0) << rpm;
  }
}

// --- Driveline --------------------------------------------------------------------------------------------------------

TEST(Driveline, GearSpeedsOfTable14ToThePrintedDigit) {
  const Driveline d;
  const double printed_kmph[]{6.5, 9.4, 14.2, 19.3, 28.4, 41.0, 62.1, 84.4};
  ASSERT_EQ(d.gears(), 8);
  for (int gear = 1; gear <= 8; ++gear)
    EXPECT_NEAR(3.6 * d.speed_mps(2200.0 * 2.0 * kPi / 60.0, gear, 0.52), printed_kmph[gear - 1], 0.05)
        << gear;  // half a digit
}

TEST(Driveline, RatiosOfTable13) {
  const Driveline d;
  const double printed[]{9.57, 6.635, 4.375, 3.219, 2.188, 1.517, 1.0, 0.736};
  for (int gear = 1; gear <= 8; ++gear) EXPECT_DOUBLE_EQ(d.total_ratio(gear), printed[gear - 1] * 6.94) << gear;
}

TEST(Driveline, PowerOutIsEfficiencyTimesPowerIn) {
  Driveline d;
  for (const double efficiency : {0.9, 0.75, 1.0}) {
    d.efficiency = efficiency;
    for (int gear = 1; gear <= d.gears(); ++gear) {
      const double w = 12.5, t_m = 700.0;
      const double in = t_m * d.engine_speed_radps(w, gear), out = d.wheel_torque_nm(t_m, gear) * w;
      EXPECT_NEAR(out, efficiency * in, 1e-12 * in) << gear;  // rounding
      // v = w r when nothing slips, so the speed and the engine's are the same statement.
      EXPECT_NEAR(d.speed_mps(d.engine_speed_radps(w, gear), gear, 0.52), w * 0.52, 1e-13) << gear;  // rounding
    }
  }
}

// --- Quarter car ------------------------------------------------------------------------------------------------------

constexpr double kDragFactor = 0.5 * 1.2 * 0.6 * 5.6;  // rho C_d A_f / 2 of Table 15, kg/m

// m v' = -f m g - k v^2 from v0:  v(t) = V tan(atan(v0 / V) - t / tau),  V = sqrt(f m g / k), tau = sqrt(m / (f g k))
double coast_down(double v0, double t, double mass, double force, double k) {
  const double scale = std::sqrt(force / k);
  return scale * std::tan(std::atan(v0 / scale) - t * std::sqrt(force * k) / mass);
}

TEST(QuarterCar, CoastDownOfTheBody) {
  const QuarterCar q;
  const double friction = -0.02;
  const auto f = [&](const Vector<double, 1>& x) { return Vector<double, 1>(q.acceleration_mps2(friction, x[0])); };
  Vector<double, 1> v(25.0);
  for (int k = 1; k <= 600; ++k) {
    v = rk4_step(f, v, 0.1);
    // rk4: (dt / tau)^4 = (0.1 / 77 s)^4, so 3e-12 a second and rounding below
    EXPECT_NEAR(v[0], coast_down(25.0, 0.1 * k, 2000.0, 0.02 * 2000.0 * 9.81, kDragFactor), 1e-10) << k;
  }
  EXPECT_LT(v[0], 15.0);  // it did slow down
}

// Wheel and body together, rolling without slip: F_x is what makes v' = r w', so (m + J / r^2) v' = -f_r m g - k v^2.
TEST(QuarterCar, CoastDownRollingWithoutSlip) {
  const QuarterCar q;
  const auto f = [&](const Vector<double, 1>& x) {
    const double v = x[0], w = v / 0.52;
    const auto gap = [&](double mu) { return q.acceleration_mps2(mu, v) - 0.52 * q.wheel_acceleration_radps2(0.0, mu, w); };
    const double mu = -gap(0.0) / (gap(1.0) - gap(0.0));  // the gap is linear in mu
    return Vector<double, 1>(q.acceleration_mps2(mu, v));
  };
  Vector<double, 1> v(25.0);
  for (int k = 1; k <= 600; ++k) v = rk4_step(f, v, 0.1);
  const double expected = coast_down(25.0, 60.0, 2000.0 + 11.5 / (0.52 * 0.52), 0.02 * 2000.0 * 9.81, kDragFactor);
  EXPECT_NEAR(v[0], expected, 1e-7);  // the regularised sign: (w_eps / w)^2 / 2 < 3e-9 of 12 m/s lost
}

// J w' = -b w: w = w0 exp(-b t / J).
TEST(QuarterCar, FreeWheelSpinsDownByItsViscousFriction) {
  QuarterCar q;
  q.viscous_friction_nms = 2.3;
  q.rolling_resistance = 0.0;
  const auto f = [&](const Vector<double, 1>& x) { return Vector<double, 1>(q.wheel_acceleration_radps2(0.0, 0.0, x[0])); };
  Vector<double, 1> w(40.0);
  for (int k = 0; k < 100; ++k) w = rk4_step(f, w, 0.1);
  EXPECT_NEAR(w[0], 40.0 * std::exp(-2.3 * 10.0 / 11.5), 1e-7);  // (b dt / J)^5 / 120 a step of 40: 1e-10, a hundred of them
}

TEST(QuarterCar, TerminalSpeedBalancesTractionAndDrag) {
  const QuarterCar q;
  for (const double mu : {0.05, 0.3, 1.0}) {
    const double terminal = std::sqrt(mu * 2000.0 * 9.81 / kDragFactor);
    EXPECT_NEAR(q.acceleration_mps2(mu, terminal), 0.0, 1e-14) << mu;  // rounding of accelerations of 10 m/s^2
    EXPECT_GT(q.acceleration_mps2(mu, 0.99 * terminal), 0.0);
    EXPECT_LT(q.acceleration_mps2(mu, 1.01 * terminal), 0.0);
  }
}

TEST(QuarterCar, SteadyWheelNeedsTheTorqueOfTractionRollingAndBearing) {
  QuarterCar q;
  q.viscous_friction_nms = 2.0;
  const double mu = 0.1, w = 30.0, mg = 2000.0 * 9.81;
  const double torque = mu * mg * 0.52 + 0.02 * mg * 0.52 + 2.0 * w;
  EXPECT_NEAR(q.wheel_acceleration_radps2(torque, mu, w), 0.0, 2e-8);  // the regularised sign: 204 N m * 5.6e-10 / 11.5
}

TEST(QuarterCar, DragOpposesTheMotionInBothDirections) {
  const QuarterCar q;
  EXPECT_NEAR(q.drag_n(10.0), 100.0 * kDragFactor, 1e-11);    // rounding
  EXPECT_NEAR(q.drag_n(-10.0), -100.0 * kDragFactor, 1e-11);  // rounding
  EXPECT_EQ(q.drag_n(0.0), 0.0);
  EXPECT_GT(q.acceleration_mps2(0.0, -10.0), 0.0);  // slows down in reverse too
  EXPECT_LT(q.acceleration_mps2(0.0, 10.0), 0.0);
  const Dual<double, 1> slope = q.drag_n(Dual<double, 1>::variable(-10.0, 0));
  EXPECT_NEAR(slope.grad[0], 2.0 * 10.0 * kDragFactor, 1e-11);  // d(v|v|)/dv = 2|v|; rounding
}

TEST(QuarterCar, RollingTorqueIsOddZeroAtRestAndFullWhenRolling) {
  const QuarterCar q;
  const double full = 0.02 * 2000.0 * 9.81 * 0.52;
  EXPECT_EQ(q.rolling_torque_nm(0.0), 0.0);
  EXPECT_NEAR(q.rolling_torque_nm(1.0), full, full * 6e-7);               // 1 - w_eps^2 / 2 = 1 - 5e-7
  EXPECT_NEAR(q.rolling_torque_nm(-1.0), -full, full * 6e-7);             // likewise
  EXPECT_NEAR(q.rolling_torque_nm(0.001), full / std::sqrt(2.0), 1e-10);  // at w_eps: 1 / sqrt 2; rounding
  EXPECT_EQ(q.wheel_acceleration_radps2(0.0, 0.0, 0.0), 0.0);             // stands still by itself
}

// --- Noise law --------------------------------------------------------------------------------------------------------

TEST(NoiseLaw, ByHand) {
  const NoiseLaw law{0.05, 0.3};
  EXPECT_NEAR(law.variance(0.0), 0.09, 1e-16);         // absolute part alone; rounding
  EXPECT_NEAR(law.variance(20.0), 1.09, 1e-15);        // 1^2 + 0.3^2; rounding
  EXPECT_NEAR(law.variance(-20.0), 1.09, 1e-15);       // of the size, not the sign
  EXPECT_NEAR(law.variance(20.0, 16.0), 1.13, 1e-15);  // + 0.0025 * 16
  EXPECT_EQ((NoiseLaw{}.variance(20.0, 16.0)), 0.0);   // no noise
}

// E[sigma^2] over h ~ N(mean, variance): what a filter that is unsure of h has to expect.
TEST(NoiseLaw, ExpectedVarianceByMonteCarlo) {
  const NoiseLaw law{0.1, 0.2};
  const double mean = 3.0, deviation = 2.0;
  RandomStream random(1, 0, "noise law");
  const int n = 400'000;
  double sum = 0.0, sum_of_squares = 0.0;
  for (int i = 0; i < n; ++i) {
    const double h = mean + deviation * random.normal();
    const double sigma = std::sqrt(0.1 * 0.1 * h * h + 0.2 * 0.2), error = sigma * random.normal();
    sum += error * error;
    sum_of_squares += error * error * error * error;
  }
  const double average = sum / n, standard_error = std::sqrt((sum_of_squares / n - average * average) / n);
  EXPECT_NEAR(law.variance(mean, deviation * deviation), average, 4.0 * standard_error);  // 4 standard errors, fixed seed
  EXPECT_GT(std::abs(law.variance(mean) - average), 4.0 * standard_error);  // the plain law at the mean is not enough
}

}  // namespace
}  // namespace slipstream
