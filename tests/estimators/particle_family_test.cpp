// What holds for all particle filters: against the Kalman filter, on every process model, with every register's width, and when
// things go wrong; and what each is for.
#include <gtest/gtest.h>

#include <memory>

#include "common/widest.hpp"
#include "estimators/asir.hpp"
#include "estimators/ekf.hpp"
#include "estimators/particle_filter.hpp"
#include "estimators/rbpf.hpp"
#include "tests/estimators/linear_drive.hpp"

namespace slipstream::test {
namespace {

// The linear model whose position alone counts as linear: its speed is drawn.
struct HalfDrawn : LinearModel {
  static constexpr std::array<bool, kStates> kLinear{true, false};
};
static_assert(ProcessModel<HalfDrawn>);

constexpr const char* kAlgorithms[] = {"pf", "asir", "rbpf"};

template <typename M>
std::unique_ptr<Estimator> make(const std::string& algorithm, const Belief<M>& b, const ParticleSettings& settings,
                                std::uint64_t seed = 1) {
  const RandomStream random(seed, 0, "estimator." + algorithm);
  if (algorithm == "pf") return std::make_unique<ParticleFilter<M>>(b, settings, random);
  if (algorithm == "asir") return std::make_unique<AuxiliaryParticleFilter<M>>(b, settings, random);
  return std::make_unique<RaoBlackwellisedFilter<M>>(b, settings, random);
}
ParticleSettings of(int particles, double resample_below = 0.5, Resampling method = Resampling::kSystematic, bool recover = true) {
  return {particles, method, resample_below, recover};
}
std::uint32_t some_outputs(int k) { return k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U; }

// --- Against the Kalman filter ----------------------------------------------------------------------------------------

struct Deviations {
  std::array<Spread, 2> mean, variance;  // over all filters and steps, in the exact posterior's deviation and variance
};
template <typename M>
Deviations from_kalman(const std::string& algorithm, const Belief<M>& b, const ParticleSettings& settings, int filters, int steps,
                       bool position_only = false) {
  const Drive d = drive(steps, b, 7);
  Deviations all;
  for (int seed = 1; seed <= filters; ++seed) {
    Ekf<M> kalman(b);
    const auto pf = make(algorithm, b, settings, static_cast<std::uint64_t>(seed));
    kalman.start_given();
    pf->start_given();
    for (int k = 0; k < steps; ++k) {
      const std::uint32_t measured = position_only ? 1U : some_outputs(k);
      step(kalman, k, d.z[static_cast<std::size_t>(k)], measured);
      step(*pf, k, d.z[static_cast<std::size_t>(k)], measured);
      const Posterior exact = kalman.posterior(), p = pf->posterior();
      EXPECT_EQ(p.status, EstimateStatus::kValid);
      for (std::size_t i = 0; i < 2; ++i) {
        all.mean[i].values.push_back((p.mean[i] - exact.mean[i]) / std::sqrt(exact.covariance[3 * i]));
        all.variance[i].values.push_back(p.covariance[3 * i] / exact.covariance[3 * i] - 1.0);
      }
    }
  }
  return all;
}

TEST(ParticleFamily, IsTheKalmanFilterOnALinearModel) {
  constexpr int kParticles = 2000;
  for (const std::string algorithm : kAlgorithms)
    for (const Resampling method : {Resampling::kSystematic, Resampling::kStratified, Resampling::kResidual})
      for (const double resample_below : {1.0, 0.5}) {
        const Deviations d = from_kalman(algorithm, calm_belief<HalfDrawn>(), of(kParticles, resample_below, method), 10, 60);
        for (std::size_t i = 0; i < 2; ++i) {
          // The law: four deviations of a mean of N draws, and of their variance.
          EXPECT_LT(d.mean[i].rms(), 4.0 / std::sqrt(kParticles)) << algorithm << i;
          EXPECT_LT(d.variance[i].rms(), 4.0 * std::sqrt(2.0 / kParticles)) << algorithm << i;
          // No bias: some 60 forgetful steps of 10 filters, neighbours alike; a bias that falls with 1/N.
          EXPECT_LT(std::abs(d.mean[i].mean()), 5.0 * d.mean[i].rms() / std::sqrt(100.0) + 10.0 / kParticles) << algorithm << i;
        }
      }
}

TEST(ParticleFamily, TheInnovationIsTheKalmanFilters) {
  constexpr int kParticles = 20000;
  const Belief<HalfDrawn> b = calm_belief<HalfDrawn>();
  const Drive d = drive(30, b, 9);
  for (const std::string algorithm : kAlgorithms) {
    Ekf<HalfDrawn> kalman(b);
    const auto pf = make(algorithm, b, of(kParticles));
    kalman.start_given();
    pf->start_given();
    for (int k = 0; k < 30; ++k) {
      step(kalman, k, d.z[static_cast<std::size_t>(k)]);
      step(*pf, k, d.z[static_cast<std::size_t>(k)]);
      const Posterior exact = kalman.posterior(), p = pf->posterior();
      for (std::size_t i = 0; i < 2; ++i) {  // twice four deviations of a mean and of a variance: weights differ
        const double s = exact.innovation_covariance[3 * i];
        EXPECT_NEAR(p.innovation[i], exact.innovation[i], 8.0 * std::sqrt(s / kParticles)) << algorithm << k;
        EXPECT_NEAR(p.innovation_covariance[3 * i], s, 8.0 * s * std::sqrt(2.0 / kParticles)) << algorithm << k;
      }
      const double cross = std::sqrt(exact.innovation_covariance[0] * exact.innovation_covariance[3]);
      EXPECT_NEAR(p.innovation_covariance[1], exact.innovation_covariance[1], 8.0 * cross / std::sqrt(kParticles)) << algorithm;
    }
  }
}

TEST(RaoBlackwellised, IsTheKalmanFilterWhereAllStatesAreLinear) {
  const Belief<LinearModel> b = linear_belief();
  const Drive d = drive(200, b, 3);
  Ekf<LinearModel> kalman(b);
  RaoBlackwellisedFilter<LinearModel> rbpf(b, of(20), RandomStream(1, 0, "estimator.rbpf"));
  kalman.start_given();
  rbpf.start_given();
  for (int k = 0; k < 200; ++k) {
    step(kalman, k, d.z[static_cast<std::size_t>(k)], some_outputs(k));
    step(rbpf, k, d.z[static_cast<std::size_t>(k)], some_outputs(k));
    const Posterior exact = kalman.posterior(), p = rbpf.posterior();
    ASSERT_EQ(p.status, EstimateStatus::kValid);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(p.mean[i], exact.mean[i], 1e-10) << k;  // rounding, all the bars here
      EXPECT_NEAR(p.innovation[i], exact.innovation[i], 1e-10) << k;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(p.covariance[i], exact.covariance[i], 1e-10) << k;
      EXPECT_NEAR(p.innovation_covariance[i], exact.innovation_covariance[i], 1e-10) << k;
    }
  }
}

// --- What each is for -------------------------------------------------------------------------------------------------

TEST(RaoBlackwellised, ErrsLessThanSirWithAsManyParticles) {
  const Belief<HalfDrawn> b = linear_belief<HalfDrawn>();
  const Deviations sir = from_kalman("pf", b, of(200), 40, 60), rbpf = from_kalman("rbpf", b, of(200), 40, 60);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT(rbpf.mean[i].rms(), sir.mean[i].rms()) << i;
  std::printf("RMS deviation from Kalman, 200 particles: SIR %.4f %.4f, RBPF %.4f %.4f\n", sir.mean[0].rms(), sir.mean[1].rms(),
              rbpf.mean[0].rms(), rbpf.mean[1].rms());
}

// The speed is not measured, and the position is, far better than it can be predicted; the noise of a step is small beside both:
// most that SIR draws is drawn in vain.
TEST(AuxiliaryParticleFilter, ErrsLessThanSirWhereAMeasurementIsPreciseBesideThePrediction) {
  Belief<LinearModel> b = linear_belief();
  b.noise = {{{0.0, 0.02}, {0.0, 1.0}}};
  b.process_variance = {1e-2, 4.0};
  const Deviations sir = from_kalman("pf", b, of(500, 1.0), 40, 60, true), asir = from_kalman("asir", b, of(500, 1.0), 40, 60, true);
  std::printf("RMS deviation from Kalman, 500 particles: SIR %.4f %.4f, ASIR %.4f %.4f\n", sir.mean[0].rms(), sir.mean[1].rms(),
              asir.mean[0].rms(), asir.mean[1].rms());
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LE(asir.mean[i].rms(), sir.mean[i].rms()) << i;
}

// --- On every process model -------------------------------------------------------------------------------------------

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
    return {{}, {{{0.0, 1.0}, {0.0, 1.0}, {0.0, 0.3}}}, {1e-1, 1e-1, 1e-2, 1e-3}, false, {0.0, 0.0, 15.0, 0.5}, {1.0, 1.0, 0.1, 0.01}};
  }
  static Vector<double, 2> input(int k) { return {0.1, 0.05 * std::sin(0.05 * k)}; }
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

