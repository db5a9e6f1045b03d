// A scenario played in process: the plant's drive, the estimators' sessions and the monitor's scores, without a bus between
// them, so no message is lost and nothing waits.
//
// Angles (states in rad) stay on the turn of their truth, which is kept unwrapped: errors are the short way round.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/messages.hpp"
#include "models/recorded.hpp"
#include "models/scenario.hpp"
#include "monitor/bound.hpp"
#include "monitor/diagnosis.hpp"
#include "monitor/scores.hpp"

namespace slipstream {

struct Follower {
  std::string algorithm, tuning;
  std::string label;                 // in figures; empty: the algorithm
  const Scenario* belief = nullptr;  // what it believes instead of the scenario that is played; empty: that one
};

struct Series {
  std::vector<double> t_s;
  std::vector<double> value;
};

// What became of steps: an estimate that is not to be used is NaN in its track and is not scored, so it must be told.
struct StepTally {
  std::int64_t steps = 0, fallback = 0, invalid = 0;
};

// The fixes and speeds that a strapdown filter was given, of one sensor.
struct SensorNis {
  std::vector<double> nis;
  std::vector<int> dimension;
  int gated = 0;  // left out by the estimator; their NIS counts here
};

// What one estimator said during a run. Columns have one entry a row, NaN where the estimate is not to be used.
struct Track {
  std::string label;
  std::vector<std::string> states, outputs;
  std::vector<Utime> utime;
  std::vector<double> t_s;
  std::vector<std::vector<double>> mean, sigma;                  // per state
  std::vector<std::vector<double>> interval_low, interval_high;  // per state; empty where the algorithm gives none
  std::vector<std::vector<double>> output;                       // per output: h(x^, u) after the update
  std::vector<double> nees, nis;
  std::vector<int> nees_dimension, nis_dimension;
  std::vector<double> step_time_us;
  std::vector<double> kkt_residual;  // see estimate.lcm
  StepTally tally;
  std::map<std::string, SensorNis> sensors;  // of a strapdown filter, which has no outputs h(x^, u)
  std::vector<Finding> findings;             // what the monitor says of them

  const std::vector<double>& of(const std::string& state) const;
  const std::vector<double>& sigma_of(const std::string& state) const;
  std::size_t index(const std::string& state) const;
};

struct Played {
  std::vector<Utime> truth_utime;
  std::vector<double> truth_t_s;
  std::map<std::string, std::vector<double>> truth;  // by name
  std::map<std::string, Series> measured;            // by quantity or component: sensors and inputs
  std::vector<Track> tracks;                         // in the order of the followers

  // Of a state of track k against the truth, as the monitor scores it.
  StateScore score(std::size_t k, const std::string& state) const;
  // Of an output h(x^, u) of track k against what was measured at the same instants (as document 002 scores experiments).
  StateScore score_measured(std::size_t k, const std::string& output) const;
  // Of an output against the truth.
  StateScore score_output(std::size_t k, const std::string& output) const;
  // Estimate minus truth at the track's instants.
  std::vector<double> error(std::size_t k, const std::string& state) const;
  const std::vector<double>& truth_of(const std::string& name) const;
};

// Its truth, for the bound (monitor/bound.hpp). Refers to `played`, which must outlive it.
TrueRun true_run(const Played& played);

// What became of all steps that this process has played, by scenario and estimator.
const std::map<std::string, StepTally>& step_tally();

// What may happen to a reading on its way to the estimators; false: it is lost.
using Tamper = std::function<bool(Reading&)>;

// `streams`: of a recorded drive, else the scenario's vehicle is simulated. NEES is over the states of `nees_states` that have
// a truth (empty: all).
Played play(const Scenario& scenario, const std::vector<Follower>& followers, const RecordedStreams* streams = nullptr,
            const std::vector<std::string>& nees_states = {}, const Tamper& tamper = {});

}  // namespace slipstream
