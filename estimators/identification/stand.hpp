// Moment of inertia and friction of a wheel on the stand, from motor current and wheel speed: document 002, section 5.1,
// Figures 16 and 17, Tables 5 and 6.
//
//   1. residual current: what the sensor shows on average while the wheel stands still before the start; subtracted
//   2. current: first-order Butterworth low-pass, without its delay (low_pass.hpp)
//   3. J, b: particle swarm on 1 - R2 of the wheel speed, once for each cost function of Table 6 (wheel_response.hpp)
//   4. intervals: response_fit.hpp, with the residual current's own uncertainty
//
// Speed and current determine J / k_m and b / k_m only: J and b are as right as the given k_m is.
#pragma once

#include <string>
#include <vector>

#include "common/types.hpp"
#include "estimators/identification/response_fit.hpp"
#include "estimators/identification/wheel_response.hpp"

namespace slipstream {

// One run on the stand, both sensors sampled at the same equidistant instants.
struct StandRecord {
  std::vector<Utime> utime;
  std::vector<double> current_a;          // as the sensor gives it, residual current included
  std::vector<double> wheel_speed_radps;  // as long
};

struct StandSettings {
  double torque_constant_nmpa = 0.0027 * 70.0 * 30.0 / (13.0 * 19.0);  // k_m at the wheel: scenarios/stand.toml
  double standstill_s = 0.9;                                           // from the first sample: the wheel does not turn yet
  double cutoff_hz = 25.0;                                             // of the low-pass
  double min_inertia_kgm2 = 1e-4, max_inertia_kgm2 = 2e-2;             // the swarm's box
  double min_friction_nms = 1e-4, max_friction_nms = 1e-1;
  SwarmSettings swarm{};
};

// A line of Table 6, and the curve of Figure 17.
struct StandFit {
  std::string name;  // "RK" or "LSIM"
  int iterations = 0;
  bool converged = false;
  Interval inertia_kgm2;
  Interval friction_nms;
  double r2 = 0.0;  // of the measured speed
  std::vector<double> simulated_radps;
};

struct StandResult {
  std::vector<double> time_s;
  std::vector<double> raw_current_a;       // Figure 16
  std::vector<double> filtered_current_a;  // Figure 16: filtered, without delay and residual current
  Interval residual_current_a;
  std::vector<double> measured_radps;  // Figure 17
  std::vector<StandFit> fits;          // of the methods that were asked for, in their order
};

// Refuses series of unequal length, times that are not equidistant, a cutoff at or above half the sample rate, a standstill of
// fewer than 20 samples or not shorter than the series, and a wheel that turns in it.
StandResult identify_stand(const StandRecord& record, const StandSettings& settings,
                           const std::vector<Method>& methods = {Method::kRungeKutta, Method::kExact});

}  // namespace slipstream
