// The bound against filters on the point mass, whose model is the plant's own: reached by the EKF, and by none beaten on
// average.
#include "monitor/bound.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "io/scenario_reader.hpp"
#include "studies/play.hpp"

namespace slipstream {
namespace {

// Mean and standard error of independent values.
struct Sample {
  double sum = 0.0, squares = 0.0;
  int n = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
    ++n;
  }
  double mean() const { return sum / n; }
  double error() const { return std::sqrt((squares / n - mean() * mean()) / (n - 1)); }
};

// A step of the steering a microsecond before a sample, instead of the ramp: an input that is held between its messages tells
// it as it is. Of the ramp it is told half a sample late, 6e-3 rad of heading, where that is known to 1e-4.
const std::vector<std::string> kTold{"vehicle.steering_time_s=[0.0, 0.999999, 0.999999]",
                                     "vehicle.steering_rad=[0.01, 0.01, -0.01]"};

// `claim`: how far what the filter claims, the bound with Jacobians at its own estimates, may be from the bound.
void expect_reached_not_beaten(std::vector<std::string> overrides, double claim, bool with_particles) {
  constexpr int kRuns = 200;
  overrides.insert(overrides.end(), kTold.begin(), kTold.end());
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/point_mass.toml", overrides).scenario;
  std::vector<Sample> excess(4), of_pf(4), bounds(4), claimed(4);  // of each state, a value a run: sums over the instants
  std::vector<std::string> states;
  for (int run = 0; run < kRuns; ++run) {
    scenario.run.seed = static_cast<std::uint64_t>(1000 + run);
    std::vector<Follower> followers{{"ekf", "matched", ""}};
    if (with_particles) followers.push_back({"pf", "matched", ""});
    const Played played = play(scenario, followers);
    const Bound bound = posterior_bound(scenario, true_run(played));
    ASSERT_TRUE(std::holds_alternative<BoundSeries>(bound)) << std::get<std::string>(bound);
    const auto& series = std::get<BoundSeries>(bound);
    const Track& track = played.tracks[0];
    ASSERT_EQ(series.utime, track.utime);  // measured at every sample of the truth
    states = track.states;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const std::vector<double> error = played.error(0, states[i]), pf_error = played.error(with_particles ? 1 : 0, states[i]);
      double e2 = 0.0, pf_e2 = 0.0, b = 0.0, P = 0.0;
      for (std::size_t k = 0; k < error.size(); ++k) {
        e2 += error[k] * error[k];
        pf_e2 += pf_error[k] * pf_error[k];
        b += series.of(states[i])->at(k);
        P += track.sigma[i][k] * track.sigma[i][k];
      }
      excess[i].add(e2 - b);
      of_pf[i].add(pf_e2 - b);
      bounds[i].add(b);
      claimed[i].add(P);
    }
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double above = excess[i].mean() / bounds[i].mean(), se = excess[i].error() / bounds[i].mean();
    std::printf("%-12s mean squared error %+.2f %% +- %.2f of the bound, claimed %+.3f %%\n", states[i].c_str(), 100.0 * above,
                100.0 * se, 100.0 * (claimed[i].mean() / bounds[i].mean() - 1.0));
    EXPECT_GE(above, -3.0 * se) << states[i];        // chance: 0.1 % a state
    EXPECT_LE(above, 0.02 + 3.0 * se) << states[i];  // almost linear: nothing is lost, but for the same chance
    EXPECT_GE(of_pf[i].mean(), -3.0 * of_pf[i].error()) << "pf, " << states[i];
    EXPECT_NEAR(claimed[i].mean(), bounds[i].mean(), claim * bounds[i].mean()) << states[i];
  }
}

// Speed and heading are known to 0.01 m/s and 1e-4 rad: Jacobians at the estimate are those at the truth.
TEST(Bound, IsReachedByTheEkfAndNotBeatenOnAverage) { expect_reached_not_beaten({}, 0.005, true); }

// A start that has to be found, and a relative noise. The EKF does not use what the variance tells of the value: at 60 m/s and
// 5 % the information is 1/(3 m/s)^2 + 2/(60 m/s)^2, 0.5 % more than its own. The rest is where the Jacobians are taken. The
// plain particle filter is not for this start: speed and heading, which nothing pushes, leave 300 particles no choice, and it
// dies.
TEST(Bound, IsReachedFromAnUncertainStartToo) {
  expect_reached_not_beaten(
      {"plant.start_deviation={ east_m = 5.0, north_m = 5.0, speed_mps = 3.0, heading_rad = 0.1 }",
       "tuning.matched.initial_variance={ east_m = 25.0, north_m = 25.0, speed_mps = 9.0, heading_rad = 0.01 }",
       "sensor.forward_speed.noise_mps=0.0", "sensor.forward_speed.noise_percent=5.0"},
      0.02, false);
}

}  // namespace
}  // namespace slipstream
