// The unscented filters: the Kalman filter where the model is linear, closed-form moments where it is quadratic, one another
// everywhere; consistent, not worse than the EKF, and sound where things go wrong.
#include "estimators/ukf.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/chi_square.hpp"
#include "common/random.hpp"
#include "estimators/ekf.hpp"
#include "estimators/follower.hpp"
#include "estimators/sqrt_ukf.hpp"
#include "io/scenario_reader.hpp"
#include "tests/estimators/linear_model.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

template <ProcessModel M, template <int> class Spread>
Unscented<M, Spread> unscented(const Belief<M>& b, double alpha, double beta, double kappa, bool redraw = true) {
  return {b, sigma_points(M::kStates, "states", alpha, beta, kappa), redraw};
}

// Mean and covariance within `tolerance`.
void expect_same(const Estimator& a, const Estimator& b, double tolerance, const std::string& where) {
  const Posterior p = a.posterior(), q = b.posterior();
  ASSERT_EQ(p.status, EstimateStatus::kValid) << where;
  for (std::size_t i = 0; i < p.mean.size(); ++i) ASSERT_NEAR(p.mean[i], q.mean[i], tolerance) << where << " mean " << i;
  for (std::size_t i = 0; i < p.covariance.size(); ++i)
    ASSERT_NEAR(p.covariance[i], q.covariance[i], tolerance) << where << " covariance " << i;
  for (std::size_t i = 0; i < p.innovation.size(); ++i) ASSERT_NEAR(p.innovation[i], q.innovation[i], tolerance) << where;
  for (std::size_t i = 0; i < p.innovation_covariance.size(); ++i)
    ASSERT_NEAR(p.innovation_covariance[i], q.innovation_covariance[i], tolerance) << where;
}

// --- Linear models --------------------------------------------------------------------------------------------------------

struct Form {
  double alpha, beta, kappa;
};
class LinearUkf : public testing::TestWithParam<Form> {};