template <typename Variant>
struct Alternatives;
template <typename... Ts>
struct Alternatives<std::variant<Ts...>> {
  using Types = ::testing::Types<Ts...>;
};
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
      const auto pf = make(algorithm, Case<TypeParam>::belief(), of(particles, 0.5, Resampling::kStratified), seed);
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
      const auto pf = make(algorithm, Case<TypeParam>::belief(), of(333, 0.7));
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
      const auto pf = make(which == 0 ? "pf" : "rbpf", Case<M>::belief(), of(300), seed);
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

// --- When things go wrong ---------------------------------------------------------------------------------------------

TEST(ParticleFamily, ALostSetIsDrawnAnewAroundWhatIsMeasured) {
  Belief<HalfDrawn> b = linear_belief<HalfDrawn>();
  b.noise = {{{0.0, 0.05}, {0.0, 0.05}}};
  b.process_variance = {1e-6, 1e-6};
  for (const std::string algorithm : kAlgorithms) {
    const auto pf = make(algorithm, b, of(1000));
    pf->start_given();
    for (int k = 0; k < 5; ++k) step(*pf, k, {0.5, -0.2});
    EXPECT_EQ(pf->posterior().status, EstimateStatus::kValid) << algorithm;
    const double before = pf->posterior().mean[0];
    step(*pf, 5, {10.0, 0.0}, 1U);
    EXPECT_EQ(pf->posterior().status, EstimateStatus::kFallback) << algorithm;
    EXPECT_NEAR(pf->posterior().mean[0], 10.0, 0.05) << algorithm;               // 6 standard errors of the start's spread
    EXPECT_NEAR(pf->posterior().innovation[0], 10.0 - before, 0.2) << algorithm;  // the surprise is published
    step(*pf, 6, {10.0, 0.0}, 1U);
    EXPECT_EQ(pf->posterior().status, EstimateStatus::kValid) << algorithm;
    const auto plain = make(algorithm, b, of(1000, 0.5, Resampling::kSystematic, false));
    plain->start_given();
    for (int k = 0; k < 5; ++k) step(*plain, k, {0.5, -0.2});
    step(*plain, 5, {10.0, 0.0}, 1U);
    EXPECT_LT(plain->posterior().mean[0], 9.0) << algorithm << ": the plain algorithm does not jump";
  }
}

