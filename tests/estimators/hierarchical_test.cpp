// The hierarchical observer: its joint covariance against a three-state filter written apart, its consistency over seeded
// runs, and the Unimog of document 002.
#include "estimators/hierarchical.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/random.hpp"
#include "io/scenario_reader.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

constexpr double kDt = 0.01;
constexpr double kTorque_nm = 0.75;  // document 002, section 5.2
using State = Eigen::Vector3d;       // w, v, mu
const State kProcessDensity(0.4, 1e-4, 0.02), kStart(40.0, 1.5, 0.3), kStartVariance(1.0, 1e-3, 0.01);

// The scale car of document 002, Tables 5 and 15, without rolling resistance: linear as long as there is no drag.
LongitudinalFriction scale_car() {
  LongitudinalFriction m;
  m.wheel.quarter = {0.7, 3.2e-3, 0.033, 0.0, 0.01, 1.2, 0.0, 0.0};
  m.drag = false;
  return m;
}
LongitudinalFriction scale_car_with_drag() {
  LongitudinalFriction m = scale_car();
  m.drag = true;
  m.wheel.quarter.frontal_area_m2 = 1.0;  // far too much, so that it shows: R_aer = 0.6 v |v|
  m.wheel.quarter.drag_coefficient = 1.0;
  return m;
}

Scenario scenario_of(const AnyProcess& process) {
  Scenario s;
  s.sensors = {{"wheel_speed", "wheel_speed_radps", 100.0, {0.0, 0.5}}, {"accelerometer", "a_x_mps2", 100.0, {0.0, 0.3}}};
  s.estimator.process = process;
  Tuning t;
  t.process_variance = {{"wheel_speed_radps", 0.4}, {"speed_mps", 1e-4}, {"friction", 0.02}};
  t.initial_mean = {{"wheel_speed_radps", 40.0}, {"speed_mps", 1.5}, {"friction", 0.3}};
  t.initial_variance = {{"wheel_speed_radps", 1.0}, {"speed_mps", 1e-3}, {"friction", 0.01}};
  s.estimator.tunings = {{"test", t}};
  return s;
}

// The three equations of the head of longitudinal_friction.hpp, for w > 0 and v > 0, written apart.
State rate(const QuarterCar& q, bool drag, const State& x) {
  const double air = drag ? 0.5 * q.air_density_kgpm3 * q.drag_coefficient * q.frontal_area_m2 * x[1] * x[1] / q.mass_kg : 0.0;
  return {(kTorque_nm - q.viscous_friction_nms * x[0] - x[2] * q.mass_kg * 9.81 * q.wheel_radius_m) / q.wheel_inertia_kgm2,
          9.81 * x[2] - air, 0.0};
}
State after(const QuarterCar& q, bool drag, const State& x) {
  const State a = rate(q, drag, x), b = rate(q, drag, x + 0.5 * kDt * a), c = rate(q, drag, x + 0.5 * kDt * b),
              d = rate(q, drag, x + kDt * c);
  return x + kDt / 6.0 * (a + 2.0 * b + 2.0 * c + d);
}

// A three-state filter whose gain row for v is zero: w and mu take the optimal gain of their own 2 x 2 filter, which knows
// nothing of v; the covariance of all three follows Joseph's form, which is right for any gain.
struct ZeroGainFilter {
  const LongitudinalFriction model;
  State x;
  Eigen::Matrix3d p;
  Eigen::Matrix2d own;  // what the 2 x 2 filter believes

