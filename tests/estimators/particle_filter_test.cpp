// The particle filter against the Kalman filter, its parts against closed forms, and the Unimog of document 002, section 7.1.
#include "estimators/particle_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "estimators/ekf.hpp"
#include "io/scenario_reader.hpp"
#include "tests/estimators/linear_drive.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

ParticleFilter<LinearModel> filter(const Belief<LinearModel>& b, int particles, double resample_below, std::uint64_t seed = 1) {
  return {b, {particles, Resampling::kSystematic, resample_below, true}, RandomStream(seed, 0, "estimator.pf")};
}

// The Kalman filter is the EKF, which kalman_test holds against a textbook filter. Deviations are in the posterior's sigma.
TEST(ParticleFilter, IsTheKalmanFilterOnALinearModel) {
  const Belief<LinearModel> b = calm_belief();
  constexpr int kSteps = 60, kFilters = 40, kParticles = 2000;
  constexpr double kBias = 10.0 / kParticles;
  const Drive d = drive(kSteps, b, 7);
  for (const double resample_below : {1.0, 0.5}) {
    Ekf<LinearModel> kalman(b);
    kalman.start_given();
    std::vector<ParticleFilter<LinearModel>> filters;
    for (std::uint64_t seed = 1; seed <= kFilters; ++seed) {
      filters.push_back(filter(b, kParticles, resample_below, seed));
      filters.back().start_given();
    }
    std::array<Spread, 2> errors, spreads;  // of all steps
    for (int k = 0; k < kSteps; ++k) {
      const std::uint32_t measured = k % 5 == 3 ? 1U : k % 7 == 2 ? 2U : k % 11 == 9 ? 0U : 3U;
      step(kalman, k, d.z[static_cast<std::size_t>(k)], measured);
      const Posterior exact = kalman.posterior();
      std::array<Spread, 2> mean, variance, low, high, innovation, s;
      for (ParticleFilter<LinearModel>& pf : filters) {
        step(pf, k, d.z[static_cast<std::size_t>(k)], measured);
        const Posterior p = pf.posterior();
        ASSERT_EQ(p.status, EstimateStatus::kValid);
        for (std::size_t i = 0; i < 2; ++i) {
          const double sigma = std::sqrt(exact.covariance[3 * i]), sigma_z = std::sqrt(exact.innovation_covariance[3 * i]);
          mean[i].values.push_back((p.mean[i] - exact.mean[i]) / sigma);
          variance[i].values.push_back(p.covariance[3 * i] / exact.covariance[3 * i] - 1.0);
          low[i].values.push_back((p.interval_low[i] - exact.mean[i]) / sigma + 2.5758293);  // of the normal's 0.5 %
          high[i].values.push_back((p.interval_high[i] - exact.mean[i]) / sigma - 2.5758293);
          innovation[i].values.push_back((p.innovation[i] - exact.innovation[i]) / sigma_z);
          s[i].values.push_back(p.innovation_covariance[3 * i] / exact.innovation_covariance[3 * i] - 1.0);
        }
      }
      for (std::size_t i = 0; i < 2; ++i) {
        errors[i].values.insert(errors[i].values.end(), mean[i].values.begin(), mean[i].values.end());
        spreads[i].values.insert(spreads[i].values.end(), variance[i].values.begin(), variance[i].values.end());
        mean[i].expect_zero(kBias, "mean", k);
        variance[i].expect_zero(kBias, "variance", k);
        low[i].expect_zero(kBias, "low", k);
        high[i].expect_zero(kBias, "high", k);
        innovation[i].expect_zero(kBias, "innovation", k);
        s[i].expect_zero(kBias, "S", k);
      }
    }
    // The mean of N independent draws errs by sigma/sqrt(N), their variance by sqrt(2/N) of itself; weights, and errors of
    // earlier steps that are not yet forgotten, double that. Over all steps: after one surprising measurement few particles
    // count.
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT(errors[i].rms(), 4.0 / std::sqrt(kParticles));
      EXPECT_LT(spreads[i].rms(), 4.0 * std::sqrt(2.0 / kParticles));
    }
  }
}

