// What holds for all particle filters: against the Kalman filter, and when things go wrong; and what each is for.
#include <gtest/gtest.h>

#include <memory>

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
ParticleSettings of(int particles, double resample_below = 0.5, Resampling method = Resampling::kSystematic,
                    bool recover = true) {
  return {particles, method, resample_below, recover};
}
std::uint32_t some_outputs(int k) { return k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U; }

// --- Against the Kalman filter ----------------------------------------------------------------------------------------

struct Deviations {
  std::array<Spread, 2> mean, variance;  // over all filters and steps, in the exact posterior's deviation and variance
};
template <typename M>
Deviations from_kalman(const std::string& algorithm, const Belief<M>& b, const ParticleSettings& settings, int filters,
                       int steps, bool position_only = false) {
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

// The speed is not measured, and the position is, far better than it can be predicted; the noise of a step is small beside
// both: most that SIR draws is drawn in vain.
TEST(AuxiliaryParticleFilter, ErrsLessThanSirWhereAMeasurementIsPreciseBesideThePrediction) {
  Belief<LinearModel> b = linear_belief();
  b.noise = {{{0.0, 0.02}, {0.0, 1.0}}};
  b.process_variance = {1e-2, 4.0};
  const Deviations sir = from_kalman("pf", b, of(500, 1.0), 40, 60, true),
                   asir = from_kalman("asir", b, of(500, 1.0), 40, 60, true);
  std::printf("RMS deviation from Kalman, 500 particles: SIR %.4f %.4f, ASIR %.4f %.4f\n", sir.mean[0].rms(), sir.mean[1].rms(),
              asir.mean[0].rms(), asir.mean[1].rms());
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LE(asir.mean[i].rms(), sir.mean[i].rms()) << i;
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
    EXPECT_NEAR(pf->posterior().mean[0], 10.0, 0.05) << algorithm;                // 6 standard errors of the start's spread
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
