// The error-state filter against differences, a Kalman filter, hand computations and its own statistics.
#include "tests/estimators/navigation_cases.hpp"

namespace slipstream::test {
namespace {

class EsEkf : public ::testing::TestWithParam<std::tuple<const char*, bool>> {
 protected:
  bool biases_ = std::get<1>(GetParam());
  std::unique_ptr<NavigationFilter> filter_ = make_es_ekf({}, navigation_tuning(std::get<0>(GetParam()), biases_));
};
INSTANTIATE_TEST_SUITE_P(Forms, EsEkf, ::testing::Combine(::testing::Values("global", "local"), ::testing::Bool()));

template <typename F>
auto differences(const NavigationState& x, OrientationError error, const F& f) {
  constexpr double h = 1e-6;
  using Column = decltype(f(x, x));
  Eigen::Matrix<double, Column::RowsAtCompileTime, kErrors> j;
  for (int i = 0; i < kErrors; ++i) {
    const ErrorVector d = h * ErrorVector::Unit(i);
    j.col(i) = (f(plus(x, d, error), x) - f(plus(x, -d, error), x)) / (2.0 * h);
  }
  return j;
}

TEST_P(EsEkf, CovarianceMovesAsDifferencesOfTheMeanSay) {
  RandomStream random(1, 0, "es_ekf_test");
  constexpr double dt_s = 1e-3;
  for (int trial = 0; trial < 20; ++trial) {
    NavigationBelief b{random_state(random), random_covariance(random, biases_)};
    const ErrorCovariance before = b.P;
    const Inertial reading{normal3(random, 5.0), normal3(random)};
    const auto after = [&](const NavigationState& x) {
      NavigationBelief moved{x, ErrorCovariance::Zero()};
      filter_->predict(moved, reading, {}, dt_s);
      return moved.x;
    };
    ErrorCovariance f = differences(b.x, filter_->error(), [&](const NavigationState& x, const NavigationState& at) {
      return minus(after(x), after(at), filter_->error());
    });
    // Of second order in dt, and left out in eq. 3.10.
    f.block<3, 3>(kPosition, kAttitude).setZero();
    f.block<3, 3>(kPosition, kAccelerometerBias).setZero();
    filter_->predict(b, reading, {}, dt_s);
    const ErrorCovariance expected = f * before * f.transpose();
    // dphi/db_w = -dt C (1 + w dt / 2 ...): 1e-3 (4 rad/s) 1e-3 / 2 = 2e-6 of a covariance near 1
    EXPECT_LT((b.P - expected).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_GT((before - expected).cwiseAbs().maxCoeff(), 1e-3);  // what there is to see
  }
}

TEST_P(EsEkf, NoiseIsTheDocuments) {
  NavigationBelief b;
  filter_->predict(b, {}, {4.0, 9.0, 0.5, 0.25}, 0.1);
  ErrorVector expected;
  expected << Vector3::Zero(), Vector3::Constant(0.04), Vector3::Constant(0.09), Vector3::Constant(biases_ ? 0.05 : 0.0),
      Vector3::Constant(biases_ ? 0.025 : 0.0);
  EXPECT_LT((b.P - ErrorCovariance(expected.asDiagonal())).cwiseAbs().maxCoeff(), 1e-16);  // rounding
}

// h written out here, from the document and the rigid body, not taken from the filter.
Vector3 h_of(const NavigationState& x, const NavigationMeasurement& m) {
  const Matrix3 r = x.q_WS.toRotationMatrix();
  if (m.kind == NavigationMeasurement::kPoint) return x.p_WS + r * m.l;
  const Vector3 all = m.R_BS * (r.transpose() * x.v_WS + skew(m.w - x.b_w) * m.l);
  Vector3 h = Vector3::Zero();
  for (int i = 0; i < m.size; ++i) h[i] = all[m.rows[static_cast<std::size_t>(i)]];
  return h;
}

TEST_P(EsEkf, InnovationsAreAsDifferencesSay) {
  RandomStream random(2, 0, "es_ekf_test");
  for (int trial = 0; trial < 40; ++trial) {
    NavigationBelief b{random_state(random), random_covariance(random, biases_)};
    const Vector3 z = normal3(random), l = trial % 4 < 2 ? Vector3(normal3(random, 2.0)) : Vector3(Vector3::Zero());
    NavigationMeasurement m = trial % 2 == 0 ? fix(z, 0.3, l) : body_velocity(z, 0.3, {2, 0, 1}, 1 + trial % 3);
    m.l = l;
    m.w = normal3(random);
    m.R_BS = rotation_exp(normal3(random)).toRotationMatrix();
    const auto h = differences(b.x, filter_->error(),
                               [&](const NavigationState& x, const NavigationState&) -> Vector3 { return h_of(x, m); });
    const Eigen::MatrixXd rows = h.topRows(m.size);
    const Eigen::MatrixXd s = rows * b.P * rows.transpose() + 0.3 * Eigen::MatrixXd::Identity(m.size, m.size);
    const Eigen::VectorXd nu = (z - h_of(b.x, m)).head(m.size);
    const NavigationBelief before = b;
    const NavigationInnovation i = filter_->update(b, m, kNever);
    EXPECT_EQ(i.size, m.size);
    EXPECT_LT((i.nu.head(m.size) - nu).norm(), 1e-12);                                          // rounding
    EXPECT_LT((i.S.topLeftCorner(m.size, m.size) - s).cwiseAbs().maxCoeff(), 1e-7 * s.norm());  // differences: h^2 and 1e-16/h
    EXPECT_NEAR(i.nis, nu.dot(s.ldlt().solve(nu)), 1e-6 * (1.0 + i.nis));
    // And what is done with it: the Kalman gain on the manifold, P - K S K'.
    const Eigen::MatrixXd gain = before.P * rows.transpose() * s.inverse();
    const NavigationState x = plus(before.x, ErrorVector(gain * nu), filter_->error());
    EXPECT_LT(minus(b.x, x, filter_->error()).cwiseAbs().maxCoeff(), 1e-5);  // S's and H's differences times nu near 10
    EXPECT_LT((b.P - (before.P - gain * s * gain.transpose())).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST_P(EsEkf, LinearCaseIsAKalmanFilter) { expect_kalman(*filter_, biases_); }
TEST_P(EsEkf, CovarianceStaysSymmetricAndPositive) { expect_covariances(*filter_, biases_); }
TEST_P(EsEkf, ErrorsAreAsLargeAsItBelieves) { expect_consistent(*filter_, biases_); }
TEST_P(EsEkf, WhatIsRefusedLeavesTheBelief) { expect_untouched(*filter_, biases_); }
TEST_P(EsEkf, YawWraps) {
  if (biases_) expect_yaw_is_no_number(*filter_, 1e-8);  // rounding of 2000 steps
}

TEST_P(EsEkf, BiasesLeftOutStayOut) {
  if (biases_) return;
  RandomStream random(3, 0, "es_ekf_test");
  NavigationBelief b;
  b.P.diagonal().head<9>().setConstant(0.1);
  for (int k = 0; k < 100; ++k) {
    filter_->predict(b, {normal3(random), normal3(random)}, {0.1, 0.1, 0.1, 0.1}, 0.01);
    filter_->update(b, fix(normal3(random), 0.1, {1.0, 0.0, 0.0}), kNever);
    filter_->update(b, body_velocity(normal3(random), 0.1, {0, 1, 2}, 3), kNever);
  }
  EXPECT_EQ(b.P.rightCols<6>().cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(b.x.b_f, Vector3::Zero());
  EXPECT_EQ(b.x.b_w, Vector3::Zero());
}

TEST_P(EsEkf, ForwardSpeedByHand) {
  NavigationBelief b;
  b.x.v_WS = {10.0, 0.0, 0.0};
  b.P.diagonal().segment<3>(kVelocity).setConstant(4.0);
  NavigationMeasurement m = body_velocity({12.0, 0.0, 0.0}, 1.0, {0, 1, 2}, 1);
  m.l = {0.0, 1.0, 0.0};
  m.w = {0.0, 0.0, 0.5};  // the point on the left is slower by 0.5 m/s
  const NavigationInnovation i = filter_->update(b, m, kNever);
  EXPECT_NEAR(i.nu[0], 2.5, 1e-14);                    // 12 - 9.5; rounding, as below
  EXPECT_NEAR(i.S(0, 0), 5.0, 1e-14);                  // 4 + 1
  EXPECT_NEAR(i.nis, 1.25, 1e-14);                     // 2.5^2 / 5
  EXPECT_NEAR(b.x.v_WS[0], 12.0, 1e-14);               // 10 + 0.8 2.5
  EXPECT_NEAR(b.P(kVelocity, kVelocity), 0.8, 1e-14);  // 4 1 / 5
  EXPECT_NEAR(b.P(kVelocity + 1, kVelocity + 1), 4.0, 1e-14);
}

// A car that slides to the left more likely points there.
TEST_P(EsEkf, NonholonomicConstraintTurnsTheHeadingByHand) {
  NavigationBelief b;
  b.x.v_WS = {10.0, 0.5, 0.0};
  b.P(kAttitude + 2, kAttitude + 2) = 0.01;
  const NavigationInnovation i = filter_->update(b, body_velocity(Vector3::Zero(), 1.0, {1, 2, 0}, 2), kNever);
  EXPECT_NEAR(i.S(0, 0), 2.0, 1e-14);              // 0.01 10^2 + 1; rounding, as below
  EXPECT_NEAR(to_rpy(b.x.q_WS)[2], 0.025, 1e-14);  // 0.01 10 / 2 of 0.5
  EXPECT_NEAR(b.P(kAttitude + 2, kAttitude + 2), 0.005, 1e-14);
}

}  // namespace
}  // namespace slipstream::test