TEST(ParticleFilter, TheIntervalCoversWhatItSays) {
  const Belief<LinearModel> b = linear_belief();
  int inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Drive d = drive(100, b, seed);
    ParticleFilter<LinearModel> pf = filter(b, 1000, 0.5, seed);
    pf.start_given();
    for (int k = 0; k < 100; ++k) {
      const auto at = static_cast<std::size_t>(k);
      step(pf, k, d.z[at]);
      const Posterior p = pf.posterior();
      for (std::size_t i = 0; i < 2; ++i) {
        const double x = d.truth[at][static_cast<int>(i)];
        inside += p.interval_low[i] <= x && x <= p.interval_high[i] ? 1 : 0;
        ++all;
      }
    }
  }
  // 8000 cases, neighbours alike: some 1600 that are independent, whose share has a deviation of 0.0025; three of them.
  EXPECT_NEAR(static_cast<double>(inside) / all, 0.99, 0.0075);
}

TEST(ParticleFilter, ResamplesBelowTheFractionOnly) {
  const Belief<LinearModel> b = linear_belief();
  const Drive d = drive(2, b, 3);
  Belief<LinearModel> vague = b;
  vague.noise = {{{0.0, 100.0}, {0.0, 100.0}}};
  const auto two_steps = [&](const Belief<LinearModel>& belief, double resample_below) {
    ParticleFilter<LinearModel> pf = filter(belief, 500, resample_below);
    pf.start_given();
    std::array<std::vector<double>, 2> result;
    for (int k = 0; k < 2; ++k) {
      step(pf, k, {d.z[static_cast<std::size_t>(k)][0] + 0.6, d.z[static_cast<std::size_t>(k)][1] - 0.6});
      result[static_cast<std::size_t>(k)] = numbers(pf.posterior());
    }
    return result;
  };
  constexpr double kNever = 1e-9;  // N_eff is at least 1
  const auto always = two_steps(b, 1.0), never = two_steps(b, kNever);
  EXPECT_EQ(always[0], never[0]);  // an estimate is made before its resampling
  EXPECT_NE(always[1], never[1]);
  EXPECT_EQ(two_steps(b, 0.95), always);                       // off by some deviations: N_eff is well below 0.95 N
  EXPECT_EQ(two_steps(vague, 0.5), two_steps(vague, kNever));  // a measurement that says nothing leaves N_eff at N
  EXPECT_NE(two_steps(vague, 1.0), two_steps(vague, kNever));
}

TEST(ParticleFilter, TheSeedDecidesEveryBit) {
  const Belief<LinearModel> b = linear_belief();
  const Drive d = drive(20, b, 3);
  const auto played = [&](std::uint64_t seed) {
    ParticleFilter<LinearModel> pf = filter(b, 333, 0.5, seed);  // odd: the last draw has no partner
    pf.start_given();
    for (int k = 0; k < 20; ++k) step(pf, k, d.z[static_cast<std::size_t>(k)]);
    return numbers(pf.posterior());
  };
  EXPECT_EQ(played(5), played(5));
  EXPECT_NE(played(5), played(6));
}

TEST(ParticleFilter, AMeasurementBeyondAllParticlesUnderflowsNothing) {
  const Belief<LinearModel> b = linear_belief();
  ParticleFilter<LinearModel> pf(b, {200, Resampling::kSystematic, 0.5, false}, RandomStream(1, 0, "estimator.pf"));
  pf.start_given();
  step(pf, 1, {0.5 + 1500.0 * 0.3, -0.2}, 1U);  // 1500 sigma off: likelihoods of about exp(-1.1e6)
  const Posterior p = pf.posterior();
  EXPECT_EQ(p.status, EstimateStatus::kFallback);  // one particle takes all
  for (const double x : numbers(p)) EXPECT_TRUE(std::isfinite(x));
  EXPECT_GT(p.mean[0], 0.5 + 0.2);  // the farthest of 200 draws of deviation 0.2, almost surely beyond one of it
}

