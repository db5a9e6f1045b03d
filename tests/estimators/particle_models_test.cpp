// All particle filters on every process model of the registry: sound, as wrong as they say, and with the same bits whatever the
// registers.
#include <gtest/gtest.h>

#include <memory>

#include "common/random.hpp"
#include "common/widest.hpp"
#include "estimators/belief.hpp"
#include "estimators/kalman.hpp"
#include "estimators/registry.hpp"
#include "models/transition.hpp"
#include "tests/estimators/linear_drive.hpp"
#include "tests/support/alternatives.hpp"

namespace slipstream::test {
namespace {

constexpr const char* kAlgorithms[] = {"pf", "asir", "rbpf"};

// A belief that makes sense for the model, and an input that moves it.
template <typename M>
struct Case;
template <>
struct Case<WheelFriction> {
  static Belief<WheelFriction> belief() {
    return {{}, {{{0.02, 0.01}, {0.0, 0.3}}}, {1e-3, 5e-4}, false, {9.0, 0.1}, {0.01, 0.01}};
  }
  static Vector<double, 1> input(int k) { return Vector<double, 1>(1224.0 + 200.0 * std::sin(0.05 * k)); }
};
template <>
struct Case<LongitudinalFriction> {
  static Belief<LongitudinalFriction> belief() {
    return {{}, {{{0.02, 0.01}, {0.0, 0.3}}}, {1e-3, 1e-3, 5e-4}, false, {9.0, 4.68, 0.1}, {0.01, 0.01, 0.01}};
  }
  static Vector<double, 1> input(int k) { return Case<WheelFriction>::input(k); }
};
template <>
struct Case<LateralBicycle> {
  static Belief<LateralBicycle> belief() {
    Belief<LateralBicycle> b;
    // The pose is known at first and not observable: of a spread that it starts with, resampling would leave a few ancestors'.
    b.noise = {{{0.0, 0.5}, {0.0, 0.1}}};
    b.process_variance = {1e-2, 1e-2, 1e-2, 1e-2, 1e-2, 10.0, 10.0};
    b.initial_mean = {0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 100.0};
    b.initial_variance = {1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 25.0, 25.0};
    return b;
  }
  static Vector<double, 2> input(int k) { return {0.1 * std::sin(0.05 * k), 60.0}; }
};
template <>
struct Case<PointMassMotion> {
  static Belief<PointMassMotion> belief() {
    return {{},
            {{{0.0, 1.0}, {0.0, 1.0}, {0.0, 0.3}}},
            {1e-1, 1e-1, 1e-2, 1e-3},
            false,
            {0.0, 0.0, 15.0, 0.5},
            {1.0, 1.0, 0.1, 0.01}};
  }
  static Vector<double, 2> input(int k) { return {0.1, 0.05 * std::sin(0.05 * k)}; }
};

template <>
struct Case<TorqueFriction> {
  static Belief<TorqueFriction> belief() {
    return {{}, {{{0.02, 0.01}, {0.0, 0.3}}}, {1e-2, 1e-2, 1e-2}, false, {9.0, 4.65, 0.1}, {0.01, 0.01, 1e-4}};
  }
  static Vector<double, 1> input(int k) { return Case<WheelFriction>::input(k); }
};
template <>
struct Case<TorqueFrictionLoad> {
  static Belief<TorqueFrictionLoad> belief() {
    Belief<TorqueFrictionLoad> b;
    b.noise = {{{0.02, 0.01}, {0.0, 0.3}}};
    b.process_variance << 1e-2, 1e-2, 1e-2, 1e-3, 1e4;
    b.initial_mean << 9.0, 4.65, 0.1, 0.02, 2000.0;
    b.initial_variance << 0.01, 0.01, 1e-4, 1e-4, 1e4;
    return b;
  }
  static Vector<double, 1> input(int k) { return Case<WheelFriction>::input(k); }
};
template <>
struct Case<TyreFriction> {
  static Belief<TyreFriction> belief() {
    return {{}, {{{0.02, 0.01}, {0.0, 0.3}}}, {1e-2, 1e-2, 1e-2}, false, {9.0, 4.65, 0.7}, {0.01, 0.01, 0.01}};
  }
  static Vector<double, 1> input(int k) { return Vector<double, 1>(3.0 * Case<WheelFriction>::input(k)); }
};
template <>
struct Case<LateralTyres> {
  static Belief<LateralTyres> belief() {
    Belief<LateralTyres> b;
    // Of five states that are drawn, 200 particles can follow two: the tyres are almost known.
    b.noise = {{{0.0, 1.0}, {0.0, 0.2}}};
    b.process_variance = {1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-2};
    b.initial_mean = {0.0, 0.0, 5.0, 6.0, 0.7, 0.0};
    b.initial_variance = {1e-3, 1e-3, 1e-2, 1e-2, 1e-4, 1e-2};
    return b;
  }
  static Vector<double, 3> input(int k) { return {0.2 * std::sin(0.05 * k), 60.0, 0.5}; }
};

// Through the registry: so nothing is compiled twice.
template <typename M>
std::unique_ptr<Estimator> make(const std::string& algorithm, int particles, double resample_below, const char* resampling,
                                std::uint64_t seed) {
  const Belief<M> b = Case<M>::belief();
  Scenario scenario;
  scenario.run.seed = seed;
  scenario.estimator.process = b.model;
  for (std::size_t o = 0; o < M::kOutputs; ++o)
    scenario.sensors.push_back({std::string(M::kOutputNames[o].name), std::string(M::kOutputNames[o].name), 100.0, b.noise[o]});
  Tuning tuning;
  for (std::size_t i = 0; i < M::kStates; ++i) {
    const std::string name(M::kStateNames[i].name);
    const auto at = static_cast<int>(i);
    tuning.process_variance[name] = b.process_variance[at];
    tuning.initial_mean[name] = b.initial_mean[at];
    tuning.initial_variance[name] = b.initial_variance[at];
  }
  tuning.pf_particles = particles;
  tuning.pf_resample_below = resample_below;
  tuning.pf_resampling = resampling;
  scenario.estimator.tunings["matched"] = tuning;
  return make_estimator(algorithm, scenario, "matched");
}

constexpr double kStep_s = 0.01;

template <typename M>
struct Journey {
  std::vector<Vector<double, M::kStates>> truth;
  std::vector<Vector<double, M::kOutputs>> z;
};
template <typename M>
Journey<M> journey(int steps, std::uint64_t seed) {
  const Belief<M> b = Case<M>::belief();
  RandomStream random(seed, 0, "journey");
  Journey<M> j;
  Vector<double, M::kStates> x = b.initial_mean;
  for (int s = 0; s < M::kStates; ++s) x[s] += std::sqrt(b.initial_variance[s]) * random.normal();
  for (int k = 0; k < steps; ++k) {
    if (k > 0) {
      x = transition(b.model, x, Case<M>::input(k), kStep_s);
      for (int s = 0; s < M::kStates; ++s) x[s] += std::sqrt(b.process_variance[s] * kStep_s) * random.normal();
    }
    Vector<double, M::kOutputs> z = b.model.output(x, Case<M>::input(k));
    for (std::size_t o = 0; o < M::kOutputs; ++o)
      z[static_cast<int>(o)] += std::sqrt(b.noise[o].variance(z[static_cast<int>(o)])) * random.normal();
    j.truth.push_back(x);
    j.z.push_back(z);
  }
  return j;
}
template <typename M>
void step_along(Estimator& e, const Journey<M>& j, int k) {
  const Vector<double, M::kInputs> u = Case<M>::input(k);
  const auto& z = j.z[static_cast<std::size_t>(k)];
  e.step({k == 0 ? 0.0 : kStep_s, {u.data(), M::kInputs}, {z.data(), M::kOutputs}, (1U << M::kOutputs) - 1U});
}

template <typename M>
class ParticlesOnModel : public ::testing::Test {};
TYPED_TEST_SUITE(ParticlesOnModel, Alternatives<AnyProcess>::Types);

TYPED_TEST(ParticlesOnModel, StaySoundAndErrAsTheySay) {
  constexpr int n = TypeParam::kStates, kSteps = 200, kRuns = 4;
  for (const std::string algorithm : kAlgorithms) {
    double nees = 0.0;
    for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
      const Journey<TypeParam> j = journey<TypeParam>(kSteps, seed);
      const int particles = algorithm == "rbpf" ? 200 : 1000;  // fewer states to draw, and slower
      const auto pf = make<TypeParam>(algorithm, particles, 0.5, "stratified", seed);
      pf->start_given();
      for (int k = 0; k < kSteps; ++k) {
        step_along(*pf, j, k);
        const Posterior p = pf->posterior();
        ASSERT_EQ(p.status, EstimateStatus::kValid) << algorithm << " at " << k;
        const Matrix<double, n> covariance = Eigen::Map<const Matrix<double, n>>(p.covariance.data());
        ASSERT_TRUE(is_positive_definite(covariance)) << algorithm << " at " << k;
        const Vector<double, n> error =
            Eigen::Map<const Vector<double, n>>(p.mean.data()) - j.truth[static_cast<std::size_t>(k)];
        nees += error.dot(covariance.llt().solve(error)) / (n * kSteps * kRuns);
      }
    }
    // 1 for an exact posterior; four runs whose errors last for many steps vary by about a half, and a thousand particles of
    // seven states are few.
    std::printf("%s: NEES %.3f\n", algorithm.c_str(), nees);
    EXPECT_GT(nees, 0.3) << algorithm;
    EXPECT_LT(nees, 2.5) << algorithm;
  }
}

TYPED_TEST(ParticlesOnModel, HaveTheSameBitsWithEveryRegister) {
  constexpr int kSteps = 40;
  const Journey<TypeParam> j = journey<TypeParam>(kSteps, 5);
  for (const std::string algorithm : kAlgorithms) {
    std::vector<std::vector<double>> results;
    for (const int at_most : {2, 4, 8}) {
      widest_detail::at_most = at_most;
      const auto pf = make<TypeParam>(algorithm, 333, 0.7, "systematic", 1);
      pf->start_given();
      std::vector<double> all;
      for (int k = 0; k < kSteps; ++k) {
        step_along(*pf, j, k);
        const std::vector<double> now = numbers(pf->posterior());
        all.insert(all.end(), now.begin(), now.end());
      }
      results.push_back(all);
    }
    widest_detail::at_most = 8;
    EXPECT_EQ(results[0], results[1]) << algorithm;
    EXPECT_EQ(results[0], results[2]) << algorithm;
  }
}

// Positions given speed and heading are linear: what is not drawn does not vary from seed to seed.
TEST(RaoBlackwellised, VariesLessThanSirOnAPointMass) {
  constexpr int kSteps = 60, kFilters = 40;
  using M = PointMassMotion;
  const Journey<M> j = journey<M>(kSteps, 11);
  std::array<std::array<double, 4>, 2> variance{};
  for (const std::size_t which : {0U, 1U}) {
    std::array<std::vector<double>, 4> sum{}, squares{};
    for (std::size_t s = 0; s < 4; ++s) sum[s].assign(kSteps, 0.0), squares[s].assign(kSteps, 0.0);
    for (std::uint64_t seed = 1; seed <= kFilters; ++seed) {
      const auto pf = make<M>(which == 0 ? "pf" : "rbpf", 300, 0.5, "systematic", seed);
      pf->start_given();
      for (int k = 0; k < kSteps; ++k) {
        step_along(*pf, j, k);
        for (std::size_t s = 0; s < 4; ++s) {
          const double off = pf->posterior().mean[s] - j.truth[static_cast<std::size_t>(k)][static_cast<int>(s)];
          sum[s][static_cast<std::size_t>(k)] += off / kFilters;
          squares[s][static_cast<std::size_t>(k)] += off * off / kFilters;
        }
      }
    }
    for (std::size_t s = 0; s < 4; ++s)
      for (std::size_t k = 0; k < kSteps; ++k) variance[which][s] += (squares[s][k] - sum[s][k] * sum[s][k]) / kSteps;
  }
  for (std::size_t s = 0; s < 4; ++s) {
    std::printf("state %zu: variance over seeds, SIR %.3g, RBPF %.3g\n", s, variance[0][s], variance[1][s]);
    EXPECT_LT(variance[1][s], variance[0][s]) << s;
  }
}

}  // namespace
}  // namespace slipstream::test
