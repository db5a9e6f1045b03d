// Laws over all vehicles of the registry: a new line there is tested here without a change.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "common/jacobian.hpp"
#include "common/random.hpp"
#include "models/registry.hpp"
#include "models/sensors/all.hpp"
#include "tests/models/difference.hpp"

namespace slipstream {
namespace {

template <typename Variant>
struct Alternatives;
template <typename... Ts>
struct Alternatives<std::variant<Ts...>> {
  using Types = ::testing::Types<Ts...>;
};

template <typename V>
class VehicleLaws : public ::testing::Test {
 protected:
  using State = Vector<double, V::kStates>;
  using Mode = typename V::Mode;

  VehicleLaws() { vehicle_.prepare(); }

  // The start, standstill, and states from a fixed stream: forward driving from a crawl to 30 m/s, all states of one sign.
  std::vector<State> states() const {
    std::vector<State> all{vehicle_.initial_state(), State::Zero()};
    RandomStream random(1, 0, V::kName);
    for (const double size : {0.1, 1.0, 10.0, 30.0}) {
      State x;
      for (int i = 0; i < V::kStates; ++i) x[i] = size * (0.8 + 0.4 * random.uniform());
      all.push_back(x);
    }
    return all;
  }
  // Every mode within three events of the first.
  std::vector<Mode> modes() const {
    std::vector<Mode> all{vehicle_.initial_mode()};
    for (std::size_t begin = 0, round = 0; round < 3; ++round) {
      const std::size_t end = all.size();
      for (; begin < end; ++begin)
        for (int e = 0; e < V::kEvents; ++e) all.push_back(vehicle_.after_event(e, vehicle_.initial_state(), all[begin]));
    }
    return all;
  }