  void step(bool first, const Eigen::Vector2d& z, const State& q_variance, const Eigen::Vector2d& r_variance,
            std::uint32_t measured) {
    const QuarterCar& q = model.wheel.quarter;
    if (!first) {
      Eigen::Matrix3d f;
      for (int i = 0; i < 3; ++i) {
        constexpr double kStep = 1e-4;
        const State e = kStep * State::Unit(i);
        f.col(i) = (after(q, model.drag, x + e) - after(q, model.drag, x - e)) / (2.0 * kStep);
      }
      x = after(q, model.drag, x);
      p = (f * p * f.transpose()).eval();
      p.diagonal() += kDt * q_variance;
      Eigen::Matrix2d f2;
      f2 << f(0, 0), f(0, 2), f(2, 0), f(2, 2);
      own = (f2 * own * f2.transpose()).eval();
      own(0, 0) += kDt * q_variance[0];
      own(1, 1) += kDt * q_variance[2];
    }
    const double air =
        0.5 * q.air_density_kgpm3 * q.drag_coefficient * q.frontal_area_m2 / q.mass_kg * (model.drag ? 1.0 : 0.0);
    Eigen::Matrix<double, 2, 3> h;
    h << 1.0, 0.0, 0.0, 0.0, -2.0 * air * x[1], 9.81;
    Eigen::Matrix2d h2;
    h2 << 1.0, 0.0, 0.0, 9.81;
    Eigen::Vector2d nu(z[0] - x[0], z[1] - (9.81 * x[2] - air * x[1] * x[1]));
    for (int i = 0; i < 2; ++i) {
      if ((measured >> i & 1U) != 0U) continue;
      h.row(i).setZero();
      h2.row(i).setZero();
      nu[i] = 0.0;
    }
    const Eigen::Matrix2d r = r_variance.asDiagonal();
    const Eigen::Matrix2d gain2 = own * h2.transpose() * (h2 * own * h2.transpose() + r).inverse();
    own = ((Eigen::Matrix2d::Identity() - gain2 * h2) * own).eval();
    Eigen::Matrix<double, 3, 2> gain;
    gain.row(0) = gain2.row(0);
    gain.row(1).setZero();
    gain.row(2) = gain2.row(1);
    x += gain * nu;
    const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() - gain * h;
    p = (left * p * left.transpose() + gain * r * gain.transpose()).eval();
  }
};

void expect_the_zero_gain_filter(const LongitudinalFriction& model, const std::string& algorithm, double tolerance) {
  const Scenario s = scenario_of(model);
  const std::unique_ptr<Estimator> observer = make_estimator(algorithm, s, "test");
  observer->start_given();
  ZeroGainFilter reference{model, kStart, kStartVariance.asDiagonal(), Eigen::Vector2d(1.0, 0.01).asDiagonal()};
  RandomStream random(5, 0, "hierarchical");
  const std::array<double, 1> u{kTorque_nm};
  double correlation = 0.0;
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector2d z(45.0 - 0.02 * k + 0.5 * random.normal(), 3.0 + 0.3 * random.normal());
    const std::uint32_t measured = k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U;
    observer->step({k == 0 ? 0.0 : kDt, u, {z.data(), 2}, measured});
    reference.step(k == 0, z, kProcessDensity, {0.25, 0.09}, measured);
    const Posterior p = observer->posterior();
    ASSERT_EQ(p.status, EstimateStatus::kValid) << k;
    correlation = std::max(correlation, reference.p(1, 2) / std::sqrt(reference.p(1, 1) * reference.p(2, 2)));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      ASSERT_NEAR(p.mean[i], reference.x[row], tolerance * std::abs(reference.x[row])) << k << " " << i;
      for (std::size_t j = 0; j < 3; ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        const double size = std::sqrt(reference.p(row, row) * reference.p(column, column));
        ASSERT_NEAR(p.covariance[3 * i + j], reference.p(row, column), tolerance * size) << k << " " << i << j;
      }
    }
  }
  EXPECT_GT(correlation, 0.1) << "else the cross terms would be nothing to compare";
}

TEST(Hierarchical, CovarianceIsThatOfAFilterWithoutAGainForTheSpeed) {
  // Differences over 1e-4 of a linear map, on numbers near 50: rounding of 1e-11 a step, summed over the filter's memory.
  expect_the_zero_gain_filter(scale_car(), "hierarchical_ekf", 1e-9);
  expect_the_zero_gain_filter(scale_car(), "hierarchical_mhe", 1e-6);  // the solver's tolerance
}