TEST(ParticleFamily, WhenAllWeightsVanishThePredictionStands) {
  const Belief<HalfDrawn> b = linear_belief<HalfDrawn>();
  for (const std::string algorithm : kAlgorithms) {
    const auto with = make(algorithm, b, of(200)), without = make(algorithm, b, of(200));
    with->start_given();
    without->start_given();
    step(*with, 0, {1e200, 0.0}, 1U);  // its squared distance is beyond all doubles
    step(*without, 0, {0.0, 0.0}, 0U);
    EXPECT_EQ(with->posterior().status, EstimateStatus::kFallback) << algorithm;
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(with->posterior().mean[i], without->posterior().mean[i]) << algorithm;
    step(*with, 1, {1e200, 0.0}, 1U);
    EXPECT_EQ(with->posterior().status, EstimateStatus::kFallback) << algorithm;
    step(*with, 2, {0.5, -0.2});
    EXPECT_EQ(with->posterior().status, EstimateStatus::kValid) << algorithm;
  }
}

TEST(ParticleFamily, AnInputThatIsNotANumberMakesTheEstimateInvalid) {
  for (const std::string algorithm : kAlgorithms) {
    const auto pf = make(algorithm, linear_belief<HalfDrawn>(), of(100));
    pf->start_given();
    const double u = std::numeric_limits<double>::quiet_NaN();
    pf->step({kDt, {&u, 1}, std::array<double, 2>{0.5, -0.2}, 3U});
    EXPECT_EQ(pf->posterior().status, EstimateStatus::kInvalid) << algorithm;
  }
}

TEST(ParticleFamily, OnlyParticlesThatArePointsGiveACredibleInterval) {
  for (const std::string algorithm : kAlgorithms) {
    const auto pf = make(algorithm, linear_belief<HalfDrawn>(), of(100));
    pf->start_given();
    step(*pf, 0, {0.5, -0.2});
    EXPECT_EQ(pf->posterior().interval_low.size(), algorithm == "rbpf" ? 0U : 2U);
    EXPECT_EQ(pf->posterior().interval_high.size(), algorithm == "rbpf" ? 0U : 2U);
  }
}

}  // namespace
}  // namespace slipstream::test
