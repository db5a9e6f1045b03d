// The figures of the lateral scenarios, as the document has them and as they should be.
#pragma once

#include <cmath>

#include "common/random.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {

struct LateralScores {
  std::array<double, 2> r2_measured;  // of h(x) after the update against the measurements, as the document scores: a_y, w_z
  std::array<double, 2> r2_true;      // of the same against the truth
  std::array<double, 2> r2_limit;     // of the truth against the measurements: what a perfect estimate gets
  double r2_lateral_speed;
  double end_error_m;  // of the position, at the end
  double front, rear;  // stiffnesses at the end, N/rad
  double nis_mean;     // dimension 2
  double nees_mean;    // over the run, of v_y, w_z, C_1, C_2: dimension 4
  double nees_end;     // at the end
  std::size_t fallbacks;
};

inline LateralScores lateral_scores(const Scenario& scenario, const std::string& algorithm, const std::string& tuning) {
  constexpr std::array<std::size_t, 4> kObservable{0, 1, 5, 6};
  const auto& model = std::get<LateralBicycle>(scenario.estimator.process);
  const Played played = play(scenario, algorithm, tuning);
  LateralScores s{};
  const auto z_hat = estimated_outputs(model, played);
  for (std::size_t k = 0; k < 2; ++k) {
    const std::string name(LateralBicycle::kOutputNames[k].name);
    const auto z = played.measured_of(k);
    const auto truth = played.truth_of(name);
    s.r2_measured[k] = score_state(z, z_hat[k]).r2;
    s.r2_true[k] = score_state(truth, z_hat[k]).r2;
    s.r2_limit[k] = score_state(z, truth).r2;
  }
  s.r2_lateral_speed = score_state(played.truth_of("lateral_speed_mps"), played.estimate_of(0)).r2;
  const auto x = played.truth_of("x_m"), y = played.truth_of("y_m");
  const Estimate& last = played.estimates.back();
  s.end_error_m = std::hypot(last.mean[3] - x.back(), last.mean[4] - y.back());
  s.front = last.mean[5];
  s.rear = last.mean[6];
  s.nis_mean = score_consistency(played.nis(), 2).mean;
  std::vector<double> nees;
  for (std::size_t k = 0; k < played.estimates.size(); ++k) {
    const Estimate& e = played.estimates[k];
    std::vector<double> error;
    for (const std::size_t i : kObservable) error.push_back(e.mean[i] - played.truth[k][i]);
    nees.push_back(normalised_square(error, sub_block(e.covariance, LateralBicycle::kStates, kObservable)));
  }
  s.nees_mean = score_consistency(nees, 4).mean;
  s.nees_end = nees.back();
  s.fallbacks = played.fallbacks();
  return s;
}

// Draws the tuning's initial mean from its own initial distribution around what it is: a start that is as wrong as is believed.
inline void draw_start(Scenario& scenario, const std::string& tuning) {
  Tuning& t = scenario.estimator.tunings.at(tuning);
  for (auto& [state, mean] : t.initial_mean)
    mean += std::sqrt(t.initial_variance.at(state)) * RandomStream(scenario.run.seed, 0, "start." + state).normal();
}

}  // namespace slipstream::test