TEST(Hierarchical, DragCouplesTheLevelsBothWays) {
  // The reference linearises where it stands, as the observer does; what is left are differences of h = 1e-4.
  expect_the_zero_gain_filter(scale_car_with_drag(), "hierarchical_ekf", 1e-8);
}

// NEES: e' P^-1 e of n states is chi-square with n degrees of freedom, so its sum over 200 independent runs has 600. Its 95 %
// band by Wilson and Hilferty, f (1 - 2/(9f) +- 1.96 sqrt(2/(9f)))^3.
TEST(Hierarchical, ErrorsAreAsLargeAsTheCovarianceSays) {
  constexpr int kRuns = 200, kSteps = 300;
  const LongitudinalFriction model = scale_car();
  const Scenario s = scenario_of(model);
  const State q_sigma = (kDt * kProcessDensity).cwiseSqrt(), p_sigma = kStartVariance.cwiseSqrt();
  const std::array<double, 1> u{kTorque_nm};
  std::array<double, 3> sum{};  // after 1, 2, 3 s
  for (int run = 0; run < kRuns; ++run) {
    RandomStream random(11, static_cast<std::uint64_t>(run), "nees");
    const auto draw = [&](const State& sigma) {
      State d;
      for (int i = 0; i < 3; ++i) d[i] = sigma[i] * random.normal();
      return d;
    };
    const std::unique_ptr<Estimator> observer = make_estimator("hierarchical_ekf", s, "test");
    observer->start_given();
    State x = kStart + draw(p_sigma);
    for (int k = 0; k <= kSteps; ++k) {
      if (k > 0) x = after(model.wheel.quarter, false, x) + draw(q_sigma);
      const std::array<double, 2> z{x[0] + 0.5 * random.normal(), 9.81 * x[2] + 0.3 * random.normal()};
      observer->step({k == 0 ? 0.0 : kDt, u, z, 3U});
      if (k == 0 || k % 100 != 0) continue;
      const Posterior p = observer->posterior();
      const State e = x - Eigen::Map<const State>(p.mean.data());
      const Eigen::Matrix3d covariance = Eigen::Map<const Eigen::Matrix3d>(p.covariance.data());
      sum[static_cast<std::size_t>(k / 100 - 1)] += e.dot(covariance.ldlt().solve(e));
    }
  }
  constexpr double f = 3.0 * kRuns;
  const double centre = 1.0 - 2.0 / (9.0 * f), width = 1.96 * std::sqrt(2.0 / (9.0 * f));
  for (const double nees : sum) {
    EXPECT_GT(nees, f * std::pow(centre - width, 3));
    EXPECT_LT(nees, f * std::pow(centre + width, 3));
  }
}

TEST(Hierarchical, ARollingWheelHoldsTheSpeed) {
  LongitudinalFriction model = scale_car();
  model.rolling_rate_hz = 50.0;
  Scenario s = scenario_of(model);
  s.estimator.tunings["test"].process_variance["speed_mps"] = 0.05;
  const std::unique_ptr<Estimator> observer = make_estimator("hierarchical_ekf", s, "test");
  observer->start_given();
  const std::array<double, 1> u{0.4};  // holds w = 40 rad/s against b w
  const std::array<double, 2> z{40.0, 0.0};
  for (int k = 0; k <= 300; ++k) observer->step({k == 0 ? 0.0 : kDt, u, z, 3U});
  const Posterior p = observer->posterior();
  EXPECT_NEAR(p.mean[1], 0.033 * 40.0, 1e-3);  // v = r w where mu = 0; what the start left over in 3 s of a 0.5 s memory
  // v' = -k v + ...: its own noise settles at q / (2 k) = 5e-4 instead of growing; the wheel's and friction's errors add less.
  EXPECT_GT(p.covariance[4], 0.05 / (2.0 * 50.0) * 0.9);
  EXPECT_LT(p.covariance[4], 2.0 * 0.05 / (2.0 * 50.0));
}

