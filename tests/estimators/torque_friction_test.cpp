// Friction that follows the torque, over seeds 1 to 20: no lag at the gear changes, a right start, an unknown hill, an unknown
// load with braking. The tuning was chosen on seeds from 1000.
#include <gtest/gtest.h>

#include "io/scenario_reader.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

struct Summary {
  double r2_friction = 0.0, r2_wheel_speed = 0.0, nees = 0.0;  // medians
  double at_torque_steps = 0.0;  // largest |error| of friction over its own sigma around them, of all runs
  double start = 0.0;            // largest |error| of friction from 0.1 s to 0.5 s over the friction there, of all runs
  double mass_error = 0.0, mass_sigma = 0.0;  // root mean square at the end; mean sigma
  std::size_t fallbacks = 0;
};

double median_of(const std::vector<double>& v) { return median(v); }

Summary summarise(const std::string& file, const std::string& algorithm, int seeds) {
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + file).scenario;
  Summary s;
  std::vector<double> r2_friction, r2_wheel, nees;
  for (int seed = 1; seed <= seeds; ++seed) {
    scenario.run.seed = static_cast<std::uint64_t>(seed);
    const Played p = play(scenario, algorithm, "matched");
    const std::size_t n = p.estimates.front().mean.size();
    const std::vector<double> mu = p.truth_of("friction"), torque = p.truth_of("drive_torque_nm");
    r2_friction.push_back(score_state(mu, p.estimate_of(2)).r2);
    r2_wheel.push_back(score_state(p.truth_of("wheel_speed_radps"), p.estimate_of(0)).r2);
    const std::array<std::vector<double>, 5> truth{p.truth_of("wheel_speed_radps"), p.truth_of("speed_mps"), mu,
                                                   p.truth_of("grade"), p.truth_of("mass_kg")};
    double sum = 0.0;
    for (std::size_t k = 0; k < p.estimates.size(); ++k) {
      const Estimate& e = p.estimates[k];
      std::vector<double> error;
      for (std::size_t i = 0; i < n; ++i) error.push_back(e.mean[i] - truth[i][k]);
      sum += normalised_square(error, e.covariance);
      const double sigma = std::sqrt(e.covariance[2 * n + 2]);
      constexpr double kStep_nm = 100.0;  // between two samples; within a gear it changes by some 10 N m
      for (std::size_t j = k > 5 ? k - 4 : 2; j <= k; ++j)
        if (std::abs(torque[j] - torque[j - 1]) > kStep_nm)
          s.at_torque_steps = std::max(s.at_torque_steps, std::abs(error[2]) / sigma);
      if (k >= 10 && k <= 50) s.start = std::max(s.start, std::abs(error[2]) / mu[k]);
    }
    nees.push_back(sum / static_cast<double>(p.estimates.size()));
    if (n == 5) {
      const double off = p.estimates.back().mean[4] - truth[4].back();
      s.mass_error += off * off / seeds;
      s.mass_sigma += std::sqrt(p.estimates.back().covariance[24]) / seeds;
    }
    s.fallbacks += p.fallbacks();
  }
  s.r2_friction = median_of(r2_friction), s.r2_wheel_speed = median_of(r2_wheel), s.nees = median_of(nees);
  s.mass_error = std::sqrt(s.mass_error);
  std::printf(
      "%s, %s: R2 mu %.6f w %.6f, NEES %.3f of %s, steps %.2f sigma, start %.4f, mass %.2f kg (sigma %.2f), fallbacks %zu\n",
      file.c_str(), algorithm.c_str(), s.r2_friction, s.r2_wheel_speed, s.nees, s.mass_sigma > 0.0 ? "5" : "3",
      s.at_torque_steps, s.start, s.mass_error, s.mass_sigma, s.fallbacks);
  return s;
}

// The bars of the bench: no error at a gear change beyond three sigma, and the transient of the start gone within 0.1 s, which
// is taken as 5 % of the friction for every later sample of the first half second.
void expect_no_transients(const Summary& s) {
  EXPECT_LE(s.at_torque_steps, 3.0);
  EXPECT_LE(s.start, 0.05);
  EXPECT_EQ(s.fallbacks, 0U);
}

TEST(TorqueFriction, FivePerCent) {
  for (const char* algorithm : {"ekf", "ukf"}) {
    const Summary s = summarise("unimog_torque.toml", algorithm, 20);
    EXPECT_GE(s.r2_friction, 0.998);
    EXPECT_GE(s.r2_wheel_speed, 0.999);  // not worse than longitudinal_friction
    expect_no_transients(s);
    EXPECT_GT(s.nees, 1.0);  // cautious, a third of its dimension: friction's sigma must cover a gear change between samples
    EXPECT_LT(s.nees, 3.6);  // 20 % above its dimension
  }
}

TEST(TorqueFriction, TenPerCent) {
  const Summary s = summarise("unimog_torque_10.toml", "ekf", 20);
  EXPECT_GE(s.r2_friction, 0.995);
  expect_no_transients(s);
  EXPECT_GT(s.nees, 1.0);
  EXPECT_LT(s.nees, 3.6);
}

// The other algorithms know the model, too. Few seeds: they are slow, and these bars are met with room. A plain particle
// filter's sigma of the speeds is too small here: their process noise is far below what a thousand particles resolve.
TEST(TorqueFriction, AllAlgorithms) {
  for (const char* algorithm : {"mhe", "pf", "rbpf"}) {
    const Summary s = summarise("unimog_torque.toml", algorithm, 2);
    EXPECT_GE(s.r2_friction, 0.998) << algorithm;
    EXPECT_LE(s.start, 0.05) << algorithm;
  }
}

TEST(TorqueFriction, UnknownHill) {
  const Summary s = summarise("unimog_grade.toml", "ekf", 20);
  EXPECT_GE(s.r2_friction, 0.99);
  expect_no_transients(s);
  EXPECT_NEAR(s.nees, 5.0, 2.5);  // half of its dimension: the grade's errors last for seconds, a run has few independent ones
}

// 600 kg more than believed, up the hill, braking to 2 m/s and away again.
TEST(TorqueFriction, UnknownLoadAndBraking) {
  const Summary s = summarise("unimog_load.toml", "ekf", 20);
  EXPECT_GE(s.r2_friction, 0.99);
  EXPECT_LE(s.at_torque_steps, 3.0);
  EXPECT_LE(s.mass_error, 20.0);                // from 600 kg
  EXPECT_LE(s.mass_error, 2.0 * s.mass_sigma);  // and it says so: 20 runs give the ratio to a sixth
  EXPECT_NEAR(s.nees, 5.0, 2.5);
}

}  // namespace
}  // namespace slipstream::test
