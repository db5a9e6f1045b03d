// Laws over all process models of the registry, and the closed forms of each.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "common/jacobian.hpp"
#include "common/random.hpp"
#include "models/registry.hpp"
#include "models/sensors/all.hpp"
#include "models/transition.hpp"
#include "tests/models/difference.hpp"
#include "tests/support/alternatives.hpp"

namespace slipstream {
namespace {

template <typename M>
class ProcessLaws : public ::testing::Test {
 protected:
  using State = Vector<double, M::kStates>;
  using Input = Vector<double, M::kInputs>;

  std::vector<State> states() const {
    std::vector<State> all{State::Zero()};
    RandomStream random(1, 0, M::kName);
    for (const double size : {0.1, 1.0, 10.0}) {
      State x;
      for (int i = 0; i < M::kStates; ++i) x[i] = size * (0.5 + random.uniform());
      all.push_back(x);
    }
    return all;
  }
  std::vector<Input> inputs() const { return {Input::Zero(), Input::Constant(1400.0)}; }

  M model_;
};

TYPED_TEST_SUITE(ProcessLaws, Alternatives<AnyProcess>::Types);

TYPED_TEST(ProcessLaws, DualJacobiansAreTheCentralDifferences) {
  constexpr int n = TypeParam::kStates, m = TypeParam::kOutputs;
  for (const auto& u : this->inputs())
    for (const auto& x : this->states()) {
      Vector<double, n> rate;
      Matrix<double, n> f_x;
      value_and_jacobian<n>([&](const auto& d) { return this->model_.derivative(d, u); }, x, rate, f_x);
      const auto f = [&](const Vector<double, n>& p) { return this->model_.template derivative<double>(p, u); };
      EXPECT_LE(difference_error(f_x, central_difference<n, n>(f, x)), 1.0) << x.transpose();
      Vector<double, m> z;
      Matrix<double, m, n> h_x;
      value_and_jacobian<m>([&](const auto& d) { return this->model_.output(d, u); }, x, z, h_x);
      const auto h = [&](const Vector<double, n>& p) { return this->model_.template output<double>(p, u); };
      EXPECT_LE(difference_error(h_x, central_difference<m, n>(h, x)), 1.0) << x.transpose();
    }
}

TYPED_TEST(ProcessLaws, ConstantsDoNotChange) {
  constexpr std::array<bool, TypeParam::kStates> is_constant = constant_states<TypeParam>();
  for (const auto& x : this->states())
    for (const auto& u : this->inputs()) {
      const auto rate = this->model_.template derivative<double>(x, u);
      for (std::size_t i = 0; i < is_constant.size(); ++i)
        EXPECT_TRUE(!is_constant[i] || rate[static_cast<int>(i)] == 0.0) << i;
    }
}

TYPED_TEST(ProcessLaws, FiniteAtStandstillWithJacobianAndHessian) {
  constexpr int n = TypeParam::kStates;
  using D = Dual<double, n>;
  const Vector<double, n> zero = Vector<double, n>::Zero();
  for (const auto& u : this->inputs()) {
    Vector<D, n> rate;
    Matrix<D, n> f_x;
    value_and_jacobian<n>([&](const auto& d) { return this->model_.derivative(d, u); }, independent(zero), rate, f_x);
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c) {
        EXPECT_TRUE(std::isfinite(f_x(r, c).value));
        for (std::size_t k = 0; k < n; ++k) EXPECT_TRUE(std::isfinite(f_x(r, c).grad[k]));
      }
    EXPECT_TRUE(this->model_.template output<double>(zero, u).allFinite());
  }
}

TYPED_TEST(ProcessLaws, NamesAreUniqueAndOutputsHaveASensor) {
  std::set<std::string_view> states, sensed;
  for (const Quantity& q : TypeParam::kStateNames) EXPECT_TRUE(states.insert(q.name).second) << q.name;
  for (const SensorType& s : kSensorTypes) sensed.insert(s.quantity.name);
  for (const Quantity& q : TypeParam::kOutputNames) EXPECT_TRUE(sensed.contains(q.name)) << q.name;
}

// Where a measurement fixes a start, the state it gives measures just that.
TYPED_TEST(ProcessLaws, AStartFromAMeasurementReproducesIt) {
  int starts = 0;
  for (int k = 0; k < TypeParam::kOutputs; ++k) {
    Vector<double, TypeParam::kStates> x = Vector<double, TypeParam::kStates>::Constant(0.25);
    const auto before = x;
    if (!this->model_.start_from(k, 7.5, x)) {
      EXPECT_EQ(x, before) << "an output that fixes no start must leave the state alone";
      continue;
    }
    ++starts;
    const Vector<double, TypeParam::kInputs> none = Vector<double, TypeParam::kInputs>::Zero();
    const auto z = this->model_.template output<double>(x, none);
    EXPECT_NEAR(z[k], 7.5, 1e-12);  // rounding
  }
  EXPECT_GE(starts, 1) << "nothing fixes a start on the move";
}

// --- Models that are a vehicle's own equations ------------------------------------------------------------------------

// `name` among the vehicle's truth.
template <Vehicle V>
double true_value(const V& vehicle, const Vector<double, V::kStates>& x, std::string_view name) {
  const auto truth = vehicle.truth(x, vehicle.initial_mode());
  for (std::size_t i = 0; i < V::kTruth.size(); ++i)
    if (V::kTruth[i].name == name) return truth[i];
  ADD_FAILURE() << V::kName << " has no truth " << name;
  return 0.0;
}

// Named states of both have the same rates, outputs are what the vehicle shows, and no state of the vehicle is left out.
template <ProcessModel M, Vehicle V>
void expect_same_equations(const M& model, V vehicle) {
  vehicle.prepare();
  RandomStream random(1, 0, "same equations");
  for (const double size : {0.0, 0.1, 1.0, 30.0}) {
    Vector<double, V::kStates> at;
    for (int i = 0; i < V::kStates; ++i) at[i] = size * (0.8 + 0.4 * random.uniform());
    Vector<double, M::kStates> x;
    Vector<double, M::kInputs> u;
    for (std::size_t i = 0; i < M::kStates; ++i) x[static_cast<int>(i)] = true_value(vehicle, at, M::kStateNames[i].name);
    for (std::size_t i = 0; i < M::kInputs; ++i) u[static_cast<int>(i)] = true_value(vehicle, at, M::kInputNames[i].name);
    const auto rate = model.template derivative<double>(x, u);
    const auto true_rate = vehicle.template derivative<double>(at, vehicle.initial_mode());
    std::size_t met = 0;
    for (std::size_t i = 0; i < V::kStates; ++i) {
      if (V::kStateNames[i].empty()) continue;
      const auto same = std::find_if(M::kStateNames.begin(), M::kStateNames.end(),
                                     [&](const Quantity& q) { return q.name == V::kStateNames[i]; });
      ASSERT_NE(same, M::kStateNames.end()) << V::kStateNames[i];
      const double expected = true_rate[static_cast<int>(i)];
      // Rounding, of operations in another order.
      EXPECT_NEAR(rate[static_cast<int>(same - M::kStateNames.begin())], expected, 1e-14 * (1.0 + std::abs(expected)));
      ++met;
    }
    EXPECT_EQ(met, static_cast<std::size_t>(M::kStates));
    const auto z = model.template output<double>(x, u);
    for (std::size_t i = 0; i < M::kOutputs; ++i)
      EXPECT_NEAR(z[static_cast<int>(i)], true_value(vehicle, at, M::kOutputNames[i].name), 1e-14 * size);  // rounding
  }
}

TYPED_TEST(ProcessLaws, AModelThatClaimsToBeAVehicleIsThat) {
  if constexpr (requires { TypeParam::kExactFor; }) {
    int met = 0;
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      const auto try_one = [&]<typename V>(const V& vehicle) {
        if constexpr (TypeParam::kExactFor == V::kName) {
          expect_same_equations(this->model_, vehicle);
          ++met;
        }
      };
      (try_one(std::variant_alternative_t<I, AnyVehicle>()), ...);
    }
    (std::make_index_sequence<std::variant_size_v<AnyVehicle>>());
    EXPECT_EQ(met, 1) << "no vehicle is called " << TypeParam::kExactFor;
  }
}

