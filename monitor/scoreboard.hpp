// All scores of a run: which series meets which, on top of the pure functions of scores.hpp.
//
// Truth and estimate meet by the name of the state and the exact utime, else by interpolation (scores.hpp, truth_at). Only
// estimates with status valid or fallback are scored.
#pragma once

#include <string>
#include <vector>

#include "monitor/bound.hpp"
#include "monitor/diagnosis.hpp"
#include "monitor/run_record.hpp"
#include "monitor/scores.hpp"

namespace slipstream {

struct StateColumn {
  std::string name, unit;
  StateScore score;
  double max_error_s;            // simulation time of the largest error
  std::vector<double> truth;     // at the estimator's instants; NaN: not known
  std::vector<double> estimate;  // as published, but an angle on the turn of its truth
  BoundScore bound;              // NaN where there is none
};

struct SensorScore {
  std::string sensor;    // innovation_sensors.hpp
  Consistency nis;       // of what was not gated
  std::int64_t samples;  // with the gated ones
  std::int64_t gated;
};

struct EstimatorScore {
  std::string name;
  const EstimatorRecord* record = nullptr;
  std::vector<StateColumn> states;
  std::vector<double> nees;  // per row; NaN: not known
  Consistency nees_score;    // dimension: the states with a known truth
  Consistency nis_score;     // over all steps that measured something; dimension: their mean number of measurements
  std::vector<SensorScore> sensors;
  std::vector<Finding> findings;  // what is wrong with its sensors
  double nis_ratio;               // sum NIS / sum dimension over all steps
  StepTimes step_times;           // of all steps but those spent waiting for a start
  Residuals residuals;            // of the programs it solved, if it does
  std::int64_t valid = 0, fallback = 0, invalid = 0, initialising = 0;
};

struct Scoreboard {
  bool complete = false;                   // the whole drive was played and its end seen
  Bound bound;                             // of this run
  std::vector<EstimatorScore> estimators;  // by name
};

// Points into the record, which must outlive the result.
Scoreboard score_run(const RunRecord& record);

// The running scores of the live table: amortised constant time a sample. Truth may arrive after the estimate it belongs to.
class RunningScore {
 public:
  void update(const RunRecord& run, const EstimatorRecord& estimator);
  double rmse(std::size_t state) const;
  double nis_ratio() const {
    return dimension_sum_ > 0.0 ? nis_sum_ / dimension_sum_ : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::size_t next_row_ = 0;
  std::vector<double> square_sum_;
  std::vector<double> count_;
  double nis_sum_ = 0.0;
  double dimension_sum_ = 0.0;
};

}  // namespace slipstream
