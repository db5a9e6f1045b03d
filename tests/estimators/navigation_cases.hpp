// What the tests of both strapdown filters share: random states and covariances, and drives of the exact discrete model.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <memory>
#include <string>

#include "common/random.hpp"
#include "estimators/navigation.hpp"

namespace slipstream::test {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

inline Vector3 normal3(RandomStream& random, double deviation = 1.0) {
  return deviation * Vector3(random.normal(), random.normal(), random.normal());
}
inline NavigationState random_state(RandomStream& random) {
  NavigationState x;
  x.q_WS = rotation_exp(normal3(random));
  x.p_WS = normal3(random, 10.0);
  x.v_WS = normal3(random, 10.0);
  x.b_f = normal3(random, 0.1);
  x.b_w = normal3(random, 0.01);
  return x;
}
inline ErrorCovariance random_covariance(RandomStream& random, bool biases) {
  ErrorCovariance a;
  for (double& value : a.reshaped()) value = 0.3 * random.normal();
  if (!biases) a.bottomRows<6>().setZero();
  const ErrorCovariance p = a * a.transpose();
  return 0.5 * (p + p.transpose());
}
inline StrapdownTuning navigation_tuning(const std::string& error, bool biases) {
  StrapdownTuning t;
  t.orientation_error = error;
  t.biases = biases;
  return t;
}
inline NavigationMeasurement fix(const Vector3& z, double variance, const Vector3& l = Vector3::Zero()) {
  NavigationMeasurement m;
  m.z = z;
  m.R = variance * Matrix3::Identity();
  m.l = l;
  return m;
}
inline NavigationMeasurement body_velocity(const Vector3& z, double variance, std::array<int, 3> rows, int size) {
  NavigationMeasurement m = fix(z, variance);
  m.kind = NavigationMeasurement::kBodyVelocity;
  m.rows = rows;
  m.size = size;
  return m;
}

inline void expect_covariance(const ErrorCovariance& p) {
  ASSERT_EQ(p, p.transpose());
  ErrorVector scale = p.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0.0 ? 1.0 / s : 1.0;
  const ErrorCovariance correlation = scale.asDiagonal() * p * scale.asDiagonal();
  const double least = Eigen::SelfAdjointEigenSolver<ErrorCovariance>(correlation, Eigen::EigenvaluesOnly).eigenvalues()[0];
  ASSERT_GE(least, -1e-9);  // of correlations, whose rounding is 1e-16 times the condition that fixes bring, up to 1e6
}

inline NavigationBelief turned(const NavigationBelief& b, const Rotation& q) {
  NavigationBelief to = b;
  to.x.q_WS = q * b.x.q_WS;
  to.x.p_WS = q * b.x.p_WS;
  to.x.v_WS = q * b.x.v_WS;
  return to;
}

struct Consistency {
  double nees = 0.0, nis = 0.0;  // sums
  int states = 0, numbers = 0;   // their degrees of freedom
};

// One drive of the discrete model with its own noise: readings miss the truth's by noise and bias, the start by a draw of P.
// Scored at its end, and at every fix, which a lever arm sees, and every forward speed.
inline void consistency_run(const NavigationFilter& filter, bool biases, std::uint64_t run, Consistency& sum) {
  RandomStream random(20240101, run, "navigation_consistency");
  const InertialNoise noise{0.01, 1e-4, biases ? 1e-4 : 0.0, biases ? 1e-7 : 0.0};
  constexpr double dt_s = 0.01, fix_variance = 0.04, speed_variance = 0.01;
  const int n = biases ? kErrors : 9;
  ErrorVector deviation;
  deviation << Vector3::Constant(1.0), Vector3::Constant(0.3), Vector3::Constant(0.03), Vector3::Constant(0.1),
      Vector3::Constant(0.005);
  NavigationBelief b;
  b.x.v_WS = {8.0, 0.0, 0.0};
  b.P.diagonal().head(n) = deviation.head(n).cwiseAbs2();
  ErrorVector d = ErrorVector::Zero();
  for (int i = 0; i < n; ++i) d[i] = deviation[i] * random.normal();
  NavigationState truth = plus(b.x, d, filter.error());
  const Vector3 arm(1.0, 0.2, 1.5);
  for (int k = 0; k < 2000; ++k) {
    // A weaving drive that speeds up and slows down: in the car's axes, of its true motion.
    const double t = dt_s * k, w_z = 0.3 * std::sin(0.7 * t), f_x = 1.5 * std::sin(0.4 * t);
    const Vector3 w(0.02 * std::sin(3.0 * t), 0.02 * std::cos(2.0 * t), w_z),
        up = truth.q_WS.conjugate() * Vector3(0.0, 0.0, 9.81);
    const Vector3 v_B = truth.q_WS.conjugate() * truth.v_WS, f = up + w.cross(v_B) + Vector3(f_x, 0.0, 0.0);
    const Inertial reading{f + truth.b_f + normal3(random, std::sqrt(noise.f)),
                           w + truth.b_w + normal3(random, std::sqrt(noise.w))};
    // Document 001, eqs 3.2-3.4, of the true f and w.
    const Vector3 a = truth.q_WS * f - Vector3(0.0, 0.0, 9.81);
    truth.p_WS += dt_s * truth.v_WS + 0.5 * dt_s * dt_s * a;
    truth.v_WS += dt_s * a;
    truth.q_WS = (truth.q_WS * rotation_exp(dt_s * w)).normalized();
    truth.b_f += normal3(random, std::sqrt(dt_s * noise.f_walk));
    truth.b_w += normal3(random, std::sqrt(dt_s * noise.w_walk));
    filter.predict(b, reading, noise, dt_s);
    if (k % 20 == 19) {
      const Vector3 z = truth.p_WS + truth.q_WS * arm + normal3(random, std::sqrt(fix_variance));
      sum.nis += filter.update(b, fix(z, fix_variance, arm), kNever).nis;
      sum.numbers += 3;
    }
    if (k % 10 == 9) {
      const double z = (truth.q_WS.conjugate() * truth.v_WS)[0] + std::sqrt(speed_variance) * random.normal();
      sum.nis += filter.update(b, body_velocity({z, 0.0, 0.0}, speed_variance, {0, 1, 2}, 1), kNever).nis;
      sum.numbers += 1;
    }
  }
  const Eigen::VectorXd e = minus(truth, b.x, filter.error()).head(n);
  sum.nees += e.dot(b.P.topLeftCorner(n, n).ldlt().solve(e));
  sum.states += n;
}

// The sum of chi-squares of so many degrees of freedom: mean n, variance 2 n.
inline void expect_chi_square(double sum, int degrees) {
  const double n = degrees;
  EXPECT_NEAR(sum / n, 1.0, 3.3 * std::sqrt(2.0 / n));  // two-sided 99.9 %
}
inline void expect_consistent(const NavigationFilter& filter, bool biases) {
  Consistency sum;
  for (std::uint64_t run = 0; run < 60; ++run) consistency_run(filter, biases, run, sum);
  expect_chi_square(sum.nees, sum.states);
  expect_chi_square(sum.nis, sum.numbers);
}

// Ten thousand steps of anything: fixes with and without arms, of poor and of almost perfect sensors, speeds, pauses.
inline void expect_covariances(const NavigationFilter& filter, bool biases) {
  RandomStream random(7, 0, "navigation_covariance");
  NavigationBelief b;
  b.P.diagonal().head(biases ? kErrors : 9).setConstant(1.0);
  for (int k = 0; k < 10000; ++k) {
    filter.predict(b, {normal3(random, 5.0) + Vector3(0.0, 0.0, 9.81), normal3(random, 0.5)}, {0.01, 1e-4, 1e-4, 1e-8},
                   0.01 + 0.1 * (k % 97 == 0));
    if (k % 3 == 0)
      filter.update(b, fix(b.x.p_WS + normal3(random, 0.1), k % 2 == 0 ? 1e-6 : 1.0, normal3(random, k % 5 == 0)), kNever);
    if (k % 7 == 0) filter.update(b, body_velocity(normal3(random), 0.01, {2, 0, 1}, 1 + k % 3), 1e4);
    ASSERT_NO_FATAL_FAILURE(expect_covariance(b.P)) << k;
    ASSERT_NEAR(b.x.q_WS.norm(), 1.0, 1e-15 * 4.0) << k;  // rounding of four products
  }
}

// Refused measurements leave every bit.
inline void expect_untouched(const NavigationFilter& filter, bool biases) {
  RandomStream random(8, 0, "navigation_untouched");
  const NavigationBelief start{random_state(random), random_covariance(random, biases)};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto same = [&](const NavigationBelief& b) {
    return b.P == start.P && b.x.p_WS == start.x.p_WS && b.x.v_WS == start.x.v_WS &&
           b.x.q_WS.coeffs() == start.x.q_WS.coeffs() && b.x.b_f == start.x.b_f && b.x.b_w == start.x.b_w;
  };
  const auto refused = [&](const NavigationMeasurement& m, double gate) {
    NavigationBelief b = start;
    return filter.update(b, m, gate).gated && same(b);
  };
  const Vector3 far = start.x.p_WS + Vector3(1e4, 0.0, 0.0);
  EXPECT_TRUE(refused(fix(far, 1.0), 16.0));
  EXPECT_FALSE(refused(fix(far, 1.0), kNever));
  EXPECT_FALSE(refused(fix(start.x.p_WS, 1.0), 16.0));
  EXPECT_TRUE(refused(fix({kNan, 0.0, 0.0}, 1.0), kNever));
  EXPECT_TRUE(refused(fix({kNever, 0.0, 0.0}, 1.0), kNever));
  EXPECT_TRUE(refused(fix(start.x.p_WS, kNan), kNever));
  EXPECT_TRUE(refused(fix(start.x.p_WS, 1.0, {kNan, 0.0, 0.0}), kNever));
  EXPECT_TRUE(refused(body_velocity({kNan, 0.0, 0.0}, 1.0, {0, 1, 2}, 1), kNever));
  NavigationBelief certain{start.x, ErrorCovariance::Zero()};
  EXPECT_TRUE(filter.update(certain, fix(start.x.p_WS, 0.0), kNever).gated);  // S = 0
  for (const double bad : {kNan, kNever}) {
    NavigationBelief b = start;
    filter.predict(b, {{bad, 0.0, 0.0}, Vector3::Zero()}, {}, 0.01);
    filter.predict(b, {Vector3::Zero(), {0.0, 0.0, bad}}, {}, 0.01);
    filter.predict(b, {}, {bad, 0.0, 0.0, 0.0}, 0.01);
    filter.predict(b, {}, {}, bad);
    EXPECT_TRUE(same(b));
  }
}

// With the attitude certain all is linear: a Kalman filter on (p, v, b_f), written out.
inline void expect_kalman(const NavigationFilter& filter, bool biases) {
  RandomStream random(9, 0, "navigation_kalman");
  NavigationBelief b{random_state(random), ErrorCovariance::Zero()};
  b.x.b_w.setZero();
  ErrorVector variance = ErrorVector::Zero();
  variance << Vector3::Constant(4.0), Vector3::Constant(1.0), Vector3::Zero(), Vector3::Constant(biases ? 0.04 : 0.0),
      Vector3::Zero();
  b.P.diagonal() = variance;
  using State = Eigen::Matrix<double, 9, 1>;
  using Square = Eigen::Matrix<double, 9, 9>;
  State x;
  x << b.x.p_WS, b.x.v_WS, b.x.b_f;
  Square p = Square::Zero();
  p.diagonal() << variance.head<6>(), variance.segment<3>(kAccelerometerBias);
  const Matrix3 r = b.x.q_WS.toRotationMatrix();
  const double dt = 0.01;
  const InertialNoise noise{0.01, 0.0, biases ? 1e-3 : 0.0, 0.0};
  Square f = Square::Identity(), q = Square::Zero();
  f.block<3, 3>(0, 3) = dt * Matrix3::Identity();
  f.block<3, 3>(3, 6) = -dt * r;
  q.diagonal() << Vector3::Zero(), Vector3::Constant(dt * dt * noise.f), Vector3::Constant(dt * noise.f_walk);
  for (int k = 0; k < 300; ++k) {
    const Vector3 z_f = normal3(random, 3.0), z = normal3(random, 5.0);
    const Vector3 a = r * (z_f - x.tail<3>()) - Vector3(0.0, 0.0, 9.81);
    x.head<3>() += dt * x.segment<3>(3) + 0.5 * dt * dt * a;
    x.segment<3>(3) += dt * a;
    p = f * p * f.transpose() + q;
    filter.predict(b, {z_f, Vector3::Zero()}, noise, dt);
    const bool point = k % 2 == 0;
    if (k % 5 != 0) continue;
    const NavigationMeasurement m = point ? fix(z, 0.5) : body_velocity(z, 0.1, {2, 0, 1}, 2);
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(m.size, 9);
    if (point) {
      h.leftCols<3>() = Matrix3::Identity();
    } else {
      h.row(0).segment<3>(3) = r.col(2).transpose();
      h.row(1).segment<3>(3) = r.col(0).transpose();
    }
    const Eigen::MatrixXd s = h * p * h.transpose() + m.R.topLeftCorner(m.size, m.size);
    const Eigen::MatrixXd gain = p * h.transpose() * s.inverse();
    const Eigen::VectorXd nu = z.head(m.size) - h * x;
    x += gain * nu;
    p = ((Square::Identity() - gain * h) * p).eval();
    const NavigationInnovation i = filter.update(b, m, kNever);
    EXPECT_NEAR(i.nis, nu.dot(s.inverse() * nu), 1e-10 * (1.0 + i.nis));  // the bar of linear cases
    EXPECT_LT((i.S.topLeftCorner(m.size, m.size) - s).cwiseAbs().maxCoeff(), 1e-10);
  }
  State got;
  got << b.x.p_WS, b.x.v_WS, b.x.b_f;
  EXPECT_LT((got - x).cwiseAbs().maxCoeff(), 1e-10 * x.cwiseAbs().maxCoeff());
  EXPECT_LT((b.P.topLeftCorner<6, 6>() - p.topLeftCorner<6, 6>()).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((b.P.block<3, 3>(kAccelerometerBias, kAccelerometerBias) - p.bottomRightCorner<3, 3>()).cwiseAbs().maxCoeff(),
            1e-10);
}

// A world turned about the vertical sees the same drive turned: also where its yaw passes 180 degrees and the other's does not.
inline void expect_yaw_is_no_number(const NavigationFilter& filter, double tolerance) {
  RandomStream random(10, 0, "navigation_yaw");
  const Rotation turn = from_rpy({0.0, 0.0, kPi - 0.2});
  NavigationBelief b;
  b.x.v_WS = {5.0, 0.0, 0.0};
  b.P.diagonal().setConstant(0.01);
  NavigationBelief other = turned(b, turn);  // P is a sphere in each block: turned it is the same
  double largest_yaw = -kPi, least_yaw = kPi;
  for (int k = 0; k < 2000; ++k) {
    const Inertial reading{{normal3(random, 0.5) + Vector3(0.0, 0.0, 9.81)}, {0.0, 0.0, 0.2 * std::sin(0.01 * k)}};
    filter.predict(b, reading, {0.01, 1e-4, 1e-4, 1e-8}, 0.01);
    filter.predict(other, reading, {0.01, 1e-4, 1e-4, 1e-8}, 0.01);
    if (k % 20 == 0) {
      const Vector3 z = b.x.p_WS + normal3(random, 0.3);
      const double nis = filter.update(b, fix(z, 0.1), kNever).nis;
      EXPECT_NEAR(filter.update(other, fix(turn * z, 0.1), kNever).nis, nis, tolerance * (1.0 + nis));
    }
    largest_yaw = std::max(largest_yaw, to_rpy(other.x.q_WS)[2]);
    least_yaw = std::min(least_yaw, to_rpy(other.x.q_WS)[2]);
  }
  EXPECT_GT(largest_yaw - least_yaw, 6.0);  // else it did not pass 180 degrees
  const ErrorVector d = minus(other.x, turned(b, turn).x, filter.error());
  EXPECT_LT(d.cwiseAbs().maxCoeff(), tolerance);
}

}  // namespace slipstream::test