TEST(Hierarchical, StartOnTheMoveRolls) {
  const Scenario s = scenario_of(scale_car());
  const std::unique_ptr<Estimator> observer = make_estimator("hierarchical_ekf", s, "test");
  EXPECT_FALSE(observer->start_measured(1, 3.0)) << "an acceleration fixes no start";
  ASSERT_TRUE(observer->start_measured(0, 60.0));
  const Posterior p = observer->posterior();
  EXPECT_EQ(p.mean[0], 60.0);
  EXPECT_NEAR(p.mean[1], 0.033 * 60.0, 1e-12);  // rounding
  EXPECT_EQ(p.mean[2], 0.3);
  EXPECT_NEAR(p.covariance[0], 1.0 + 0.25, 1e-12);    // rounding; the sensor's 0.5^2 is added,
  EXPECT_NEAR(p.covariance[1], 0.033 * 0.25, 1e-12);  // and v shares it
  const std::array<double, 1> u{kTorque_nm};
  const std::array<double, 2> z{60.0, 2.943};
  observer->step({0.0, u, z, 2U});
  EXPECT_NEAR(observer->posterior().mean[0], 60.0, 1e-12);  // rounding: the first level has started there as well
}

class Stub final : public Estimator {
 public:
  EstimateStatus status = EstimateStatus::kFallback;
  ModelNames names() const override { return {}; }
  void start_given() override {}
  bool start_measured(int, double) override { return true; }
  void step(const StepInput&) override {}
  Posterior posterior() const override { return {status, mean, covariance, innovation, covariance}; }

 private:
  std::array<double, 2> mean{40.0, 0.3}, innovation{};
  std::array<double, 4> covariance{1.0, 0.0, 0.0, 0.01};
};

TEST(Hierarchical, TheFirstLevelsStatusGoesThrough) {
  Belief<LongitudinalFriction> belief;
  belief.model = scale_car();
  belief.noise = {{{0.0, 0.5}, {0.0, 0.3}}};
  belief.initial_variance = {1.0, 0.02, 0.01};
  Belief<WheelFriction> first{WheelFriction{belief.model.wheel}, belief.noise};
  for (const EstimateStatus status : {EstimateStatus::kValid, EstimateStatus::kFallback, EstimateStatus::kInvalid}) {
    auto stub = std::make_unique<Stub>();
    stub->status = status;
    Hierarchical observer(belief, first, std::move(stub));
    observer.start_given();
    const std::array<double, 1> u{kTorque_nm};
    const std::array<double, 2> z{40.0, 3.0};
    observer.step({kDt, u, z, 3U});
    EXPECT_EQ(observer.posterior().status, status);
  }
}

TEST(Hierarchical, AMeasurementThatIsNotANumberMakesTheEstimateInvalid) {
  const std::unique_ptr<Estimator> observer = make_estimator("hierarchical_ekf", scenario_of(scale_car()), "test");
  observer->start_given();
  const std::array<double, 1> u{kTorque_nm};
  const std::array<double, 2> z{std::numeric_limits<double>::quiet_NaN(), 1.0};
  observer->step({0.0, u, z, 3U});
  EXPECT_EQ(observer->posterior().status, EstimateStatus::kInvalid);
}

TEST(Hierarchical, AnotherModelIsRefused) {
  try {
    make_estimator("hierarchical_mhe", scenario_of(WheelFriction{}), "test");
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(),
                 "hierarchical_mhe: works on model longitudinal_friction only; the scenario's is wheel_friction");
  }
}

