// The Gaussian algorithms against an independent Kalman filter and an independent batch least-squares solution.
#include <gtest/gtest.h>

#include <memory>

#include "common/random.hpp"
#include "estimators/ekf.hpp"
#include "estimators/mhe.hpp"
#include "tests/estimators/linear_model.hpp"

namespace slipstream::test {
namespace {

constexpr double kDt = 0.1;

// x+ = A x + B u of x' = F x + G u over dt, by the Taylor series to fourth order that RK4 reproduces on a linear model.
struct Discrete {
  Eigen::Matrix2d a;
  Eigen::Vector2d b;
};
Discrete discretise(double c, double dt) {
  Eigen::Matrix2d f;
  f << 0, 1, 0, -c;
  const Eigen::Vector2d g(0, 1);
  Eigen::Matrix2d term = Eigen::Matrix2d::Identity(), a = term, integral = Eigen::Matrix2d::Zero();
  for (int k = 1; k <= 4; ++k) {
    integral += term * (dt / k);
    term = f * term * (dt / k);
    a += term;
  }
  return {a, integral * g};
}

Belief<LinearModel> linear_belief() {
  Belief<LinearModel> b;
  b.noise = {{{0.0, 0.3}, {0.0, 0.2}}};
  b.process_variance = {1e-3, 2e-2};
  b.initial_mean = {0.5, -0.2};
  b.initial_variance = {0.4, 0.9};
  return b;
}

struct Sample {
  double u;
  std::array<double, 2> z;
  std::uint32_t measured;
};
// Every combination of measured outputs occurs, none among them.
std::vector<Sample> record(int count) {
  RandomStream random(7, 0, "linear");
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) {
    const std::uint32_t measured = k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U;
    samples.push_back({std::sin(0.3 * k), {0.1 * k + 0.3 * random.normal(), 1.0 + 0.2 * random.normal()}, measured});
  }
  return samples;
}

void step(Estimator& e, const Sample& s, bool first) { e.step({first ? 0.0 : kDt, {&s.u, 1}, s.z, s.measured}); }

// The textbook filter, in its plain form, written apart from the code under test.
struct TextbookFilter {
  Eigen::Vector2d x;
  Eigen::Matrix2d p;
  void step(const Sample& s, bool first, const Belief<LinearModel>& b) {
    if (!first) {
      const Discrete d = discretise(b.model.c, kDt);
      x = d.a * x + d.b * s.u;
      p = d.a * p * d.a.transpose();
      p(0, 0) += b.process_variance[0] * kDt;
      p(1, 1) += b.process_variance[1] * kDt;
    }
    for (int i = 0; i < 2; ++i) {
      if ((s.measured >> i & 1U) == 0U) continue;
      const double r = b.noise[static_cast<std::size_t>(i)].absolute * b.noise[static_cast<std::size_t>(i)].absolute;
      const Eigen::Vector2d gain = p.col(i) / (p(i, i) + r);
      x += gain * (s.z[static_cast<std::size_t>(i)] - x[i]);
      p = (p - gain * p.row(i)).eval();
    }
  }
};

void expect_same(const Estimator& e, const TextbookFilter& reference, double tolerance, int k) {
  const Posterior p = e.posterior();
  ASSERT_EQ(p.status, EstimateStatus::kValid) << k;
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(p.mean[i], reference.x[static_cast<int>(i)], tolerance) << k;
    for (std::size_t j = 0; j < 2; ++j)
      EXPECT_NEAR(p.covariance[2 * i + j], reference.p(static_cast<int>(i), static_cast<int>(j)), tolerance) << k;
  }
}

TEST(Kalman, EkfIsTheKalmanFilterOnALinearModel) {
  const Belief<LinearModel> b = linear_belief();
  Ekf<LinearModel> ekf(b);
  ekf.start_given();
  TextbookFilter reference{b.initial_mean, b.initial_variance.asDiagonal()};
  int k = 0;
  for (const Sample& s : record(200)) {
    step(ekf, s, k == 0);
    reference.step(s, k == 0, b);
    expect_same(ekf, reference, 1e-10, k++);  // rounding of some thousand operations on numbers near 20
  }
}

