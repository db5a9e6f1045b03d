#include "estimators/identification/recorded_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "estimators/identification/wheel_response.hpp"

namespace slipstream {
namespace {

std::vector<double> speeds_of(const std::vector<DriveRun>& runs) {
  std::vector<double> all;
  for (const DriveRun& run : runs) all.insert(all.end(), run.speed.begin(), run.speed.end());
  return all;
}

// The runs' responses one after the other; torque(run, k) is what drives the wheel at sample k.
template <typename Torque>
void responses(const std::vector<DriveRun>& runs, Hold hold, const WheelParameters& p, const Torque& torque,
               std::vector<double>& y) {
  y.clear();
  std::vector<double> t, w;
  for (const DriveRun& run : runs) {
    t.clear();
    for (std::size_t k = 0; k < run.input.size(); ++k) t.push_back(torque(run, k));
    wheel_response(Method::kExact, hold, p, run.utime, t, run.speed.front(), w);
    y.insert(y.end(), w.begin(), w.end());
  }
}

double mean_period_s(const std::vector<DriveRun>& runs) {
  double time_s = 0.0, steps = 0.0;
  for (const DriveRun& run : runs) {
    time_s += seconds(run.utime.back() - run.utime.front());
    steps += static_cast<double>(run.utime.size() - 1);
  }
  return time_s / steps;
}

void check(const std::vector<DriveRun>& runs) {
  if (runs.empty()) throw Refusal("identification: no run, expected at least 1");
  for (const DriveRun& run : runs)
    SLIPSTREAM_CHECK(run.utime.size() >= 2 && run.input.size() == run.utime.size() && run.speed.size() == run.utime.size());
}

double largest(const std::vector<double>& x) { return *std::max_element(x.begin(), x.end()); }

void expect_equal_length(std::size_t first, std::size_t second, const char* what) {
  if (first != second) throw Refusal(fmt::format("identification: {} and {} {}, expected as many", first, second, what));
}

}  // namespace

std::vector<DriveRun> split_into_runs(const std::vector<double>& time_s, const std::vector<double>& input,
                                      const std::vector<double>& speed, double max_gap_s, double min_speed,
                                      std::size_t min_samples) {
  expect_equal_length(time_s.size(), input.size(), "times and inputs");
  expect_equal_length(time_s.size(), speed.size(), "times and speeds");
  std::vector<DriveRun> runs;
  DriveRun run;
  const auto finish = [&] {
    if (run.utime.size() >= std::max<std::size_t>(min_samples, 2)) runs.push_back(run);
    run = {};
  };
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    if (k > 0 && !(time_s[k] > time_s[k - 1]))
      throw Refusal(fmt::format("identification: time {:g} s after {:g} s, expected growing times", time_s[k], time_s[k - 1]));
    const bool turned = min_speed > 0.0 && !run.speed.empty() && (speed[k] > 0.0) != (run.speed.back() > 0.0);
    if ((k > 0 && time_s[k] - time_s[k - 1] > max_gap_s) || turned) finish();
    if (std::abs(speed[k]) < min_speed) {
      finish();
      continue;
    }
    run.utime.push_back(utime_of(time_s[k]));
    run.input.push_back(input[k]);
    run.speed.push_back(speed[k]);
  }
  finish();
  return runs;
}

SteadyLine identify_steady_line(const std::vector<double>& command, const std::vector<double>& speed,
                                const SwarmSettings& swarm) {
  expect_equal_length(command.size(), speed.size(), "commands and speeds");
  FitProblem problem;
  problem.response = [&](const std::vector<double>& theta, std::vector<double>& y) {
    y.clear();
    for (const double u : command) y.push_back(std::min(theta[0] * std::max(u - theta[1], 0.0), theta[2]));
  };
  problem.measured = speed;
  problem.names = {"K", "u0", "v_max"};
  const double u_max = command.empty() ? 0.0 : largest(command), v_max = speed.empty() ? 0.0 : largest(speed);
  if (!(u_max > 0.0 && v_max > 0.0)) throw Refusal("identification: expected commands and speeds above 0");
  problem.lower = {0.0, 0.0, 0.1 * v_max};
  problem.upper = {10.0 * v_max / u_max, 0.5 * u_max, v_max};
  problem.lag = [&](const std::vector<double>&) {
    return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(command.size()))));
  };
  ResponseFit fit = fit_response(problem, swarm);
  return {fit.parameters[0], fit.parameters[1], fit.parameters[2], fit.r2, fit.iterations, std::move(fit.simulated)};
}

FirstOrder identify_first_order(const std::vector<DriveRun>& runs, const SwarmSettings& swarm) {
  check(runs);
  FitProblem problem;
  problem.response = [&](const std::vector<double>& theta, std::vector<double>& y) {  // J = tau, b = 1
    responses(
        runs, Hold::kConstant, {theta[0], 1.0},
        [&](const DriveRun& run, std::size_t k) { return theta[1] * std::max(run.input[k] - theta[2], 0.0); }, y);
  };
  problem.measured = speeds_of(runs);
  problem.names = {"tau", "K", "u0"};
  double u_max = 0.0;
  for (const DriveRun& run : runs) u_max = std::max(u_max, largest(run.input));
  const double v_max = largest(problem.measured);
  if (!(u_max > 0.0 && v_max > 0.0)) throw Refusal("identification: expected commands and speeds above 0");
  problem.lower = {1e-2, 0.0, 0.0};
  problem.upper = {5.0, 10.0 * v_max / u_max, 0.9 * u_max};
  // What one run has that the model has not stays for the whole of it: runs are the blocks that may be taken as independent.
  problem.lag = [&](const std::vector<double>&) { return static_cast<int>(problem.measured.size() / runs.size()); };
  ResponseFit fit = fit_response(problem, swarm);
  return {fit.parameters[0], fit.parameters[1], fit.parameters[2],       fit.r2,
          fit.iterations,    problem.measured,  std::move(fit.simulated)};
}

RollingDrive identify_rolling_drive(const std::vector<DriveRun>& runs, double torque_constant_nmpa,
                                    const SwarmSettings& swarm) {
  check(runs);
  SLIPSTREAM_CHECK(torque_constant_nmpa > 0.0);
  FitProblem problem;
  problem.response = [&](const std::vector<double>& theta, std::vector<double>& y) {
    responses(
        runs, Hold::kLinear, {theta[0], theta[1]},
        [&](const DriveRun& run, std::size_t k) {
          return torque_constant_nmpa * run.input[k] - theta[2] * std::copysign(1.0, run.speed.front());
        },
        y);
  };
  problem.measured = speeds_of(runs);
  problem.names = {"J", "b", "c"};
  problem.lower = {1e-3, 0.0, 0.0};
  problem.upper = {1e-1, 1e-1, 2.0};
  constexpr double kCorrelated_s = 3.0;  // a manoeuvre
  problem.lag = [&](const std::vector<double>&) { return static_cast<int>(std::ceil(kCorrelated_s / mean_period_s(runs))); };
  ResponseFit fit = fit_response(problem, swarm);
  return {fit.parameters[0], fit.parameters[1], fit.parameters[2],       fit.r2,
          fit.iterations,    problem.measured,  std::move(fit.simulated)};
}

}  // namespace slipstream