// The EKF is the Kalman filter on a linear model: kalman_test.cpp.
template <ProcessModel M>
void expect_kalman(const Belief<M>& b, const Form& f) {
  Ekf<M> kalman(b);
  auto ukf = unscented<M, SquaredSpread>(b, f.alpha, f.beta, f.kappa);
  auto root = unscented<M, RootSpread>(b, f.alpha, f.beta, f.kappa);
  for (Estimator* e : {static_cast<Estimator*>(&kalman), static_cast<Estimator*>(&ukf), static_cast<Estimator*>(&root)})
    e->start_given();
  RandomStream random(7, 0, "linear");
  for (int k = 0; k < 400; ++k) {
    const std::uint32_t measured = k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U;
    const std::array<double, 2> z{0.3 * random.normal(), 0.2 * random.normal()};
    const std::array<double, 2> u{std::sin(0.3 * k), std::cos(0.2 * k)};
    const double dt_s = k == 0 || k % 13 == 5 ? 0.0 : 0.02 * (1 + k % 7);
    const StepInput step{dt_s, {u.data(), static_cast<std::size_t>(M::kInputs)}, z, measured};
    for (Estimator* e : {static_cast<Estimator*>(&kalman), static_cast<Estimator*>(&ukf), static_cast<Estimator*>(&root)})
      e->step(step);
    // Rounding of numbers near 1, which the weights of the curvature make 1/(2 r^2) as large: 1e6 where alpha is 1e-3.
    const double tolerance = 1e-10 + 1e-15 / (f.alpha * f.alpha);
    expect_same(ukf, kalman, tolerance, "ukf, step " + std::to_string(k));
    expect_same(root, kalman, tolerance, "sqrt_ukf, step " + std::to_string(k));
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST_P(LinearUkf, IsTheKalmanFilter) {
  Belief<LinearModel> line;
  line.noise = {{{0.0, 0.3}, {0.0, 0.2}}};
  line.process_variance = {1e-3, 2e-2};
  line.initial_mean = {0.5, -0.2};
  line.initial_variance = {0.4, 0.9};
  expect_kalman(line, GetParam());
  Belief<PlaneModel> plane;
  plane.noise = {{{0.05, 0.3}, {0.1, 0.2}}};  // with a share in per cent of the value
  plane.process_variance = {1e-3, 1e-3, 1e-2, 2e-2};
  plane.initial_mean = {0.5, -0.2, 0.1, 0.3};
  plane.initial_variance = {0.4, 0.9, 0.5, 0.2};
  expect_kalman(plane, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Forms, LinearUkf,
                         testing::Values(Form{1.0, 2.0, 0.0}, Form{0.5, 2.0, 0.0}, Form{0.1, 2.0, 1.0}, Form{1.0, 0.0, -1.0},
                                         Form{1e-3, 2.0, 0.0}, Form{2.0, 2.0, 0.0}));

// x+ = x + w, z = x + v: by hand. The points that are used again lack Q: S = P + R, but P keeps it.
TEST(Ukf, UsedAgainThePointsLackTheProcessNoise) {
  Belief<LinearModel> b;
  b.model.c = 0.0;
  b.noise = {{{0.0, 0.5}, {0.0, 0.5}}};
  b.process_per_step = true;
  b.process_variance = {0.0, 0.3};
  b.initial_variance = {1e-6, 0.8};
  auto ukf = unscented<LinearModel, SquaredSpread>(b, 1.0, 2.0, 0.0, false);
  auto root = unscented<LinearModel, RootSpread>(b, 1.0, 2.0, 0.0, false);
  const double P = 0.8, R = 0.25, Q = 0.3, K = P / (P + R);
  for (Estimator* e : {static_cast<Estimator*>(&ukf), static_cast<Estimator*>(&root)}) {
    e->start_given();
    const std::array<double, 1> u{0.0};
    const std::array<double, 2> z{0.0, 1.5};
    e->step({1e-9, u, z, 2U});                                          // so short that nothing moves
    EXPECT_NEAR(e->posterior().innovation_covariance[3], P + R, 1e-9);  // the time that passes
    EXPECT_NEAR(e->posterior().mean[1], K * 1.5, 1e-9);
    EXPECT_NEAR(e->posterior().covariance[3], (1.0 - K) * (1.0 - K) * P + K * K * R + Q, 1e-9);
  }
}

// --- Quadratic outputs ----------------------------------------------------------------------------------------------------

// z = x' A x + b' x of a state that stands still.
template <int N>
struct Quadratic {
  static constexpr std::string_view kName = "quadratic";
  static constexpr int kStates = N, kInputs = 1, kOutputs = 1;
  static constexpr std::array<Quantity, N> kStateNames{};
  static constexpr std::array<bool, N> kLinear{};
  static constexpr std::array<Quantity, 1> kInputNames{{{"u", "1"}}};
  static constexpr std::array<Quantity, 1> kOutputNames{{{"z", "1"}}};
  Matrix<double, N> a = Matrix<double, N>::Identity();
  Vector<double, N> b = Vector<double, N>::Zero();

  template <typename T>
  Vector<T, N> derivative(const Vector<T, N>&, const Vector<double, 1>&) const {
    Vector<T, N> still;
    for (int i = 0; i < N; ++i) still[i] = T(0.0);
    return still;
  }
  template <typename T>
  Vector<T, 1> output(const Vector<T, N>& x, const Vector<double, 1>&) const {
    T z = T(0.0);
    for (int i = 0; i < N; ++i) {
      z = z + b[i] * x[i];
      for (int j = 0; j < N; ++j) z = z + a(i, j) * x[i] * x[j];
    }
    Vector<T, 1> out;
    out[0] = z;
    return out;
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, N>&) const {
    return 0.0;
  }
  bool start_from(int, double, Vector<double, N>&) const { return false; }
};

constexpr double kR = 0.01;

// What is believed of z before it is measured: its mean, and its variance without R.
template <template <int> class Spread, int N>
Eigen::Vector2d predicted(const Quadratic<N>& model, const Vector<double, N>& x, const Vector<double, N>& variance,
                          const Form& f) {
  Belief<Quadratic<N>> b;
  b.model = model;
  b.noise = {{{0.0, std::sqrt(kR)}}};
  b.initial_mean = x;
  b.initial_variance = variance;
  auto e = unscented<Quadratic<N>, Spread>(b, f.alpha, f.beta, f.kappa);
  e.start_given();
  const std::array<double, 1> u{0.0}, z{0.0};
  e.step({0.0, u, z, 1U});
  return {-e.posterior().innovation[0], e.posterior().innovation_covariance[0] - kR};
}

template <template <int> class Spread>
void expect_moments() {
  // E[x^2] = m^2 + P and var x^2 = 4 m^2 P + 2 P^2 of a normal x, both exact with beta = 2 and kappa = 0.
  const double m = 0.7, P = 0.4;
  for (const double alpha : {1.0, 0.3, 1e-2}) {
    const Eigen::Vector2d scalar =
        predicted<Spread>(Quadratic<1>{}, Vector<double, 1>(m), Vector<double, 1>(P), {alpha, 2.0, 0.0});
    const double tolerance = 1e-15 / (alpha * alpha) + 1e-14;  // rounding over the weights
    EXPECT_NEAR(scalar[0], m * m + P, tolerance) << alpha;
    EXPECT_NEAR(scalar[1], 4.0 * m * m * P + 2.0 * P * P, 4.0 * tolerance) << alpha;
  }
  // E[x' A x + b' x] = m' A m + tr(A P) + b' m, for any alpha, beta and kappa; three states fill their packs up, four do not.
  const auto mean_of = [&]<int N>(const Form& f) {
    Quadratic<N> q;
    Vector<double, N> x, variance;
    for (int i = 0; i < N; ++i) {
      q.b[i] = 0.5 - i;
      x[i] = 0.3 * i - 0.2;
      variance[i] = 0.1 + 0.2 * i;
      for (int j = 0; j < N; ++j) q.a(i, j) = 1.0 / (1 + i + 2 * j);
    }
    const double exact = x.dot(q.a * x) + (q.a * variance.asDiagonal()).trace() + q.b.dot(x);
    EXPECT_NEAR((predicted<Spread>(q, x, variance, f)[0]), exact, 1e-12) << N;  // rounding over the weights, alpha >= 0.1
  };
  for (const Form f : {Form{1.0, 2.0, 0.0}, Form{0.1, 0.5, 2.0}, Form{1.5, 3.0, -0.5}}) {
    mean_of.template operator()<3>(f);
    mean_of.template operator()<4>(f);
    mean_of.template operator()<5>(f);
  }
}
TEST(Ukf, MomentsOfAQuadraticFunctionAreExact) { expect_moments<SquaredSpread>(); }
TEST(SqrtUkf, MomentsOfAQuadraticFunctionAreExact) { expect_moments<RootSpread>(); }

// P = 1 at x = 0: z+- = r^2, so S = r^2 P^2 + (beta - alpha^2) P^2 + R, which is alpha^2 kappa + beta + R: made negative.
template <template <int> class Spread>
void expect_the_fallback() {
  Belief<Quadratic<1>> b;
  b.noise = {{{0.0, std::sqrt(kR)}}};
  b.initial_variance[0] = 1.0;
  auto e = unscented<Quadratic<1>, Spread>(b, 2.0, 0.0, -0.5);  // r^2 = 2, c = 1, the sum of squares 2, of the middle -4
  e.start_given();
  const std::array<double, 1> u{0.0}, z{0.3};
  e.step({0.0, u, z, 1U});
  const Posterior p = e.posterior();
  EXPECT_EQ(p.status, EstimateStatus::kFallback);
  EXPECT_NEAR(p.innovation_covariance[0], 2.0 + kR, 1e-14);  // rounding
  EXPECT_NEAR(p.covariance[0], 1.0, 1e-14);                  // z is even in x and says nothing of it
  EXPECT_NEAR(p.mean[0], 0.0, 1e-14);
}
TEST(Ukf, ACovarianceThatWouldBeIndefiniteLeavesTheMiddlesTermOut) { expect_the_fallback<SquaredSpread>(); }
TEST(SqrtUkf, ACovarianceThatWouldBeIndefiniteLeavesTheMiddlesTermOut) { expect_the_fallback<RootSpread>(); }

// --- Square root ----------------------------------------------------------------------------------------------------------

TEST(SqrtUkf, FactorIsThatOfTheSumWithUpdatesAndDowndates) {
  RandomStream random(3, 0, "factor");
  for (const double g : {0.7, 0.0, -0.05}) {
    Matrix<double, 5> expected = Matrix<double, 5>::Zero();
    RowPacks<5, 3> rows;
    Matrix<double, 5, 12> dense;
    Vector<double, 5> v, c;
    for (int i = 0; i < 5; ++i) {
      for (int k = 0; k < 12; ++k) dense(i, k) = random.normal();
      for (int p = 0; p < 3; ++p)
        rows.at[i][p] = Pack(dense(i, 4 * p), dense(i, 4 * p + 1), dense(i, 4 * p + 2), dense(i, 4 * p + 3));
      v[i] = 0.1 * (i + 1);
      c[i] = random.normal();
    }
    expected = dense * dense.transpose() + g * c * c.transpose();
    expected.diagonal() += v;
    RootSpread<5> spread;
    EXPECT_TRUE(spread.assign(rows, v, g, c));
    Matrix<double, 5> p;
    spread.covariance_into(p);
    EXPECT_LT((p - expected).cwiseAbs().maxCoeff(), 1e-12);  // rounding of numbers near 20
    EXPECT_FALSE(spread.assign(rows, v, -1e3, c));           // far beyond what is there
    spread.covariance_into(p);
    expected -= g * c * c.transpose();
    EXPECT_LT((p - expected).cwiseAbs().maxCoeff(), 1e-12);
  }
}

// Almost perfect sensors, and a state known a million times worse than the other: half the digits of a covariance are gone.
TEST(SqrtUkf, CovarianceStaysPositiveWhereItsConditionIsExtreme) {
  Belief<PlaneModel> b;
  b.noise = {{{0.0, 1e-7}, {0.0, 1e-7}}};
  b.process_variance = {1e-12, 1e-12, 1e-6, 1e-6};
  b.initial_variance = {1e6, 1e6, 1e3, 1e3};
  auto ukf = unscented<PlaneModel, SquaredSpread>(b, 1.0, 2.0, 0.0);
  auto root = unscented<PlaneModel, RootSpread>(b, 1.0, 2.0, 0.0);
  for (Estimator* e : {static_cast<Estimator*>(&ukf), static_cast<Estimator*>(&root)}) {
    e->start_given();
    const std::array<double, 2> u{0.0, 0.0};
    for (int k = 0; k < 500; ++k) {
      const std::array<double, 2> z{1e-3 * k, -1e-3 * k};
      e->step({k == 0 ? 0.0 : 0.01, u, z, 3U});
      const Eigen::Map<const Eigen::Matrix4d> p(e->posterior().covariance.data());
      ASSERT_EQ(e->posterior().status, EstimateStatus::kValid) << k;
      ASSERT_EQ((p - p.transpose()).cwiseAbs().maxCoeff(), 0.0) << k;
      ASSERT_EQ(Eigen::Matrix4d(p).llt().info(), Eigen::Success) << k;
    }
    EXPECT_NEAR(e->posterior().mean[2], 0.1, 1e-3);  // 1 mm every 10 ms, and what 1e-3 (m/s)/sqrt(s) lets it wander
  }
}

// --- The shipped scenarios ------------------------------------------------------------------------------------------------

Scenario shipped(const std::string& name) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml").scenario;
}

class ShippedUkf : public testing::TestWithParam<const char*> {};

TEST_P(ShippedUkf, BothFormsAreOneFilterNearTheEkf) {
  Scenario scenario = shipped(GetParam());
  scenario.run.duration_s = std::min(scenario.run.duration_s, 6.0);
  const Played ukf = play(scenario, "ukf", "matched"), root = play(scenario, "sqrt_ukf", "matched"),
               ekf = play(scenario, "ekf", "matched");
  ASSERT_EQ(ukf.estimates.size(), ekf.estimates.size());
  ASSERT_GT(ukf.estimates.size(), 90U);
  EXPECT_EQ(ukf.fallbacks(), 0U);
  EXPECT_EQ(root.fallbacks(), 0U);
  const std::size_t n = ukf.estimates[0].mean.size();
  for (std::size_t k = 0; k < ukf.estimates.size(); ++k)
    for (std::size_t i = 0; i < n; ++i) {
      const double sigma = std::sqrt(ukf.estimates[k].covariance[i * n + i]);
      // Rounding of a few thousand operations, and what the sizes of the states beside each other make of it.
      ASSERT_NEAR(root.estimates[k].mean[i], ukf.estimates[k].mean[i], 1e-7 * sigma) << k << " " << i;
      ASSERT_NEAR(std::sqrt(root.estimates[k].covariance[i * n + i]), sigma, 1e-7 * sigma) << k << " " << i;
      // The same belief to second order: they may be apart by a share of what they admit not to know.
      ASSERT_NEAR(ekf.estimates[k].mean[i], ukf.estimates[k].mean[i], 1.0 * sigma) << k << " " << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Scenarios, ShippedUkf, testing::Values("unimog", "unimog_pf", "circle", "snow_step", "point_mass"));

TEST(Ukf, FrictionOfTheUnimogIsAsGoodAsTheEkfs) {
  Scenario scenario = shipped("unimog");
  std::array<std::vector<double>, 3> r2;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    scenario.run.seed = seed;
    std::size_t k = 0;
    for (const char* algorithm : {"ekf", "ukf", "sqrt_ukf"}) {
      const Played played = play(scenario, algorithm, "matched");
      r2[k++].push_back(score_state(played.truth_of("friction"), played.estimate_of(2)).r2);
    }
  }
  EXPECT_GE(median(r2[1]), median(r2[0]) - 0.002);  // the bar
  EXPECT_GE(median(r2[2]), median(r2[0]) - 0.002);
}

// The mean over runs of the squared error that each calls normal: chi-square over the number of runs.
TEST(Ukf, ErrorsAreAsLargeAsItBelieves) {
  constexpr int kRuns = 60;
  Scenario scenario = shipped("point_mass");
  std::map<std::size_t, double> sum;  // of the steps looked at
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    scenario.run.seed = seed;
    const Played played = play(scenario, "ukf", "matched");
    for (const std::size_t k : {10U, 50U, 100U}) {
      std::array<double, 4> error;
      const Estimate& e = played.estimates.at(k);
      for (std::size_t i = 0; i < 4; ++i)
        error[i] = e.mean[i] - played.truth_of(std::string(PointMassMotion::kStateNames[i].name)).at(k);
      sum[k] += normalised_square(error, e.covariance);
    }
  }
  for (const auto& [k, nees] : sum) {
    EXPECT_GT(nees, chi_square_quantile(0.001, 4 * kRuns)) << k;  // the seeds are fixed: 1 in 500 would fall outside
    EXPECT_LT(nees, chi_square_quantile(0.999, 4 * kRuns)) << k;
  }
}

// --- Where things go wrong ------------------------------------------------------------------------------------------------

Belief<LongitudinalFriction> stalled() {
  Belief<LongitudinalFriction> b;
  b.noise = {{{0.05, 1e-3}, {0.05, 1e-3}}};
  b.process_variance = {1e-3, 1e-8, 5e-4};
  b.initial_variance = {0.01, 0.001, 0.04};
  return b;
}

template <template <int> class Spread>
void expect_a_start_from_rest() {
  auto e = unscented<LongitudinalFriction, Spread>(stalled(), 1.0, 2.0, 0.0);
  e.start_given();
  for (int k = 0; k < 300; ++k) {
    const std::array<double, 1> u{0.0};
    const std::array<double, 2> z{0.0, 0.0};
    e.step({k % 50 == 49 ? 0.5 : 0.01, u, z, k % 10 == 0 ? 0U : 3U});
    ASSERT_EQ(e.posterior().status, EstimateStatus::kValid) << k;
  }
  EXPECT_NEAR(e.posterior().mean[0], 0.0, 3.0 * std::sqrt(e.posterior().covariance[0]));
  EXPECT_NEAR(e.posterior().mean[2], 0.0, 3.0 * std::sqrt(e.posterior().covariance[8]));
}
TEST(Ukf, AStalledStartStaysFinite) { expect_a_start_from_rest<SquaredSpread>(); }
TEST(SqrtUkf, AStalledStartStaysFinite) { expect_a_start_from_rest<RootSpread>(); }

template <template <int> class Spread>
void expect_invalid() {
  const double nan = std::numeric_limits<double>::quiet_NaN(), huge = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, huge}) {
    auto e = unscented<LongitudinalFriction, Spread>(stalled(), 1.0, 2.0, 0.0);
    e.start_given();
    const std::array<double, 1> u{100.0};
    const std::array<double, 2> z{bad, 1.0}, sound{0.1, 0.1};
    e.step({0.0, u, z, 2U});  // not read
    EXPECT_EQ(e.posterior().status, EstimateStatus::kValid);
    e.step({0.01, u, z, 3U});
    EXPECT_EQ(e.posterior().status, EstimateStatus::kInvalid);
    e.step({0.01, u, sound, 3U});  // what is lost stays lost until a new start
    EXPECT_EQ(e.posterior().status, EstimateStatus::kInvalid);
    ASSERT_TRUE(e.start_measured(0, 0.5));
    e.step({0.01, u, sound, 3U});
    EXPECT_EQ(e.posterior().status, EstimateStatus::kValid);
    const std::array<double, 1> bad_input{bad};
    e.step({0.01, bad_input, sound, 3U});
    EXPECT_EQ(e.posterior().status, EstimateStatus::kInvalid);
  }
}
TEST(Ukf, WhatIsNotANumberMakesTheEstimateInvalid) { expect_invalid<SquaredSpread>(); }
TEST(SqrtUkf, WhatIsNotANumberMakesTheEstimateInvalid) { expect_invalid<RootSpread>(); }

