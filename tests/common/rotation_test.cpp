#include "common/rotation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/random.hpp"

namespace slipstream {
namespace {

Vector3 random_vector(RandomStream& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

TEST(Rotation, QuarterTurnsByHand) {
  const double h = kPi / 2.0, e = 1e-15;  // rounding
  EXPECT_LT((rotation_exp({0, 0, h}) * Vector3::UnitX() - Vector3::UnitY()).norm(), e);
  EXPECT_LT((rotation_exp({h, 0, 0}) * Vector3::UnitY() - Vector3::UnitZ()).norm(), e);
  EXPECT_LT((rotation_exp({0, h, 0}) * Vector3::UnitZ() - Vector3::UnitX()).norm(), e);
  EXPECT_LT((rotation_log(Rotation(std::sqrt(0.5), 0, 0, std::sqrt(0.5))) - Vector3(0, 0, h)).norm(), e);
  EXPECT_LT((skew({1, 2, 3}) * Vector3(-1, 4, 2) - Vector3(2 * 2 - 3 * 4, 3 * -1 - 1 * 2, 1 * 4 - 2 * -1)).norm(), e);
}

TEST(Rotation, LogIsTheInverseOfExpNearZeroAndNearPi) {
  RandomStream random(1, 0, "rotation");
  for (const double angle : {0.0, 1e-300, 1e-12, 1e-8, 9.9e-5, 1.01e-4, 1e-3, 0.1, 1.0, 3.0, kPi - 1e-6, kPi - 1e-9})
    for (int i = 0; i < 20; ++i) {
      const Vector3 axis = random_vector(random).normalized(), phi = angle * axis;
      const Rotation q = rotation_exp(phi);
      EXPECT_NEAR(q.norm(), 1.0, 1e-15) << angle;                                 // rounding
      EXPECT_LT((rotation_log(q) - phi).norm(), 1e-15 + 1e-14 * angle) << angle;  // rounding; the series end below 1e-18
      EXPECT_LT((rotation_log(Rotation(-q.coeffs())) - phi).norm(), 1e-15 + 1e-14 * angle) << "-q is the same rotation";
    }
  EXPECT_NEAR(rotation_log(rotation_exp({0, 0, kPi + 0.1}))[2], 0.1 - kPi, 1e-14) << "the short way";
  EXPECT_NEAR(rotation_log(rotation_exp({0, 0, kPi})).norm(), kPi, 1e-14);
}

TEST(Rotation, ExpOfSmallAnglesHasItsSeries) {  // Rodrigues: R v = v + phi x v + phi x (phi x v) / 2 + O(|phi|^3)
  const Vector3 phi(1e-5, -2e-5, 3e-5), v(1, 2, 3);
  EXPECT_LT((rotation_exp(phi) * v - (v + phi.cross(v) + 0.5 * phi.cross(phi.cross(v)))).norm(), 4e-14);  // |phi|^3 |v| / 6
}

TEST(Rotation, GlobalErrorsStandInWAndLocalOnesInTheBody) {
  RandomStream random(2, 0, "rotation");
  const Rotation q = rotation_exp({0, 0, kPi / 2.0});  // nose to the north: the body's x axis is W's y
  EXPECT_LT((global_plus(q, {0, 0.1, 0}).coeffs() - local_plus(q, {0.1, 0, 0}).coeffs()).norm(), 1e-15);
  for (int i = 0; i < 50; ++i) {
    const Rotation a = rotation_exp(random_vector(random));
    const Vector3 phi = random_vector(random).normalized() * 2.0 * random.uniform();
    EXPECT_LT((global_minus(global_plus(a, phi), a) - phi).norm(), 1e-14);
    EXPECT_LT((local_minus(local_plus(a, phi), a) - phi).norm(), 1e-14);
  }
}

TEST(Rotation, RollPitchYawByHand) {
  const double h = kPi / 2.0, e = 1e-15;
  EXPECT_LT((from_rpy({h, 0, 0}) * Vector3::UnitY() - Vector3::UnitZ()).norm(), e) << "positive roll lifts the left side";
  EXPECT_LT((from_rpy({0, 0.3, 0}) * Vector3::UnitX() - Vector3(std::cos(0.3), 0, -std::sin(0.3))).norm(), e)
      << "positive pitch lowers the nose";
  EXPECT_LT((from_rpy({0, 0, h}) * Vector3::UnitX() - Vector3::UnitY()).norm(), e) << "positive yaw turns left";
  // Rz(90) Ry(90) Rx(90): x -> x -> -z -> -z,  y -> z -> x -> y,  z -> -y -> -y -> x
  const Rotation all = from_rpy({h, h, h});
  EXPECT_LT((all * Vector3::UnitX() + Vector3::UnitZ()).norm(), e);
  EXPECT_LT((all * Vector3::UnitY() - Vector3::UnitY()).norm(), e);
  EXPECT_LT((all * Vector3::UnitZ() - Vector3::UnitX()).norm(), e);
}

// The course's calibration of its LIDAR, RPY (0.05, 0.05, 0.1), as its starter code prints the matrix: five digits.
TEST(Rotation, RollPitchYawAsPublished) {
  Matrix3 published;
  published << 0.99376, -0.09722, 0.05466, 0.09971, 0.99401, -0.04475, -0.04998, 0.04992, 0.9975;
  EXPECT_LT((from_rpy({0.05, 0.05, 0.1}).toRotationMatrix() - published).cwiseAbs().maxCoeff(), 6e-6);
}

TEST(Rotation, RollPitchYawComeBack) {
  RandomStream random(3, 0, "rotation");
  for (int i = 0; i < 200; ++i) {
    const Vector3 rpy(6.2 * random.uniform() - 3.1, 3.1 * random.uniform() - 1.55, 6.2 * random.uniform() - 3.1);
    EXPECT_LT((to_rpy(from_rpy(rpy)) - rpy).norm(), 1e-12) << rpy.transpose();  // rounding by 1 / cos(1.55) = 48 and more
  }
}

TEST(Rotation, RpyJacobianIsTheCentralDifference) {
  RandomStream random(4, 0, "rotation");
  const double h = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const Vector3 rpy(6.0 * random.uniform() - 3.0, 2.8 * random.uniform() - 1.4, 6.0 * random.uniform() - 3.0);
    const Rotation q = from_rpy(rpy);
    const Matrix3 j = rpy_jacobian(rpy);
    for (int k = 0; k < 3; ++k) {
      const Vector3 phi = h * Vector3::Unit(k);
      const Vector3 difference = (to_rpy(global_plus(q, phi)) - to_rpy(global_plus(q, -phi))) / (2.0 * h);
      EXPECT_LT((j.col(k) - difference).norm(), 1e-7);  // h^2 / cos^3(1.4) = 2e-10; rounding 1e-16 / (h cos(1.4)^2) = 3e-9
    }
  }
}

TEST(Rotation, WrapsAngles) {
  EXPECT_NEAR(wrap_angle(3.5 * kPi), -0.5 * kPi, 1e-14);
  EXPECT_EQ(wrap_angle(-3.0), -3.0);
  EXPECT_NEAR(wrap_angle(kPi + 0.1), 0.1 - kPi, 1e-15);
  EXPECT_NEAR(wrap_angle(-100.0 * kPi - 0.1), -0.1, 1e-13);
}

}  // namespace
}  // namespace slipstream
