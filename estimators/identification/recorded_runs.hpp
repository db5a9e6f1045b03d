// What recorded drives let one identify when they lack what the stand has: plain series in, parameters with 95 % intervals out.
// Method and intervals: response_fit.hpp. Responses are exact (wheel_response.hpp), each run from its own first measured speed.
//
// Without a current only ratios can be known: of eq. 5.1 with a torque proportional to a motor command, J / b is the time
// constant and (torque per command) / b the gain; J and b themselves scale with a torque that nobody measured.
#pragma once

#include <vector>

#include "common/types.hpp"
#include "estimators/identification/response_fit.hpp"

namespace slipstream {

// An uninterrupted piece of a drive; all of one length.
struct DriveRun {
  std::vector<Utime> utime;
  std::vector<double> input;  // a motor command, or a current
  std::vector<double> speed;  // of a wheel or of the vehicle
};

// The pieces of a drive of at least `min_samples` samples, without gaps longer than max_gap_s and without samples whose speed
// is below min_speed in magnitude (standstill, where the wheel may be held by what the model does not know). A change of
// direction ends a piece if min_speed > 0. Refuses series of unequal length and times that do not grow.
std::vector<DriveRun> split_into_runs(const std::vector<double>& time_s, const std::vector<double>& input,
                                      const std::vector<double>& speed, double max_gap_s, double min_speed = 0.0,
                                      std::size_t min_samples = 10);

// Steady speeds over a motor command: v = min(K max(u - u0, 0), v_max).
struct SteadyLine {
  Interval gain;       // K, speed per unit of command
  Interval dead_band;  // u0, command
  Interval limit;      // v_max, speed
  double r2 = 0.0;
  int iterations = 0;
  std::vector<double> simulated;
};
// Refuses lists of unequal length and fewer than 30 points.
SteadyLine identify_steady_line(const std::vector<double>& command, const std::vector<double>& speed,
                                const SwarmSettings& swarm = {.max_iterations = 200});

// First order with a dead band: tau v' = K max(u - u0, 0) - v, the command constant between samples.
struct FirstOrder {
  Interval time_constant_s;  // tau: J / b
  Interval gain;             // K, speed per unit of command
  Interval dead_band;        // u0, command
  double r2 = 0.0;           // of all runs together
  int iterations = 0;
  std::vector<double> measured, simulated;  // the runs one after the other
};
FirstOrder identify_first_order(const std::vector<DriveRun>& runs, const SwarmSettings& swarm = {.max_iterations = 200});

// A car that rolls, its mass on the wheels: J w' = k_m i - b w - c sgn(w), the current linear between samples. J is what all
// that moves weighs at the wheel: wheels, rotor, and m r^2 of the car as long as the tyres do not slip.
struct RollingDrive {
  Interval inertia_kgm2;        // J
  Interval friction_nms;        // b
  Interval friction_torque_nm;  // c
  double r2 = 0.0;
  int iterations = 0;
  std::vector<double> measured, simulated;  // rad/s, the runs one after the other
};
// Runs with a current, A, and a wheel speed, rad/s, that keeps its sign within a run. k_m in N m/A at the wheel.
RollingDrive identify_rolling_drive(const std::vector<DriveRun>& runs, double torque_constant_nmpa,
                                    const SwarmSettings& swarm = {.max_iterations = 200});

}  // namespace slipstream