  V vehicle_;
};

TYPED_TEST_SUITE(VehicleLaws, Alternatives<AnyVehicle>::Types);

TYPED_TEST(VehicleLaws, DualJacobianIsTheCentralDifference) {
  constexpr int n = TypeParam::kStates;
  for (const auto& mode : this->modes())
    for (const auto& x : this->states()) {
      Vector<double, n> value;
      Matrix<double, n> jacobian;
      value_and_jacobian<n>([&](const auto& d) { return this->vehicle_.derivative(d, mode); }, x, value, jacobian);
      const auto f = [&](const Vector<double, n>& p) { return this->vehicle_.template derivative<double>(p, mode); };
      EXPECT_LE(difference_error(jacobian, central_difference<n, n>(f, x)), 1.0) << x.transpose();
      // One arithmetic for plant and estimator: dual and double differ by the order of a few roundings at most.
      EXPECT_LT((value - f(x)).cwiseAbs().maxCoeff(), 1e-12 * (1.0 + f(x).cwiseAbs().maxCoeff())) << x.transpose();
    }
}

TYPED_TEST(VehicleLaws, FiniteAtStandstill) {
  constexpr int n = TypeParam::kStates;
  const Vector<double, n> zero = Vector<double, n>::Zero();
  for (const auto& mode : this->modes()) {
    Vector<double, n> value;
    Matrix<double, n> jacobian;
    value_and_jacobian<n>([&](const auto& d) { return this->vehicle_.derivative(d, mode); }, zero, value, jacobian);
    EXPECT_TRUE(value.allFinite());
    EXPECT_TRUE(jacobian.allFinite());
    EXPECT_TRUE(this->vehicle_.events(zero, mode).allFinite());
    for (const double u : this->vehicle_.inputs(zero, mode)) EXPECT_TRUE(std::isfinite(u));
    for (const double t : this->vehicle_.truth(zero, mode)) EXPECT_TRUE(std::isfinite(t));
  }
}

TYPED_TEST(VehicleLaws, TruthHasUniqueNamesAndContainsTheInputs) {
  std::set<std::string_view> names;
  for (const Quantity& q : TypeParam::kTruth) {
    EXPECT_FALSE(q.name.empty());
    EXPECT_FALSE(q.unit.empty());
    EXPECT_TRUE(names.insert(q.name).second) << q.name << " twice";
  }
  for (const auto& mode : this->modes())
    for (const auto& x : this->states()) {
      const auto truth = this->vehicle_.truth(x, mode);
      const auto inputs = this->vehicle_.inputs(x, mode);
      for (std::size_t k = 0; k < inputs.size(); ++k) {
        const std::string_view name = TypeParam::kInputs[k].name;
        EXPECT_TRUE(names.contains(name)) << name;
        for (std::size_t i = 0; i < TypeParam::kTruth.size(); ++i)
          if (TypeParam::kTruth[i].name == name) {
            EXPECT_EQ(truth[i], inputs[k]);
          }
      }
    }
}

// a_x is what the accelerometer sees; on level ground and straight ahead it is the rate of the truth's speed.
TYPED_TEST(VehicleLaws, AccelerationIsTheRateOfTheSpeed) {
  const auto index = [](std::string_view name) {
    for (std::size_t i = 0; i < TypeParam::kTruth.size(); ++i)
      if (TypeParam::kTruth[i].name == name) return i;
    return TypeParam::kTruth.size();
  };
  const std::size_t speed = index("speed_mps"), a_x = index("a_x_mps2");
  if (speed == TypeParam::kTruth.size() || a_x == TypeParam::kTruth.size()) GTEST_SKIP() << "has no speed or no a_x";
  const double dt = 1e-7;
  for (const auto& mode : this->modes())
    for (const auto& x : this->states()) {
      const auto rate = this->vehicle_.template derivative<double>(x, mode);
      const double after = this->vehicle_.truth(x + dt * rate, mode)[speed],
                   before = this->vehicle_.truth(x - dt * rate, mode)[speed];
      const double a = this->vehicle_.truth(x, mode)[a_x];
      EXPECT_NEAR((after - before) / (2.0 * dt), a, 1e-6);  // speed is a state: rounding 30 * 1e-16 / dt = 3e-8
    }
}

TYPED_TEST(VehicleLaws, StartsInItsOwnMode) {
  EXPECT_TRUE(this->vehicle_.initial_state().allFinite());
  const auto g = this->vehicle_.events(this->vehicle_.initial_state(), this->vehicle_.initial_mode());
  EXPECT_TRUE(g.allFinite());
}

TYPED_TEST(VehicleLaws, NothingDependsOnAnIgnorableState) {
  if constexpr (requires { TypeParam::kIgnorable; }) {
    RandomStream random(2, 0, TypeParam::kName);
    for (const auto& mode : this->modes())
      for (const auto& x : this->states()) {
        auto moved = x;
        for (int i = 0; i < TypeParam::kStates; ++i)
          if (TypeParam::kIgnorable[static_cast<std::size_t>(i)]) moved[i] += 100.0 * random.normal();
        EXPECT_EQ(this->vehicle_.template derivative<double>(moved, mode), this->vehicle_.template derivative<double>(x, mode));
        EXPECT_EQ(this->vehicle_.events(moved, mode), this->vehicle_.events(x, mode));
      }
  } else {
    GTEST_SKIP() << "names none";
  }
}

// Laws over the sensor types.

TEST(SensorTypes, NamesQuantitiesAndKeysAgree) {
  std::set<std::string_view> names, quantities;
  for (const SensorType& s : kSensorTypes) {
    EXPECT_TRUE(names.insert(s.name).second) << s.name << " twice";
    EXPECT_TRUE(quantities.insert(s.quantity.name).second) << s.quantity.name << " twice";
    const std::string_view suffix = s.quantity.name.substr(s.quantity.name.rfind('_'));
    EXPECT_EQ(s.noise_key, "noise" + std::string(suffix)) << "the noise has the unit of what is measured";
  }
  EXPECT_GE(names.size(), 2u);
}

TEST(SensorTypes, SomeVehicleHasWhatEachMeasures) {
  std::set<std::pair<std::string_view, std::string_view>> offered;
  const auto collect = [&]<typename... Vs>(std::variant<Vs...>*) {
    const auto add = [&](const auto& list) {
      for (const Quantity& q : list) offered.emplace(q.name, q.unit);
    };
    (add(Vs::kTruth), ...);
  };
  collect(static_cast<AnyVehicle*>(nullptr));
  for (const SensorType& s : kSensorTypes)
    EXPECT_TRUE(offered.contains({s.quantity.name, s.quantity.unit})) << s.name << ", with the same unit";
}

}  // namespace
}  // namespace slipstream