TEST(Kalman, MheWithThePosteriorAsArrivalCostIsTheKalmanFilterOnALinearModel) {
  const Belief<LinearModel> b = linear_belief();
  for (const int window : {1, 4, 20}) {
    Mhe<LinearModel> mhe(b, window);
    mhe.start_given();
    TextbookFilter reference{b.initial_mean, b.initial_variance.asDiagonal()};
    int k = 0;
    for (const Sample& s : record(60)) {
      step(mhe, s, k == 0);
      reference.step(s, k == 0, b);
      expect_same(mhe, reference, 1e-6, k++);  // the bar: agreement with the exact solution of the window
    }
  }
}

// The whole record as one dense weighted least-squares problem in all states and solved by QR: the last state is the exact
// solution of a window that never slides.
TEST(Kalman, AWindowAsLongAsTheRecordSolvesTheBatchProblem) {
  const Belief<LinearModel> b = linear_belief();
  const std::vector<Sample> samples = record(30);
  const int n = static_cast<int>(samples.size());
  const Discrete d = discretise(b.model.c, kDt);
  std::vector<Eigen::RowVectorXd> rows;
  std::vector<double> right;
  const auto add = [&](const Eigen::RowVectorXd& row, double value, double sigma) {
    rows.push_back(row / sigma);
    right.push_back(value / sigma);
  };
  for (int i = 0; i < 2; ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * n);
    row[i] = 1.0;
    add(row, b.initial_mean[i], std::sqrt(b.initial_variance[i]));
  }
  for (int k = 0; k < n; ++k) {
    const Sample& s = samples[static_cast<std::size_t>(k)];
    for (int i = 0; i < 2; ++i) {
      if ((s.measured >> i & 1U) != 0U) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * n);
        row[2 * k + i] = 1.0;
        add(row, s.z[static_cast<std::size_t>(i)], b.noise[static_cast<std::size_t>(i)].absolute);
      }
      if (k == 0) continue;
      Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(2 * n);
      row[2 * k + i] = 1.0;
      row[2 * k - 2] = -d.a(i, 0);
      row[2 * k - 1] = -d.a(i, 1);
      add(row, d.b[i] * s.u, std::sqrt(b.process_variance[i] * kDt));
    }
  }
  Eigen::MatrixXd a(rows.size(), 2 * n);
  for (std::size_t r = 0; r < rows.size(); ++r) a.row(static_cast<Eigen::Index>(r)) = rows[r];
  const Eigen::VectorXd x =
      a.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(right.data(), static_cast<Eigen::Index>(right.size())));

  Mhe<LinearModel> mhe(b, n);
  mhe.start_given();
  for (int k = 0; k < n; ++k) step(mhe, samples[static_cast<std::size_t>(k)], k == 0);
  EXPECT_NEAR(mhe.posterior().mean[0], x[2 * n - 2], 1e-6);  // the bar: better than 1e-6
  EXPECT_NEAR(mhe.posterior().mean[1], x[2 * n - 1], 1e-6);
}

// Single shooting on a linear model: normal equations in x_0, formed by superposition.
TEST(Kalman, SingleShootingSolvesItsNormalEquations) {
  Belief<LinearModel> b = linear_belief();
  const Eigen::Vector2d arrival_weight(3.0, 5.0);
  constexpr int kWindow = 4;
  MheSingleShooting<LinearModel> mhe(b, kWindow, arrival_weight);
  mhe.start_given();
  const std::vector<Sample> samples = record(12);
  const Discrete d = discretise(b.model.c, kDt);
  Eigen::Vector2d arrival = b.initial_mean;
  for (int k = 0; k < 12; ++k) {
    step(mhe, samples[static_cast<std::size_t>(k)], k == 0);
    const int oldest = std::max(0, k - kWindow);
    Eigen::Matrix2d information = arrival_weight.asDiagonal();
    Eigen::Vector2d right = arrival_weight.asDiagonal() * arrival;
    Eigen::Matrix2d phi = Eigen::Matrix2d::Identity();
    Eigen::Vector2d driven = Eigen::Vector2d::Zero();  // the state that x_0 = 0 leads to
    for (int i = oldest; i <= k; ++i) {
      const Sample& s = samples[static_cast<std::size_t>(i)];
      if (i > oldest) {
        phi = (d.a * phi).eval();
        driven = (d.a * driven + d.b * s.u).eval();
      }
      for (int j = 0; j < 2; ++j) {
        if ((s.measured >> j & 1U) == 0U) continue;
        const double v = 1.0 / std::pow(b.noise[static_cast<std::size_t>(j)].absolute, 2);
        information += v * phi.row(j).transpose() * phi.row(j);
        right += v * phi.row(j).transpose() * (s.z[static_cast<std::size_t>(j)] - driven[j]);
      }
    }
    const Eigen::Vector2d x0 = information.ldlt().solve(right);
    const Eigen::Vector2d newest = phi * x0 + driven;
    EXPECT_NEAR(mhe.posterior().mean[0], newest[0], 1e-6) << k;  // the bar: better than 1e-6
    EXPECT_NEAR(mhe.posterior().mean[1], newest[1], 1e-6) << k;
    // x+ of the next window, once this one is full.
    if (k >= kWindow) arrival = d.a * x0 + d.b * samples[static_cast<std::size_t>(oldest + 1)].u;
  }
}

