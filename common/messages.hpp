// What travels on the bus, as plain structs: the rooms speak these, `io` translates them from and to LCM types.
// Field meanings and units are those of the .lcm files of the same names.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "common/check.hpp"
#include "common/types.hpp"

namespace slipstream {

struct Header {
  Utime utime = 0;          // simulation time
  std::int64_t seq = 0;     // per sender and channel, from 0, without gaps
  std::int64_t run_id = 0;  // the run this message belongs to
};

struct RunDescriptor {
  Header header;
  std::string name;                      // identifies the experiment: the same scenario and seed give the same name
  std::string scenario_toml;             // resolved: every default filled in
  std::string clock;                     // "lockstep", "realtime" or "free"
  std::vector<std::string> truth_names;  // of Truth::value, with the unit as suffix
  std::vector<std::string> truth_units;
};

// What a sensor or an input says at one instant: a number, or several that belong together, without an allocation.
class Values {
 public:
  static constexpr int kMost = 6;

  Values(double scalar) : size_(1) { value_[0] = scalar; }  // implicit: most readings are a number
  explicit Values(std::span<const double> values) : size_(static_cast<int>(values.size())) {
    SLIPSTREAM_CHECK(!values.empty() && values.size() <= kMost);
    std::copy(values.begin(), values.end(), value_.begin());
  }

  std::size_t size() const { return static_cast<std::size_t>(size_); }
  double operator[](std::size_t i) const { return value_[i]; }
  const double* begin() const { return value_.data(); }
  const double* end() const { return value_.data() + size_; }
  double scalar() const {
    SLIPSTREAM_CHECK(size_ == 1);
    return value_[0];
  }

 private:
  std::array<double, kMost> value_{};
  int size_;
};

// `quantity` is the name with the unit as suffix, e.g. "wheel_speed_radps"; of a reading with several numbers the name that
// common/readings.hpp lists with its components, e.g. "imu". The header's utime is the time of the measurement: a fix that
// arrives late is older than the ticks before it.
struct Reading {
  Header header;
  std::string quantity;
  Values value = 0.0;
};

struct Truth {
  Header header;
  std::vector<double> value;  // NaN where the plant does not know it (recorded drives)
};

enum class EstimateStatus : std::int8_t {
  kValid = 0,
  kInitialising = 1,  // no measurement yet that fixes the start
  kFallback = 2,      // the solver did not converge, or the particles collapsed; the estimate is the stated fallback's
  kInvalid = 3,       // not finite, or the covariance is not positive: do not use
};

inline const char* status_name(EstimateStatus status) {
  switch (status) {
    case EstimateStatus::kValid:
      return "valid";
    case EstimateStatus::kInitialising:
      return "initialising";
    case EstimateStatus::kFallback:
      return "fallback";
    case EstimateStatus::kInvalid:
      return "invalid";
  }
  return "?";
}

struct Estimate {
  Header header;
  std::string name;
  EstimateStatus status = EstimateStatus::kInitialising;
  std::vector<double> mean;                   // n
  std::vector<double> covariance;             // n x n, row-major
  std::vector<double> interval_low;           // n: 99 % credible interval of each state; or empty, where the algorithm
  std::vector<double> interval_high;          // gives none
  std::vector<std::string> innovation_of;     // m quantities measured in this step
  std::vector<double> innovation;             // m: measurement minus prediction
  std::vector<double> innovation_covariance;  // m x m, row-major
  std::vector<std::int8_t> gated;             // m: 1 where the measurement was too unlikely and was left out; empty: none was
  double kkt_residual = -1.0;                 // of a solved program, see estimate.lcm
  double step_time_us = 0.0;                  // wall-clock time of predict and update
  std::int64_t messages_lost = 0;             // gaps in the sequence numbers of what this estimator received, since it joined
  std::int64_t messages_rejected = 0;         // received but unusable: not finite, out of order, malformed
};

enum class Presence : std::int8_t { kJoined = 0, kAlive = 1, kLeft = 2 };

struct Announcement {
  Header header;
  std::string name;
  std::string role;       // "estimator" or "monitor"
  std::string algorithm;  // empty for a monitor
  std::string tuning;
  std::string model;
  std::vector<std::string> state_names;
  std::vector<std::string> state_units;
  Presence presence = Presence::kJoined;
  std::int64_t instance = 0;  // of the process: tells a restart, and two processes of one name, apart
};

enum class Command : std::int8_t { kRun = 0, kPause = 1, kStep = 2, kStop = 3 };

struct Control {
  Header header;
  Command command = Command::kRun;
};

// kEnded: the drive was played to its end; kStopped: it was stopped before. Nothing follows either.
enum class RunState : std::int8_t { kRunning = 0, kPaused = 1, kEnded = 2, kStopped = 3 };
inline bool is_over(RunState s) { return s == RunState::kEnded || s == RunState::kStopped; }

// "Everything up to utime has been published."
struct Tick {
  Header header;
  RunState state = RunState::kRunning;
};

// "I have processed everything up to utime": the lockstep reply to a Tick.
struct Progress {
  Header header;
  std::string name;
};

}  // namespace slipstream
