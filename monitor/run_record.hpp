// What one run said on the bus, kept as series: columns over time, one row an instant. Filled by session.hpp, read by
// everything that scores, draws and writes.
//
// A message that does not fit (wrong length, not finite where it must be, an unsafe name, a table that is full) is counted as
// rejected; one that its sender already said, or truth and estimates that are not newer, as out of order. Both stay out of the
// series. A reading that was sent in order but measured before its predecessor (a late fix) is no error: it takes its place in
// time and is counted as late. Angles of the truth are unwrapped (angles.hpp).
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/messages.hpp"

namespace slipstream {

struct Scenario;

// About the experiment, from its scenario, which only main.cpp can read.
struct RunInfo {
  std::int64_t run_id = 0;
  std::string name;      // RunDescriptor::name
  std::string clock;     // "lockstep", "realtime" or "free"
  std::string scenario;  // name; empty: the scenario could not be read
  std::string description;
  std::string scenario_toml;              // resolved
  std::shared_ptr<const Scenario> setup;  // what it says; null: the scenario could not be read
  std::optional<std::uint64_t> seed;
  std::optional<double> duration_s;
  std::optional<double> noise_percent;                     // if every sensor has this and no absolute noise
  double deadline_s = 0.0;                                 // 0: none
  std::vector<std::string> input_names;                    // quantities that drive the models, e.g. "drive_torque_nm"
  std::vector<std::pair<std::string, std::string>> facts;  // further rows for the report's header
  std::vector<std::string> truth_names;
  std::vector<std::string> truth_units;
};

// Follows one sender's sequence numbers: from wherever they begin, without gaps, increasing.
struct SequenceCheck {
  std::int64_t newest = -1;
  std::int64_t lost = 0;          // numbers skipped
  std::int64_t out_of_order = 0;  // numbers not above the newest
  bool accept(std::int64_t seq);
};

struct TruthRecord {
  std::vector<Utime> utime;
  std::vector<std::vector<double>> column;  // one per RunInfo::truth_names
  std::vector<double> newest;               // of each column, known; NaN: none is
  SequenceCheck sequence;
};

struct ReadingRecord {
  std::vector<Utime> utime;
  std::vector<double> value;
  SequenceCheck sequence;
  std::int64_t late = 0;  // measured before a reading that had come before
};

struct InnovationRecord {
  std::vector<Utime> utime;
  std::vector<double> innovation;
  std::vector<double> sigma;  // square root of its variance; NaN if that is not positive
};

// The measurements of one sensor (innovation_sensors.hpp) as a whole. Its quantities' InnovationRecords run beside it: their
// entry k belongs to its entry k, unless the estimator leaves some of them out.
struct SensorRecord {
  std::vector<std::size_t> row;  // of the estimator's, not decreasing: an estimate may hold several
  std::vector<double> nis;       // of the sensor's block of the innovation covariance; NaN: not known
  std::vector<int> dimension;
  std::vector<char> gated;  // left out of the estimate
  std::vector<char> place;  // among the measurements in its estimate, which are processed one after another
};

// A process of an estimator's name, and what it counted itself. A restart begins another one, which counts from 0.
struct EstimatorLife {
  std::optional<std::int64_t> instance;  // unknown until it has announced itself
  std::int64_t lost = 0;
  std::int64_t rejected = 0;
};

struct EstimatorRecord {
  std::string algorithm, tuning, model;  // empty until it has announced itself
  std::vector<std::string> state_names, state_units;
  Presence presence = Presence::kJoined;
  std::optional<EstimateStatus> status;  // of the newest estimate

  std::size_t states = 0;  // n
  std::vector<Utime> utime;
  std::vector<EstimateStatus> row_status;
  std::vector<std::vector<double>> mean;  // n columns; NaN where the estimate is not to be scored
  std::vector<double> covariance;         // rows of n (n + 1)/2: the lower triangle, row by row
  std::vector<double> nis;                // of what was not gated; NaN where nothing was measured
  std::vector<int> nis_dimension;
  std::vector<double> step_time_us;
  std::vector<double> kkt_residual;                       // NaN where no program was solved
  std::map<std::string, InnovationRecord> innovation_of;  // by quantity
  std::map<std::string, SensorRecord> sensors;            // by sensor

  SequenceCheck sequence;
  std::int64_t late = 0;
  std::int64_t rejected = 0;  // estimates the monitor could not use
  std::vector<EstimatorLife> lives{1};
  std::size_t life = 0;        // the present one
  bool name_conflict = false;  // a process came back after another one of its name

  std::int64_t reported_lost() const;  // by the estimator itself, over all its lives
  std::int64_t reported_rejected() const;
  double variance(std::size_t row, std::size_t i, std::size_t j) const;  // of states i and j
  double sigma(std::size_t row, std::size_t state) const;
};

class RunRecord {
 public:
  explicit RunRecord(RunInfo info);

  void add(const Truth& m);
  void add(const Reading& m);
  void add(const Estimate& m);
  void add(const Announcement& m);  // of an estimator
  void add(const Tick& m);

  const RunInfo& info() const { return info_; }
  const TruthRecord& truth() const { return truth_; }
  const std::map<std::string, ReadingRecord>& readings() const { return readings_; }
  const std::map<std::string, EstimatorRecord>& estimators() const { return estimators_; }
  Utime simulated() const { return tick_utime_; }  // up to the newest tick
  RunState state() const { return state_; }
  bool ended() const { return is_over(state_); }
  bool complete() const { return state_ == RunState::kEnded; }
  std::int64_t newest_tick_seq() const { return newest_tick_seq_; }  // -1: no tick yet
  bool seen_from_start() const { return first_tick_seq_ == 0; }
  std::int64_t rejected() const { return rejected_; }  // readings, truth and estimates of nobody
  std::int64_t announcements_rejected() const { return announcements_rejected_; }
  const std::vector<double>* truth_column(const std::string& name) const;  // null: not a truth of this run

  // Whether an estimator that has not left still owes the estimate for the newest of the measurements it has been using.
  bool awaits_estimates() const;

 private:
  void add(const std::string& quantity, const Header& header, double value);
  void add_innovations(EstimatorRecord& r, const Estimate& m);

  RunInfo info_;
  TruthRecord truth_;
  std::map<std::string, ReadingRecord> readings_;
  std::map<std::string, EstimatorRecord> estimators_;
  Utime tick_utime_ = 0;
  RunState state_ = RunState::kRunning;
  std::int64_t first_tick_seq_ = -1, newest_tick_seq_ = -1;
  std::int64_t rejected_ = 0;
  std::int64_t announcements_rejected_ = 0;  // apart: how often one announces itself depends on the wall clock
};

}  // namespace slipstream