// A set that is 100 deviations from what is measured finds it again at once, whatever its process noise would allow.
TEST(ParticleFilter, ALostSetIsDrawnAnewAroundWhatIsMeasured) {
  Belief<WheelFriction> b;
  b.noise = {{{0.0, 0.05}, {0.0, 1.0}}};
  b.process_variance = {1e-6, 1e-6};
  b.process_per_step = true;
  b.initial_mean = {1.0, 0.1};
  b.initial_variance = {1e-4, 1e-2};
  ParticleFilter<WheelFriction> pf(b, {1000, Resampling::kSystematic, 1.0, true}, RandomStream(1, 0, "estimator.pf"));
  pf.start_given();
  const double grip_nm = b.model.wheel.quarter.normal_force_n() * b.model.wheel.quarter.wheel_radius_m;
  const std::array<double, 1> u{(0.1 + b.model.wheel.quarter.rolling_resistance) * grip_nm};  // holds the wheel's speed
  for (int k = 0; k < 5; ++k) pf.step({k == 0 ? 0.0 : 0.01, u, std::array<double, 2>{1.0, 0.0}, 1U});
  EXPECT_EQ(pf.posterior().status, EstimateStatus::kValid);
  EXPECT_NEAR(pf.posterior().mean[0], 1.0, 0.2);  // 4 deviations of the sensor
  pf.step({0.01, u, std::array<double, 2>{6.0, 0.0}, 1U});
  EXPECT_EQ(pf.posterior().status, EstimateStatus::kFallback);
  EXPECT_NEAR(pf.posterior().innovation[0], 5.0, 0.2) << "the surprise is published";
  // The start's variance and the sensor's, each once: 1e-4 + 0.05^2 for the speed, 1e-2 for the friction. A sample variance of
  // 1000 draws is within 5 sqrt(2 / 1000) = 22 % of that.
  EXPECT_NEAR(pf.posterior().mean[0], 6.0, 0.01);  // 6 standard errors of the mean
  EXPECT_NEAR(pf.posterior().covariance[0], 2.6e-3, 0.22 * 2.6e-3);
  EXPECT_NEAR(pf.posterior().covariance[3], 1e-2, 0.22 * 1e-2);
  pf.step({0.01, u, std::array<double, 2>{6.0, 0.0}, 1U});
  EXPECT_EQ(pf.posterior().status, EstimateStatus::kValid);
}

TEST(ParticleFilter, WhenAllWeightsVanishThePredictionStands) {
  const Belief<LinearModel> b = linear_belief();
  ParticleFilter<LinearModel> with = filter(b, 200, 0.5), without = filter(b, 200, 0.5);
  with.start_given();
  without.start_given();
  step(with, 0, {1e200, 0.0}, 1U);  // its squared distance is beyond all doubles
  step(without, 0, {0.0, 0.0}, 0U);
  EXPECT_EQ(with.posterior().status, EstimateStatus::kFallback);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(with.posterior().mean[i], without.posterior().mean[i]);
  step(with, 1, {0.5, -0.2});
  EXPECT_EQ(with.posterior().status, EstimateStatus::kValid);
}

TEST(ParticleFilter, OneParticleHasTheSpreadOfOneStep) {
  const Belief<LinearModel> b = linear_belief();
  ParticleFilter<LinearModel> pf = filter(b, 1, 1.0);
  pf.start_given();
  step(pf, 1, {0.5, -0.2});
  EXPECT_EQ(pf.posterior().status, EstimateStatus::kFallback);
  EXPECT_EQ(pf.posterior().covariance[0], 1e-2 * kDt);
  EXPECT_EQ(pf.posterior().covariance[3], 2e-1 * kDt);
}

TEST(ParticleFilter, AnInputThatIsNotANumberMakesTheEstimateInvalid) {
  ParticleFilter<LinearModel> pf = filter(linear_belief(), 100, 0.5);
  pf.start_given();
  const double u = std::numeric_limits<double>::quiet_NaN();
  pf.step({kDt, {&u, 1}, std::array<double, 2>{0.5, -0.2}, 3U});
  EXPECT_EQ(pf.posterior().status, EstimateStatus::kInvalid);
}

TEST(ParticleFilter, StartOnTheMoveTakesTheMeasurementAndItsNoise) {
  constexpr int kParticles = 20000;
  ParticleFilter<LinearModel> pf = filter(linear_belief(), kParticles, 0.5);
  ASSERT_TRUE(pf.start_measured(1, 3.0));
  step(pf, 0, {0.0, 0.0}, 0U);
  const double variance = 0.09 + 0.2 * 0.2;
  EXPECT_NEAR(pf.posterior().mean[1], 3.0, 4.0 * std::sqrt(variance / kParticles));              // four deviations of a mean
  EXPECT_NEAR(pf.posterior().covariance[3] / variance, 1.0, 4.0 * std::sqrt(2.0 / kParticles));  // and of a variance
}

