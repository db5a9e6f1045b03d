#include "common/dual.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "common/jacobian.hpp"
#include "common/types.hpp"

namespace slipstream {
namespace {

using D1 = Dual<double, 1>;
using D2 = Dual<double, 2>;
using DD1 = Dual<D1, 1>;

constexpr double kRounding = 1e-14;  // relative; a handful of operations, each good to 1.1e-16

void expect_close(double found, double expected, const std::string& what) {
  EXPECT_NEAR(found, expected, kRounding * std::max(1.0, std::abs(expected))) << what;
}

DD1 second_order_variable(double x) { return DD1::variable(D1::variable(x, 0), 0); }

// A function of one variable, its first and its second derivative by the book.
struct Law {
  std::string name;
  std::function<double(double)> f;
  std::function<D1(const D1&)> dual;
  std::function<DD1(const DD1&)> nested;
  std::function<double(double)> df;
  std::function<double(double)> ddf;
  std::vector<double> points;
};

#define SLIPSTREAM_LAW(expression, df, ddf, ...)                                                                         \
  Law {                                                                                                                  \
#expression, [](double x) { return static_cast<double>(expression); }, [](const D1& x) { return D1(expression); },     \
        [](const DD1& x) { return DD1(expression); }, [](double x) { return df + 0.0 * x; },                              \
        [](double x) { return ddf + 0.0 * x; }, { \
      __VA_ARGS__                                                                                                        \
    }                                                                                                                    \
  }

using std::abs, std::atan, std::cos, std::exp, std::sin, std::sqrt;

const std::vector<Law>& laws() {
  static const std::vector<Law> all{
      SLIPSTREAM_LAW(x + x, 2.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(x + 3.0, 1.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(3.0 + x, 1.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(x - 3.0, 1.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(3.0 - x, -1.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(-x, -1.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(x - x * x, 1.0 - 2.0 * x, -2.0, -3.0, 0.5),
      SLIPSTREAM_LAW(x * x * x, 3.0 * x * x, 6.0 * x, -3.0, 0.0, 0.5),
      SLIPSTREAM_LAW(x * 2.5, 2.5, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(2.5 * x, 2.5, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(2 * x, 2.0, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(x / 4.0, 0.25, 0.0, -3.0, 0.5),
      SLIPSTREAM_LAW(1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x), -3.0, 0.5),
      SLIPSTREAM_LAW(x / (1.0 + x * x), (1.0 - x * x) / ((1.0 + x * x) * (1.0 + x * x)),
                     2.0 * x * (x * x - 3.0) / ((1.0 + x * x) * (1.0 + x * x) * (1.0 + x * x)), -3.0, 0.0, 0.5),
      SLIPSTREAM_LAW(sqrt(x), 0.5 / std::sqrt(x), -0.25 / (x * std::sqrt(x)), 0.3, 4.0),
      SLIPSTREAM_LAW(sin(x), std::cos(x), -std::sin(x), -2.0, 0.0, 1.3),
      SLIPSTREAM_LAW(cos(x), -std::sin(x), -std::cos(x), -2.0, 0.0, 1.3),
      SLIPSTREAM_LAW(atan(x), 1.0 / (1.0 + x * x), -2.0 * x / ((1.0 + x * x) * (1.0 + x * x)), -2.0, 0.0, 1.3),
      SLIPSTREAM_LAW(exp(x), std::exp(x), std::exp(x), -2.0, 0.0, 1.3),
      SLIPSTREAM_LAW(abs(x), (x < 0.0 ? -1.0 : 1.0), 0.0, -2.0, 1.3),
      SLIPSTREAM_LAW(x * abs(x), 2.0 * std::abs(x), (x < 0.0 ? -2.0 : 2.0), -2.0, 1.3),
  };
  return all;
}

TEST(Dual, ValueAndDerivativeOfEveryFunctionAreTheBooks) {
  for (const Law& law : laws())
    for (const double x : law.points) {
      const D1 y = law.dual(D1::variable(x, 0));
      expect_close(y.value, law.f(x), law.name);
      expect_close(y.grad[0], law.df(x), law.name + "'");
    }
}

TEST(Dual, DerivativeOfEveryFunctionIsTheCentralDifference) {
  constexpr double h = 1e-5;
  for (const Law& law : laws())
    for (const double x : law.points) {
      const double difference = (law.f(x + h) - law.f(x - h)) / (2.0 * h);
      // Truncation h^2 f'''/6 with |f'''| < 60 here: 1e-9; rounding 1e-16 |f| / h: 3e-10.
      EXPECT_NEAR(law.dual(D1::variable(x, 0)).grad[0], difference, 2e-9) << law.name << " at " << x;
    }
}

TEST(Dual, NestedGivesTheSecondDerivative) {
  for (const Law& law : laws())
    for (const double x : law.points) {
      const DD1 y = law.nested(second_order_variable(x));
      expect_close(y.value.value, law.f(x), law.name);
      expect_close(y.value.grad[0], law.df(x), law.name + "' (inner)");
      expect_close(y.grad[0].value, law.df(x), law.name + "' (outer)");
      expect_close(y.grad[0].grad[0], law.ddf(x), law.name + "''");
    }
}

TEST(Dual, AConstantHasNoGradient) {
  const D2 c = 3;
  EXPECT_EQ(c.value, 3.0);
  EXPECT_EQ(c.grad[0], 0.0);
  EXPECT_EQ(c.grad[1], 0.0);
  const D2 product = c * D2::variable(2.0, 1);
  EXPECT_EQ(product.value, 6.0);
  EXPECT_EQ(product.grad[0], 0.0);
  EXPECT_EQ(product.grad[1], 3.0);
}

TEST(Dual, TwoVariablesKeepTheirPartialDerivativesApart) {
  const D2 x = D2::variable(3.0, 0), y = D2::variable(4.0, 1);
  const D2 r = sqrt(x * x + y * y);  // 3-4-5: gradient (3/5, 4/5)
  expect_close(r.value, 5.0, "r");
  expect_close(r.grad[0], 0.6, "dr/dx");
  expect_close(r.grad[1], 0.8, "dr/dy");
  const D2 q = x / y;  // 1/y, -x/y^2
  expect_close(q.grad[0], 0.25, "dq/dx");
  expect_close(q.grad[1], -0.1875, "dq/dy");
}

TEST(Dual, CompoundAssignmentsEqualTheOperators) {
  const D2 x = D2::variable(3.0, 0), y = D2::variable(4.0, 1);
  D2 a = x;
  a += y;  // x + y = 7
  EXPECT_EQ(a.value, 7.0);
  EXPECT_EQ(a.grad[1], 1.0);
  a -= x * x;  // y + x - x^2 = -2, d/dx = 1 - 2x
  EXPECT_EQ(a.value, -2.0);
  EXPECT_EQ(a.grad[0], -5.0);
  a *= y;  // -8; d/dx = -20, d/dy = -2 + 4
  EXPECT_EQ(a.value, -8.0);
  EXPECT_EQ(a.grad[0], -20.0);
  EXPECT_EQ(a.grad[1], 2.0);
  a *= 0.5;
  EXPECT_EQ(a.value, -4.0);
  EXPECT_EQ(a.grad[0], -10.0);
  a /= x;  // -4/3; d/dx = (-10 - (-4/3)) / 3 = -26/9
  expect_close(a.value, -4.0 / 3.0, "a");
  expect_close(a.grad[0], -26.0 / 9.0, "da/dx");
}

TEST(Dual, ComparisonsLookAtTheValueOnly) {
  const D2 small(1.0, D2::variable(0.0, 0).grad), large = 2.0;
  EXPECT_TRUE(small < large && large > small && small <= large && large >= small);
  EXPECT_FALSE(large < small || small > large || large <= small || small >= large || small == large);
  const D2 same = 1.0;  // another gradient
  EXPECT_TRUE(small == same && small <= same && small >= same);
  EXPECT_FALSE(small < same || small > same);
}

// IEEE 754: every ordered comparison with NaN is false. A dual number must compare as its value does.
TEST(Dual, ComparisonsWithNanAreFalseAsForDouble) {
  const D2 nan = std::numeric_limits<double>::quiet_NaN();
  const D2 one = 1.0;
  EXPECT_FALSE(nan < one);
  EXPECT_FALSE(nan > one);
  EXPECT_FALSE(nan == one);
  EXPECT_FALSE(nan <= one);
  EXPECT_FALSE(nan >= one);
}

TEST(Dual, ValueOfReachesThroughEveryNesting) {
  EXPECT_EQ(value_of(2.5), 2.5);
  EXPECT_EQ(value_of(D1(2.5)), 2.5);
  EXPECT_EQ(value_of(second_order_variable(2.5)), 2.5);
}

TEST(Dual, EigenProductsOfDualsAndDoubles) {
  const Vector<D2, 2> x = independent(Vector<double, 2>(3.0, 4.0));
  Matrix<double, 2> a;
  a << 1.0, 2.0, 3.0, 4.0;
  const Vector<D2, 2> y = a * x;  // J = A
  for (int r = 0; r < 2; ++r)
    for (int c = 0; c < 2; ++c) EXPECT_EQ(y[r].grad[static_cast<std::size_t>(c)], a(r, c));
  EXPECT_EQ(y[1].value, 25.0);
  const D2 square = x.dot(x);  // 2 x
  EXPECT_EQ(square.value, 25.0);
  EXPECT_EQ(square.grad[0], 6.0);
  EXPECT_EQ(square.grad[1], 8.0);
}

// Rosenbrock's function f = (1 - x)^2 + 100 (y - x^2)^2:
//   f_x = -2 (1 - x) - 400 x (y - x^2), f_y = 200 (y - x^2), H = [2 - 400 y + 1200 x^2, -400 x; -400 x, 200]
TEST(Jacobian, NestedGivesTheExactHessian) {
  const double x = -1.2, y = 1.0;
  const auto gradient = [](const auto& p) {
    using T = typename std::decay_t<decltype(p)>::Scalar;
    Vector<T, 1> f;
    Matrix<T, 1, 2> g;
    value_and_jacobian<1>(
        [](const auto& q) {
          using S = typename std::decay_t<decltype(q)>::Scalar;
          const S a = 1.0 - q[0], b = q[1] - q[0] * q[0];
          Vector<S, 1> value;
          value[0] = a * a + 100.0 * (b * b);
          return value;
        },
        p, f, g);
    return Vector<T, 2>(g.transpose());
  };
  Vector<double, 2> g;
  Matrix<double, 2> h;
  value_and_jacobian<2>(gradient, Vector<double, 2>(x, y), g, h);
  // Rounding only: terms of up to 1728 and a few operations, so 1728 * 1e-15 < 2e-12.
  constexpr double tolerance = 2e-12;
  EXPECT_NEAR(g[0], -2.0 * (1.0 - x) - 400.0 * x * (y - x * x), tolerance);
  EXPECT_NEAR(g[1], 200.0 * (y - x * x), tolerance);
  EXPECT_NEAR(h(0, 0), 2.0 - 400.0 * y + 1200.0 * x * x, tolerance);
  EXPECT_NEAR(h(0, 1), -400.0 * x, tolerance);
  EXPECT_NEAR(h(1, 0), -400.0 * x, tolerance);
  EXPECT_NEAR(h(1, 1), 200.0, tolerance);
}

// Polar to Cartesian, with a third row and an odd number of variables: y = (r cos p, r sin p, r p s) of x = (r, p, s).
TEST(Jacobian, RectangularAgainstTheClosedForm) {
  const double r = 2.0, p = 0.7, s = -1.5;
  Vector<double, 4> y;
  Matrix<double, 4, 3> j;
  value_and_jacobian<4>(
      [](const auto& x) {
        using T = typename std::decay_t<decltype(x)>::Scalar;
        return Vector<T, 4>(x[0] * cos(x[1]), x[0] * sin(x[1]), x[0] * x[1] * x[2], T(5.0));
      },
      Vector<double, 3>(r, p, s), y, j);
  Matrix<double, 4, 3> expected;
  expected << std::cos(p), -r * std::sin(p), 0.0, std::sin(p), r * std::cos(p), 0.0, p * s, r * s, r * p, 0.0, 0.0, 0.0;
  EXPECT_LT((j - expected).cwiseAbs().maxCoeff(), kRounding);  // two roundings an entry of size 3
  EXPECT_LT((y - Vector<double, 4>(r * std::cos(p), r * std::sin(p), r * p * s, 5.0)).cwiseAbs().maxCoeff(), kRounding);
}

// Every lane of rows of odd and even length, and of rows whose scalar is itself a dual number.
template <typename T, int N>
void check_lanes() {
  Lanes<T, N> a, b;
  for (std::size_t i = 0; i < N; ++i) {
    EXPECT_EQ(value_of(a[i]), 0.0) << "lane " << i << " of " << N << " is not zero at first";
    a.set(i, T(static_cast<double>(i) + 1.0));
    b.set(i, T(10.0 * static_cast<double>(i) - 3.0));
  }
  const Lanes<T, N> sum = a + b, difference = a - b, product = a * 2.5;
  for (std::size_t i = 0; i < N; ++i) {
    const double x = static_cast<double>(i) + 1.0, y = 10.0 * static_cast<double>(i) - 3.0;
    EXPECT_EQ(value_of(sum[i]), x + y) << "lane " << i << " of " << N;
    EXPECT_EQ(value_of(difference[i]), x - y) << "lane " << i << " of " << N;
    EXPECT_EQ(value_of(product[i]), 2.5 * x) << "lane " << i << " of " << N;
  }
}

TEST(Lanes, OddAndEvenLengths) {
  check_lanes<double, 1>();
  check_lanes<double, 2>();
  check_lanes<double, 3>();
  check_lanes<double, 4>();
  check_lanes<double, 7>();
  check_lanes<D2, 1>();
  check_lanes<D2, 3>();
  check_lanes<D2, 4>();
}

}  // namespace
}  // namespace slipstream
