// Real-time iteration beside Ipopt on the windows of simulated drives, one scenario of each process model with a moving horizon
// and each of its forms: iterated to convergence, also on longer windows and with bounds that hold; and with its shipped
// settings by the scenario's key.
#include <gtest/gtest.h>

#include <map>

#include "estimators/mhe.hpp"
#include "estimators/rti.hpp"
#include "io/scenario_reader.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

constexpr RtiSettings kToConvergence{50, 1e-9, 1e-6};

struct Experiment {
  const char* scenario;
  const char* tuning;
  int window;
  std::size_t steps;
  bool wheel_alone = false;               // the hierarchical observer's first level
  std::map<std::string, double> upper{};  // tightened until they hold
};

Scenario scenario_of(const Experiment& e) {
  Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + e.scenario + ".toml").scenario;
  if (e.wheel_alone) {
    scenario.estimator.process = WheelFriction{std::get<LongitudinalFriction>(scenario.estimator.process).wheel};
    for (auto& [name, tuning] : scenario.estimator.tunings) tuning.process.reset();  // which would come before it
  }
  return scenario;
}

struct Apart {
  Largest most;  // of the states, in standard deviations
  std::size_t steps = 0, compared = 0, fallbacks = 0, held = 0;
};

template <ProcessModel M>
Apart beside(Estimator& one, Estimator& other, const Played& drive, const Belief<M>& belief, const Experiment& e,
             const Scenario& scenario) {
  Apart apart;
  std::uint32_t measured = 0;
  for (std::size_t i = 0; i < M::kOutputs; ++i)
    for (const SensorConfig& sensor : scenario.sensors) measured |= sensor.quantity == M::kOutputNames[i].name ? 1U << i : 0U;
  one.start_given();
  other.start_given();
  apart.steps = std::min(e.steps, drive.inputs.size());
  for (std::size_t k = 0; k < apart.steps; ++k) {
    const double dt_s = k == 0 ? 0.0 : seconds(drive.utime[k] - drive.utime[k - 1]);
    for (Estimator* const estimator : {&one, &other}) estimator->step({dt_s, drive.inputs[k], drive.measured[k], measured});
    const Posterior p = one.posterior(), q = other.posterior();
    apart.fallbacks += p.status != EstimateStatus::kValid ? 1 : 0;
    if (q.status != EstimateStatus::kValid) continue;
    ++apart.compared;
    for (std::size_t i = 0; i < M::kStates; ++i) {
      const double sigma = std::sqrt(q.covariance[i * (M::kStates + 1)]);
      apart.most.add((p.mean[i] - q.mean[i]) / sigma);
      const int state = static_cast<int>(i);
      apart.held += p.mean[i] == belief.lower[state] || p.mean[i] == belief.upper[state] ? 1 : 0;
    }
  }
  return apart;
}

template <ProcessModel M, typename Check>
void with_belief(const Experiment& e, const M& model, const Scenario& scenario, const Check& check) {
  Belief<M> belief = make_belief(model, scenario, scenario.estimator.tunings.at(e.tuning));
  for (int i = 0; i < M::kStates; ++i)
    if (const auto upper = e.upper.find(std::string(M::kStateNames[static_cast<std::size_t>(i)].name)); upper != e.upper.end())
      belief.upper[i] = upper->second;
  check(belief);
}

class RtiExperiment : public testing::TestWithParam<Experiment> {};