// The document's tuning of section 5.2: R = diag(1e4, 1e4) and per-step Q for the EKF; N = 4, S = diag(1e4, 1e5) and
// V = diag(1e4, 1e8) for the moving horizon.
TEST(Hierarchical, TheDocumentsTuningOfSection52CanBeSaid) {
  Scenario s = scenario_of(scale_car());
  Tuning t;
  t.measurement_noise = "given";
  t.measurement_variance = {{"wheel_speed_radps", 1e4}, {"a_x_mps2", 1e4}};
  t.process_noise = "step";
  t.process_variance = {{"wheel_speed_radps", 1e3}, {"speed_mps", 0.0}, {"friction", 1e3}};
  t.initial_mean = {{"wheel_speed_radps", 1.0}, {"speed_mps", 0.033}, {"friction", 0.5}};
  t.initial_variance = {{"wheel_speed_radps", 1e3}, {"speed_mps", 1e-4}, {"friction", 1e4}};
  t.mhe_form = "single_shooting";
  t.arrival_weight = {{"wheel_speed_radps", 1e4}, {"friction", 1e5}};
  t.measurement_weight = {{"wheel_speed_radps", 1e4}, {"a_x_mps2", 1e8}};
  s.estimator.tunings = {{"document", t}};
  const std::array<double, 1> u{kTorque_nm};
  for (const char* algorithm : {"hierarchical_ekf", "hierarchical_mhe"}) {
    const std::unique_ptr<Estimator> observer = make_estimator(algorithm, s, "document");
    observer->start_given();
    State x(1.0, 0.033, 0.5);
    double largest = 0.0, variance_before = 0.0;
    for (int k = 0; k <= 200; ++k) {
      if (k > 0) x = after(scale_car().wheel.quarter, false, x);
      const std::array<double, 2> z{x[0], 9.81 * x[2]};
      observer->step({k == 0 ? 0.0 : kDt, u, z, 3U});
      const Posterior p = observer->posterior();
      ASSERT_EQ(p.status, EstimateStatus::kValid) << algorithm << k;
      largest = std::max(largest, std::abs(p.mean[1] - x[1]));
      const Eigen::Matrix3d covariance = Eigen::Map<const Eigen::Matrix3d>(p.covariance.data());
      EXPECT_GT(covariance.determinant(), 0.0) << algorithm << k;
      EXPECT_GT(covariance(1, 1), variance_before) << algorithm << k;  // nothing measures v
      variance_before = covariance(1, 1);
    }
    EXPECT_LT(largest, 1e-6) << algorithm;  // without noise it is the solver's tolerance, integrated over 2 s
  }
}

// The same states and the same measurements as a filter of wheel_friction alone: its R2, to the last bit.
TEST(Hierarchical, OnTheUnimogItIsTheTwoStateFilterWithASpeed) {
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/unimog.toml").scenario;
  auto model = std::get<LongitudinalFriction>(scenario.estimator.process);
  model.drag = false;
  scenario.estimator.process = model;
  const Played three = play(scenario, "hierarchical_ekf", "matched");
  scenario.estimator.process = WheelFriction{model.wheel};
  const Played two = play(scenario, "ekf", "matched");
  EXPECT_EQ(three.estimate_of(0), two.estimate_of(0));
  EXPECT_EQ(three.estimate_of(2), two.estimate_of(1));
  EXPECT_EQ(three.nis(), two.nis());
}

TEST(Hierarchical, OnTheUnimogTheSpeedIsGood) {
  for (const char* file : {"/scenarios/unimog.toml", "/scenarios/unimog_10.toml"}) {
    Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + file).scenario;
    std::vector<double> w, v, mu;
    for (scenario.run.seed = 1; scenario.run.seed <= 20; ++scenario.run.seed) {
      const Played played = play(scenario, "hierarchical_ekf", "matched");
      EXPECT_EQ(played.fallbacks(), 0U);
      w.push_back(score_state(played.truth_of("wheel_speed_radps"), played.estimate_of(0)).r2);
      v.push_back(score_state(played.truth_of("speed_mps"), played.estimate_of(1)).r2);
      mu.push_back(score_state(played.truth_of("friction"), played.estimate_of(2)).r2);
    }
    std::printf("%s: hierarchical EKF, R2 w %.6f v %.7f mu %.6f\n", file, median(w), median(v), median(mu));
    EXPECT_GE(median(v), 0.999);   // published for the scale car: document 002, Table 7
    EXPECT_GE(median(mu), 0.982);  // the bar of the bench for the EKF at 10 %
  }
}

}  // namespace
}  // namespace slipstream::test