TEST(Kalman, BoundsHoldAndBindTheMhe) {
  Belief<LinearModel> b = linear_belief();
  b.upper = {100.0, 0.9};  // below the speed that is measured, 1.0
  Mhe<LinearModel> mhe(b, 4);
  mhe.start_given();
  int k = 0, at_bound = 0;
  for (const Sample& s : record(60)) {
    step(mhe, s, k++ == 0);
    EXPECT_LE(mhe.posterior().mean[1], 0.9 + 1e-6);  // the solver's tolerance
    at_bound += mhe.posterior().mean[1] > 0.9 - 1e-3 ? 1 : 0;
    EXPECT_EQ(mhe.posterior().status, EstimateStatus::kValid);
  }
  EXPECT_GT(at_bound, 5);  // else this test would show nothing
}

TEST(Kalman, CovarianceStaysSymmetricAndPositive) {
  Belief<LinearModel> b = linear_belief();
  b.noise = {{{0.0, 1e-7}, {0.0, 1e-7}}};  // almost perfect sensors: where the plain form of the update loses positivity
  Ekf<LinearModel> ekf(b);
  ekf.start_given();
  int k = 0;
  for (const Sample& s : record(500)) {
    step(ekf, s, k++ == 0);
    const Eigen::Map<const Eigen::Matrix2d> p(ekf.posterior().covariance.data());
    ASSERT_EQ(p(0, 1), p(1, 0)) << k;
    ASSERT_GT(p.determinant(), 0.0) << k;
    ASSERT_GT(p(0, 0), 0.0) << k;
  }
}

TEST(Kalman, StartOnTheMoveTakesTheMeasurementAndItsNoise) {
  const Belief<LinearModel> b = linear_belief();
  Ekf<LinearModel> ekf(b);
  ASSERT_TRUE(ekf.start_measured(1, 3.0));
  const Posterior p = ekf.posterior();
  EXPECT_EQ(p.mean[0], 0.5);
  EXPECT_EQ(p.mean[1], 3.0);
  EXPECT_EQ(p.covariance[0], 0.4);
  EXPECT_NEAR(p.covariance[3], 0.9 + 0.2 * 0.2, 1e-15);  // rounding
}

TEST(Kalman, ASensorWithoutNoiseIsRefused) {
  Scenario scenario;
  scenario.sensors = {{"position", "p_m", 10.0, {0.0, 0.0}}};
  try {
    const Tuning tuning;
    make_belief(LinearModel{}, scenario, tuning);
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(
        refusal.what(),
        "sensor.position: has no noise, which no estimator can weigh; give it some, or let the tuning say measurement_noise = "
        "\"given\"");
  }
}

TEST(Kalman, AMeasurementThatIsNotANumberMakesTheEstimateInvalid) {
  Ekf<LinearModel> ekf(linear_belief());
  ekf.start_given();
  step(ekf, {0.0, {std::numeric_limits<double>::quiet_NaN(), 1.0}, 3U}, true);
  EXPECT_EQ(ekf.posterior().status, EstimateStatus::kInvalid);
}

}  // namespace
}  // namespace slipstream::test