// --- longitudinal_friction --------------------------------------------------------------------------------------------

// By hand, Table 15: w = 20 rad/s, v = 10 m/s, mu = 0.15, T = 2000 N m, b = 3 N m s.
//   w' = (2000 - 3 * 20 - (0.15 + 0.02) * 2000 * 9.81 * 0.52) / 11.5 = (1940 - 1734.408) / 11.5 = 17.8775652...
//   v' = 0.15 * 9.81 - 1.2 * 0.6 * 5.6 * 10^2 / 2 / 2000 = 1.4715 - 0.1008
TEST(LongitudinalFriction, ByHand) {
  LongitudinalFriction m;
  m.wheel.quarter.viscous_friction_nms = 3.0;
  const Vector<double, 3> x(20.0, 10.0, 0.15);
  const Vector<double, 1> u(2000.0);
  const auto rate = m.derivative<double>(x, u);
  EXPECT_NEAR(rate[0], 205.592 / 11.5, 1e-12);  // rounding of terms of 2000 / 11.5
  EXPECT_NEAR(rate[1], 1.3707, 1e-14);          // rounding
  EXPECT_EQ(rate[2], 0.0);
  const auto z = m.output<double>(x, u);
  EXPECT_EQ(z[0], 20.0);
  EXPECT_NEAR(z[1], 1.3707, 1e-14);  // a_x = v'
  m.drag = false;                    // as in the document: v' = mu g
  EXPECT_NEAR(m.derivative<double>(x, u)[1], 1.4715, 1e-14);
  EXPECT_NEAR(m.output<double>(x, u)[1], 1.4715, 1e-14);
}

TEST(LongitudinalFriction, StartsFromTheWheelSpeedOnly) {
  const LongitudinalFriction m;
  Vector<double, 3> x(1.0, 2.0, 0.3);
  EXPECT_FALSE(m.start_from(1, 5.0, x));
  EXPECT_EQ(x, (Vector<double, 3>(1.0, 2.0, 0.3)));
  EXPECT_TRUE(m.start_from(0, 10.0, x));
  EXPECT_EQ(x[0], 10.0);
  EXPECT_NEAR(x[1], 5.2, 1e-15);  // rolling without slip, r = 0.52 m; rounding
  EXPECT_EQ(x[2], 0.3);
}

}  // namespace
}  // namespace slipstream
