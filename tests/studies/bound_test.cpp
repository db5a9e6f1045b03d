// The bound against filters on the point mass, whose model is the plant's own: reached, and not beaten on average.
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

TEST(Bound, IsReachedByTheEkfAndNotBeatenOnAverage) {
  constexpr int kRuns = 200;
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/point_mass.toml").scenario;
  std::vector<Sample> excess(4), squares(4), bounds(4), claimed(4);  // of each state, a value a run: sums over the instants
  std::vector<std::string> states;
  for (int run = 0; run < kRuns; ++run) {
    scenario.run.seed = static_cast<std::uint64_t>(1000 + run);
    const Played played = play(scenario, {{"ekf", "matched", ""}});
    const Bound bound = posterior_bound(scenario, true_run(played));
    ASSERT_TRUE(std::holds_alternative<BoundSeries>(bound)) << std::get<std::string>(bound);
    const auto& series = std::get<BoundSeries>(bound);
    const Track& track = played.tracks[0];
    ASSERT_EQ(series.utime, track.utime);  // measured at every sample of the truth
    states = track.states;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const std::vector<double> error = played.error(0, states[i]);
      double e2 = 0.0, b = 0.0, P = 0.0;
      for (std::size_t k = 0; k < error.size(); ++k) {
        e2 += error[k] * error[k];
        b += series.of(states[i])->at(k);
        P += track.sigma[i][k] * track.sigma[i][k];
      }
      excess[i].add(e2 - b);
      squares[i].add(e2);
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
    // What the filter claims is the bound with Jacobians at its estimates: the same but for the turns of a heading that is
    // known to 1e-4 rad and a speed known to 0.01 m/s.
    EXPECT_NEAR(claimed[i].mean(), bounds[i].mean(), 0.005 * bounds[i].mean()) << states[i];
  }
}

}  // namespace
}  // namespace slipstream
