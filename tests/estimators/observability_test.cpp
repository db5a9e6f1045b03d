// Observability: document 002's eq. 5.5, closed forms, and which states nothing measures.
#include "estimators/observability.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/refusal.hpp"
#include "io/scenario_reader.hpp"

namespace slipstream::test {
namespace {

using Names = std::vector<std::string>;

// Document 002, Table 5.
constexpr double kMass_kg = 0.7, kRadius_m = 0.033, kInertia_kgm2 = 3.2e-3, kViscous_nms = 0.01, kG = 9.81;

Eigen::Matrix2d scale_car_a() {
  Eigen::Matrix2d a;
  a << -kViscous_nms / kInertia_kgm2, -kMass_kg * kG * kRadius_m / kInertia_kgm2, 0.0, 0.0;
  return a;
}

TEST(Observability, TheDocumentsMatrix) {
  const Eigen::Matrix2d c = (Eigen::Matrix2d() << 0.0, kG, 1.0, 0.0).finished();  // eq. 5.4
  const Eigen::MatrixXd o = observability_matrix(scale_car_a(), c);
  ASSERT_EQ(o.rows(), 4);
  ASSERT_EQ(o.cols(), 2);
  // Eq. 5.5 with the numbers of Table 5: 0.01 / 0.0032 = 3.125 and 0.7 * 9.81 * 0.033 / 0.0032 = 70.8159375.
  const double expected[4][2] = {{0.0, 9.81}, {1.0, 0.0}, {0.0, 0.0}, {-3.125, -70.8159375}};
  for (int r = 0; r < 4; ++r)
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(o(r, k), expected[r][k], 1e-12) << r << k;  // rounding
  EXPECT_EQ(numerical_rank(o), 2);
  EXPECT_EQ(numerical_rank(observability_matrix(scale_car_a(), c.row(0))), 1) << "acceleration alone: (0 g), then zeros";
  EXPECT_EQ(numerical_rank(observability_matrix(scale_car_a(), c.row(1))), 2) << "the wheel alone feels the friction";
}

LongitudinalFriction scale_car() {
  LongitudinalFriction m;
  m.wheel.quarter = {kMass_kg, kInertia_kgm2, kRadius_m, 0.0, kViscous_nms, 1.2, 0.01, 0.5};
  m.drag = false;
  return m;
}

const SensorConfig kWheel{"wheel_speed", "wheel_speed_radps", 100.0, {0.0, 0.5}};
const SensorConfig kAcceleration{"accelerometer", "a_x_mps2", 100.0, {0.0, 0.3}};

Scenario scenario_of(const AnyProcess& process, const std::vector<SensorConfig>& sensors) {
  Scenario s;
  s.sensors = sensors;
  s.estimator.process = process;
  return s;
}
Tuning tuning() {
  Tuning t;
  t.initial_mean = {{"wheel_speed_radps", 40.0}, {"speed_mps", 1.5}, {"friction", 0.3}};
  t.initial_variance = {{"wheel_speed_radps", 1.0}, {"speed_mps", 0.02}, {"friction", 0.01}};
  return t;
}

TEST(Observability, AConstantMeasuredNTimes) {
  // a_x = g mu, mu' = 0, at 0, 10, ..., 1000 ms: the posterior variance of a mean, 1 / (1/P + N g^2 / R).
  const Observability o = observability_of(scenario_of(WheelFriction{scale_car().wheel}, {kAcceleration}), tuning());
  EXPECT_EQ(o.outputs, Names{"a_x_mps2"}) << "an output without a sensor does not count";
  EXPECT_NEAR(o.window_s, 1.0, 1e-12);  // rounding
  const double s2 = 101.0 * 9.81 * 9.81 * 0.01 / 0.09;
  EXPECT_NEAR(o.states[1].variance_ratio, 1.0 / (1.0 + s2), 1e-12);  // rounding
  EXPECT_NEAR(o.singular_values[0], std::sqrt(s2), 1e-9);            // rounding
  EXPECT_EQ(o.rank, 1);
  EXPECT_EQ(o.unobservable(), Names{"wheel_speed_radps"});
  EXPECT_EQ(o.states[0].variance_ratio, 1.0);
  EXPECT_TRUE(std::isinf(o.gramian_condition));
}

TEST(Observability, ThePriorsReductionIsThatOfLeastSquares) {
  // The wheel alone: w(t) = e^-ct w_0 - k (1 - e^-ct) / c mu + ..., c = b/J, k = m g r / J; two unknowns, 101 equations.
  const Observability o = observability_of(scenario_of(WheelFriction{scale_car().wheel}, {kWheel}), tuning());
  const double c = kViscous_nms / kInertia_kgm2, k = kMass_kg * kG * kRadius_m / kInertia_kgm2;
  Eigen::Matrix2d information = Eigen::Vector2d(1.0, 100.0).asDiagonal();
  for (int i = 0; i <= 100; ++i) {
    const double decay = std::exp(-c * 0.01 * i);
    const Eigen::Vector2d slope(decay, -k * (1.0 - decay) / c);
    information += slope * slope.transpose() / 0.25;
  }
  const Eigen::Matrix2d posterior = information.inverse();
  // Runge-Kutta against exp: (c dt)^5 / 120 = 3e-10 a step, a hundred steps.
  EXPECT_NEAR(o.states[0].variance_ratio, posterior(0, 0) / 1.0, 1e-7 * posterior(0, 0));
  EXPECT_NEAR(o.states[1].variance_ratio, posterior(1, 1) / 0.01, 1e-7 * posterior(1, 1) / 0.01);
  EXPECT_EQ(o.rank, 2);
  EXPECT_EQ(observability_line(o), "");
}

TEST(Observability, SlowSensorsCountAsOftenAsTheyMeasure) {
  SensorConfig slow = kAcceleration;
  slow.rate_hz = 10.0;  // at 0, 100, ..., 1000 ms beside the wheel's 100 Hz
  const Observability with = observability_of(scenario_of(WheelFriction{scale_car().wheel}, {kWheel, slow}), tuning());
  const Observability without = observability_of(scenario_of(WheelFriction{scale_car().wheel}, {kWheel}), tuning());
  const auto trace = [](const Observability& o) {
    double sum = 0.0;
    for (const double s : o.singular_values) sum += s * s;
    return sum;
  };
  EXPECT_NEAR(trace(with) - trace(without), 11.0 * 9.81 * 9.81 * 0.01 / 0.09, 1e-8);  // rounding of sums near 1e5
}

TEST(Observability, NothingMeasuresTheSpeed) {
  const Observability o = observability_of(scenario_of(scale_car(), {kWheel, kAcceleration}), tuning());
  EXPECT_EQ(o.rank, 2);
  EXPECT_EQ(o.unobservable(), Names{"speed_mps"});
  EXPECT_EQ(o.states[1].variance_ratio, 1.0);
  EXPECT_FALSE(o.fading);
  EXPECT_EQ(observability_line(o),
            "speed_mps is not observable from wheel_speed_radps, a_x_mps2 with model longitudinal_friction (rank 2 of 3): its "
            "estimate is integrated from the start and its uncertainty grows");
}

TEST(Observability, TheLineNamesAllAndWhatIsHardlyObservable) {
  EXPECT_EQ(
      observability_line(observability_of(scenario_of(scale_car(), {}), tuning())),
      "wheel_speed_radps, speed_mps and friction are not observable from no sensor with model longitudinal_friction (rank "
      "0 of 3): their estimates are integrated from the start and their uncertainty grows");
  SensorConfig poor = kAcceleration;
  poor.noise.absolute = 100.0;  // 101 g^2 0.01 / 1e4 = 0.0097: next to nothing
  EXPECT_EQ(observability_line(observability_of(scenario_of(WheelFriction{scale_car().wheel}, {poor}), tuning())),
            "wheel_speed_radps is not observable from a_x_mps2 with model wheel_friction (rank 1 of 2): its estimate follows "
            "from the model alone, in which errors fade; friction is hardly observable");
}

TEST(Observability, WhatRollsForgetsItsStart) {
  LongitudinalFriction m = scale_car();
  m.rolling_rate_hz = 10.0;
  const Observability o = observability_of(scenario_of(m, {kWheel, kAcceleration}), tuning());
  EXPECT_EQ(o.unobservable(), Names{"speed_mps"}) << "v follows the wheel, but no output shows it";
  EXPECT_TRUE(o.fading) << "e^-10 is left after 1 s";
}

// a_x = mu g - R(v)/m: the drag shows the speed, but for v = 0, where it has no slope.
TEST(Observability, DragShowsTheSpeedWhenItMoves) {
  LongitudinalFriction m = scale_car();
  m.drag = true;
  const Scenario s = scenario_of(m, {kWheel, kAcceleration});
  const auto rank_at = [&](double v) {
    return observability_along(s, tuning(), std::vector<std::vector<double>>(50, {v / kRadius_m, v, 0.0}),
                               std::vector<std::vector<double>>(50, {kViscous_nms * v / kRadius_m}), 0.01)
        .rank;
  };
  EXPECT_EQ(rank_at(0.0), 2);
  EXPECT_EQ(rank_at(2.0), 3);
  Tuning at_rest = tuning();
  at_rest.initial_mean.clear();
  EXPECT_EQ(observability_of(s, at_rest).rank, 3) << "a start at rest is not taken for the general case";
  const Observability weak = observability_of(s, tuning());
  EXPECT_EQ(weak.weak(), Names{"speed_mps"}) << "but hardly";
  EXPECT_EQ(observability_line(weak), "");
}

TEST(Observability, OfTheShippedUnimog) {
  const Scenario s = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/unimog.toml").scenario;
  EXPECT_EQ(observability_line(observability_of(s, s.estimator.tunings.at("matched"))), "") << "with drag";
  EXPECT_EQ(observability_of(s, s.estimator.tunings.at("document")).unobservable(), Names{"speed_mps"}) << "without";
}

TEST(Observability, Refusals) {
  const Scenario s = scenario_of(WheelFriction{scale_car().wheel}, {kWheel});
  Tuning sure = tuning();
  sure.initial_variance.erase("friction");
  const auto line_of = [](const auto& f) -> std::string {
    try {
      f();
    } catch (const Refusal& refusal) {
      return refusal.what();
    }
    return "not refused";
  };
  EXPECT_EQ(line_of([&] { observability_of(s, sure); }),
            "tuning: initial_variance.friction is 0, expected a number greater than 0 to measure observability");
  EXPECT_EQ(line_of([&] {
              observability_along(s, tuning(), {{1.0, 0.1}, {1.0}}, {{0.0}, {0.0}}, 0.01);
            }),
            "trajectory, instant 1: expected 2 states and 1 inputs of model wheel_friction");
}

}  // namespace
}  // namespace slipstream::test