// p(z | h) ~ exp(-(z - h)^2 / (2 rel^2 h^2)) / h by hand, of 20000 particles whose h is uniform enough to integrate over:
// h ~ N(10, 4) a priori, z = 12, rel = 0.5; the posterior's mean by quadrature.
TEST(ParticleFilter, RelativeNoiseIsWeighedAtEachParticle) {
  Belief<LinearModel> b = linear_belief();
  b.noise = {{{0.5, 0.0}, {0.0, 1.0}}};
  b.initial_mean = {10.0, 0.0};
  b.initial_variance = {4.0, 1e-6};
  double sum = 0.0, first = 0.0, second = 0.0;
  for (double h = 0.5; h < 20.0; h += 0.01) {
    const double p = std::exp(-0.5 * (h - 10.0) * (h - 10.0) / 4.0 - 0.5 * (12.0 - h) * (12.0 - h) / (0.25 * h * h)) / h;
    sum += p, first += p * h, second += p * h * h;
  }
  const double mean = first / sum, variance = second / sum - mean * mean;
  constexpr int kParticles = 200000;
  ParticleFilter<LinearModel> pf = filter(b, kParticles, 0.5);
  pf.start_given();
  step(pf, 0, {12.0, 0.0}, 1U);
  EXPECT_NEAR(pf.posterior().mean[0], mean, 8.0 * std::sqrt(variance / kParticles));  // twice four deviations: weights differ
  EXPECT_NEAR(pf.posterior().covariance[0], variance, 8.0 * variance * std::sqrt(2.0 / kParticles));
}

struct Medians {
  double rmse_friction, rmse_wheel_speed, nis, covered;
};
Medians unimog_medians(const std::string& tuning) {
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/unimog_pf.toml").scenario;
  std::array<std::vector<double>, 4> values;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    scenario.run.seed = seed;
    const Played played = play(scenario, "pf", tuning);
    EXPECT_EQ(played.estimates.size(), 1001U);  // 10 s at 100 Hz, both ends
    const std::vector<double> friction = played.truth_of("friction");
    values[0].push_back(score_state(friction, played.estimate_of(1)).rmse);
    values[1].push_back(score_state(played.truth_of("wheel_speed_radps"), played.estimate_of(0)).rmse);
    values[2].push_back(score_consistency(played.nis(), 1).mean);
    double covered = 0.0;
    for (std::size_t k = 0; k < friction.size(); ++k) {
      const Estimate& e = played.estimates[k];
      if (e.interval_low.size() == 2U)
        covered += e.interval_low[1] <= friction[k] && friction[k] <= e.interval_high[1] ? 1.0 : 0.0;
    }
    values[3].push_back(covered / static_cast<double>(friction.size()));
  }
  const Medians m{median(values[0]), median(values[1]), median(values[2]), median(values[3])};
  std::printf("PF %s: RMSE mu %.5f w %.4f, NIS %.3f, interval of mu covers %.4f\n", tuning.c_str(), m.rmse_friction,
              m.rmse_wheel_speed, m.nis, m.covered);
  return m;
}

// Document 002, Table 4: the step of the friction on snow, median over seeds 1 to 20, and a matched filter below 0.015.
double snow_rmse(int particles, const std::string& tuning) {
  std::vector<double> rmse;
  for (int seed = 1; seed <= 20; ++seed) {
    Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/snow_step.toml", {}).scenario;
    scenario.run.seed = static_cast<std::uint64_t>(seed);
    scenario.estimator.tunings.at(tuning).pf_particles = particles;
    const Played played = play(scenario, "pf", tuning);
    rmse.push_back(score_state(played.truth_of("friction"), played.estimate_of(1)).rmse);
  }
  return median(rmse);
}
TEST(SnowParticleFilter, TableFour) {
  EXPECT_LE(snow_rmse(20, "document"), 0.0321);
  EXPECT_LE(snow_rmse(1000, "document"), 0.0220);
  EXPECT_LE(snow_rmse(5000, "document"), 0.0218);
  EXPECT_LT(snow_rmse(1000, "matched"), 0.015);
}

TEST(UnimogParticleFilter, DocumentTuning) {
  const Medians m = unimog_medians("document");
  EXPECT_LE(m.rmse_friction, 0.0085);   // the bar; published: 0.01
  EXPECT_LE(m.rmse_wheel_speed, 0.45);  // the bar; published: 0.51
}

TEST(UnimogParticleFilter, MatchedTuningIsBetter) {
  const Medians m = unimog_medians("matched");
  EXPECT_LE(m.rmse_friction, 0.0085);  // the bar
  EXPECT_LE(m.rmse_wheel_speed, 0.45);
  const Medians document = unimog_medians("document");
  EXPECT_LT(m.rmse_friction, document.rmse_friction);
  EXPECT_LT(m.rmse_wheel_speed, document.rmse_wheel_speed);
  EXPECT_NEAR(m.nis, 1.0, 0.2);        // 20 % of its dimension
  EXPECT_NEAR(m.covered, 0.99, 0.02);  // friction is no random walk: its jumps at gear changes cost a per cent or two
}

}  // namespace
}  // namespace slipstream::test