TEST_P(RtiExperiment, ConvergesToTheSolutionOfIpopt) {
  const Experiment& e = GetParam();
  const Scenario scenario = scenario_of(e);
  const Played drive = play(scenario, "ekf", e.tuning);
  const Tuning& tuning = scenario.estimator.tunings.at(e.tuning);
  std::visit(
      [&](const auto& model) {
        using M = std::decay_t<decltype(model)>;
        with_belief(e, model, scenario, [&](const Belief<M>& belief) {
          Apart apart;
          if (tuning.mhe_form == "single_shooting") {
            const Belief<M> weighted = weights_as_noise(belief, tuning);
            const auto s = belief_detail::by_name(tuning.arrival_weight, M::kStateNames, 0.0);
            RtiSingleShooting<M> ours(weighted, e.window, s, kToConvergence);
            MheSingleShooting<M> ipopt(weighted, e.window, s);
            apart = beside(ours, ipopt, drive, weighted, e, scenario);
          } else {
            RtiMhe<M> ours(belief, e.window, kToConvergence);
            Mhe<M> ipopt(belief, e.window);
            apart = beside(ours, ipopt, drive, belief, e, scenario);
          }
          std::printf("%s %s N = %d: %.1e sigma apart, %zu steps, %zu fallbacks, %zu held\n", e.scenario, e.tuning, e.window,
                      apart.most.value(), apart.compared, apart.fallbacks, apart.held);
          // Ipopt stops at 1e-6 of these units; a bound that barely holds it keeps away from by more than that.
          EXPECT_LT(apart.most.value(), e.upper.empty() ? 1e-5 : 1e-3);  // false for what is not a number
          EXPECT_EQ(apart.steps, e.steps);                               // the drive is long enough
          EXPECT_EQ(apart.compared, apart.steps);                        // and Ipopt solved every window of it
          EXPECT_EQ(apart.fallbacks, 0U);
          if (!e.upper.empty()) {
            EXPECT_GT(apart.held, 20U);
          }
        });
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

INSTANTIATE_TEST_SUITE_P(
    All, RtiExperiment,
    testing::Values(Experiment{"unimog", "matched", 4, 300}, Experiment{"unimog", "matched", 20, 150},
                    Experiment{"unimog", "document", 4, 300},
                    Experiment{"unimog", "matched", 4, 300, false, {{"friction", 0.1}}},
                    Experiment{"unimog", "matched", 4, 300, true}, Experiment{"unimog", "matched", 20, 150, true},
                    Experiment{"unimog", "document", 4, 300, true},
                    Experiment{"unimog", "matched", 4, 300, true, {{"friction", 0.1}}},
                    Experiment{"unimog", "matched", 20, 100, true, {{"friction", 0.112}}},
                    Experiment{"unimog", "document", 20, 100, true, {{"friction", 0.112}}},
                    Experiment{"scale_car_wheel", "matched", 4, 300}, Experiment{"scale_car_wheel", "document", 4, 300},
                    Experiment{"circle", "matched", 4, 300}, Experiment{"circle", "document", 4, 300},
                    Experiment{"snow_variable", "matched", 4, 300}, Experiment{"point_mass", "matched", 4, 101},
                    Experiment{"slalom", "matched", 4, 300}, Experiment{"track_tyres", "matched", 4, 300}));

// By the scenario's key, with the settings that are shipped: one program a step is as good as Ipopt's solution.
TEST(RtiByKey, EstimatesAsIpoptDoesAndPublishesItsResidual) {
  for (const auto& [file, algorithm, tuning] : {std::array<std::string, 3>{"unimog", "mhe", "matched"},
                                                {"unimog", "mhe", "document"},
                                                {"unimog", "hierarchical_mhe", "matched"},
                                                {"unimog", "hierarchical_mhe", "document"},
                                                {"circle", "mhe", "matched"}}) {
    Scenario scenario = scenario_of({file.c_str(), "", 0, 0});
    scenario.run.duration_s = 3.0;
    const Played ipopt = play(scenario, algorithm, tuning);
    scenario.estimator.tunings.at(tuning).mhe_solver = "rti";
    const Played rti = play(scenario, algorithm, tuning);
    ASSERT_EQ(rti.estimates.size(), ipopt.estimates.size());
    EXPECT_EQ(rti.fallbacks(), 0U) << file << algorithm << tuning;
    Largest apart;
    const std::size_t n = rti.estimates[0].mean.size();
    for (std::size_t k = 0; k < rti.estimates.size(); ++k) {
      const Estimate &e = rti.estimates[k], &expected = ipopt.estimates[k];
      for (std::size_t i = 0; i < n; ++i)
        apart.add((e.mean[i] - expected.mean[i]) / std::sqrt(expected.covariance[i * (n + 1)]));
      EXPECT_GE(e.kkt_residual, 0.0);
      EXPECT_LE(e.kkt_residual, RtiSettings{}.acceptable);
      EXPECT_GE(expected.kkt_residual, 0.0);
      EXPECT_LE(expected.kkt_residual, 1e-5);  // Ipopt's acceptable tolerance
    }
    std::printf("%s %s %s: %.1e sigma apart\n", file.c_str(), algorithm.c_str(), tuning.c_str(), apart.value());
    EXPECT_LT(apart.value(), 0.1);  // the residual that is let pass
  }
  EXPECT_EQ(play(scenario_of({"unimog", "", 0, 0}), "ekf", "matched").estimates.back().kkt_residual, -1.0);
}

}  // namespace
}  // namespace slipstream::test
