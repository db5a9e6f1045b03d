#include "common/rk4.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/dual.hpp"
#include "common/jacobian.hpp"

namespace slipstream {
namespace {

template <int N, typename F>
Vector<double, N> integrate(const F& f, Vector<double, N> x, double duration_s, int steps) {
  for (int k = 0; k < steps; ++k) x = rk4_step(f, x, duration_s / steps);
  return x;
}

// x'' = -x from (1, 0): x = cos t. Error constants of fourth order: halving the step divides the error by 2^4.
TEST(Rk4, GlobalErrorIsOfFourthOrder) {
  const auto oscillator = [](const Vector<double, 2>& x) { return Vector<double, 2>(x[1], -x[0]); };
  const auto error = [&](int steps) {
    const Vector<double, 2> x = integrate<2>(oscillator, Vector<double, 2>(1.0, 0.0), 2.0, steps);
    return (x - Vector<double, 2>(std::cos(2.0), -std::sin(2.0))).norm();
  };
  for (const int steps : {20, 40, 80}) {
    const double ratio = error(steps) / error(2 * steps);
    EXPECT_NEAR(ratio, 16.0, 0.8) << steps;  // next term is O(dt) relative, at most 0.05 for dt <= 0.1
  }
  EXPECT_NEAR(error(20), 2.0 * 1e-4 / 120.0, 2e-7);  // the phase lags by dt^5 / 120 a step; next term O(dt), here 10 %
}

// A nonlinear equation with a known solution: x' = x (1 - x) from 0.1, logistic.
TEST(Rk4, NonlinearErrorIsOfFourthOrder) {
  const auto logistic = [](const Vector<double, 1>& x) { return Vector<double, 1>(x[0] * (1.0 - x[0])); };
  const double exact = 1.0 / (1.0 + 9.0 * std::exp(-3.0));
  const auto error = [&](int steps) { return std::abs(integrate<1>(logistic, Vector<double, 1>(0.1), 3.0, steps)[0] - exact); };
  for (const int steps : {20, 40}) EXPECT_NEAR(error(steps) / error(2 * steps), 16.0, 3.0) << steps;  // O(dt), dt <= 0.15
}

// With t as a state, x' = a + b t + c t^2 + d t^3 is integrated exactly: the method is then Simpson's rule. t^4 is not.
TEST(Rk4, ExactForCubicsInTimeAndNotForQuartics) {
  const auto cubic = [](const Vector<double, 2>& x) {
    const double t = x[1];
    return Vector<double, 2>(2.0 - 3.0 * t + 5.0 * t * t + 4.0 * t * t * t, 1.0);
  };
  const double t = 1.7;
  const double exact = 2.0 * t - 1.5 * t * t + 5.0 / 3.0 * t * t * t + t * t * t * t;
  const Vector<double, 2> one_step = rk4_step(cubic, Vector<double, 2>(0.0, 0.0), t);
  EXPECT_NEAR(one_step[0], exact, 1e-13);  // rounding of sums of size 16
  EXPECT_NEAR(one_step[1], t, 1e-15);      // rounding of one sum

  const auto quartic = [](const Vector<double, 2>& x) { return Vector<double, 2>(std::pow(x[1], 4), 1.0); };
  const double simpson_error = 1.0 / 120.0;  // of t^4 over [0, 1]: (0 + 4/16 + 1)/6 - 1/5
  EXPECT_NEAR(rk4_step(quartic, Vector<double, 2>(0.0, 0.0), 1.0)[0] - 0.2, simpson_error, 1e-15);  // rounding
}

// One step of x' = l x is the Taylor polynomial of exp(l dt) to the fourth term, whatever l.
TEST(Rk4, LinearStepIsTheFourthTaylorPolynomial) {
  for (const double l : {-2.0, -0.3, 0.5}) {
    const double z = l * 0.4;
    const double taylor = 1.0 + z + z * z / 2.0 + z * z * z / 6.0 + z * z * z * z / 24.0;
    const auto f = [l](const Vector<double, 1>& x) { return Vector<double, 1>(l * x[0]); };
    EXPECT_NEAR(rk4_step(f, Vector<double, 1>(3.0), 0.4)[0], 3.0 * taylor, 1e-14);  // rounding of sums of size 3
  }
}

// Over dual numbers the step's Jacobian comes out: for x' = A x it is the Taylor polynomial of exp(A dt).
TEST(Rk4, DualStepGivesTheTransitionMatrix) {
  Matrix<double, 3> a;
  a << -1.0, 0.5, 0.0, 0.2, -0.7, 0.3, 0.0, 1.0, 0.0;
  const double dt = 0.1;
  Vector<double, 3> y;
  Matrix<double, 3> j;
  value_and_jacobian<3>(
      [&](const auto& x) {
        using V = std::decay_t<decltype(x)>;
        return rk4_step([&](const V& p) { return V(a * p); }, x, dt);
      },
      Vector<double, 3>(1.0, -2.0, 0.5), y, j);
  const Matrix<double, 3> z = a * dt;
  const Matrix<double, 3> taylor = Matrix<double, 3>::Identity() + z + z * z / 2.0 + z * z * z / 6.0 + z * z * z * z / 24.0;
  EXPECT_LT((j - taylor).cwiseAbs().maxCoeff(), 1e-14);                                      // rounding of sums of size 1
  EXPECT_LT((y - taylor * Vector<double, 3>(1.0, -2.0, 0.5)).cwiseAbs().maxCoeff(), 1e-14);  // likewise
}

}  // namespace
}  // namespace slipstream