TEST(Ukf, PointsThatCannotBeDrawnAreRefused) {
  Scenario scenario = shipped("point_mass");
  scenario.estimator.tunings["matched"].ukf_kappa = -4.0;
  for (const char* algorithm : {"ukf", "sqrt_ukf"}) {
    try {
      make_estimator(algorithm, scenario, "matched");
      FAIL() << "not refused";
    } catch (const Refusal& refusal) {
      EXPECT_STREQ(refusal.what(), "ukf_kappa = -4 must be more than -4, the number of states");
    }
  }
}

TEST(Ukf, TheNameWorksOnBothKindsOfModels) {
  EXPECT_EQ(make_estimator("ukf", shipped("point_mass"), "matched")->names().model, "point_mass_motion");
  const std::vector<std::string> names = algorithm_names();
  EXPECT_EQ(std::count(names.begin(), names.end(), "ukf"), 1);
  const Scenario city = shipped("city");
  EXPECT_NE(make_follower("ukf", "test", 1, city, city.estimator.tuning, {}), nullptr);
  try {
    make_follower("sqrt_ukf", "test", 1, city, city.estimator.tuning, {});
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(
        refusal.what(),
        "algorithm 'sqrt_ukf' does not work on the model of scenario 'city' ('strapdown'); expected one of: es_ekf, ukf");
  }
}

}  // namespace
}  // namespace slipstream::test
