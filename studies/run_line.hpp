// What one item of a study (models/study.hpp) leaves: sums over its run, from which every index of the study is made. One line
// of JSON, in which every number reads back to the same bits.
//
// Over the samples j after the start where every scored state's error e_a is known:   norm_j = sqrt(1/n sum_a e_a^2)
// An estimate that is not to be used has no error; the tally counts it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/refusal.hpp"
#include "studies/play.hpp"

namespace slipstream {

struct StateErrors {
  std::string state;
  std::int64_t samples = 0;
  double square_sum = 0.0;          // sum e^2
  double most = 0.0;                // max |e|
  std::vector<double> series;       // |e| of every sample, NaN where not known; only if the study keeps series
  std::optional<double> bound_sum;  // sum of the Cramer-Rao bound's variance over the same samples, where there is one
};

// Of NEES or NIS: sum q and sum d over the known q (monitor/scores.hpp).
struct NormalisedSum {
  std::int64_t samples = 0;
  double sum = 0.0;
  double dimensions = 0.0;
};

struct EstimatorRun {
  std::string estimator;
  StepTally tally;
  std::int64_t samples = 0;  // of norm
  std::int64_t missing = 0;  // samples without a usable estimate, after the first that had one
  double norm_sum = 0.0;
  std::vector<StateErrors> states;
  NormalisedSum nees, nis;
  std::vector<double> t_s, norm_series, nees_series;  // of every sample, only if the study keeps series
};

struct RunLine {
  std::string study;  // the key
  std::size_t item = 0;
  std::uint64_t seed = 0;
  std::vector<EstimatorRun> estimators;  // in the study's order
  std::vector<double> step_time_us;      // wall clock: of all steps of each estimator; no part of the result
};

// Without a newline. What is not finite is null and reads back as NaN.
std::string to_text(const RunLine& line);

// What is no such line, in a few words.
class NotARun : public Refusal {
 public:
  using Refusal::Refusal;
};
// Throws NotARun.
RunLine read_run_line(const std::string& text);

// The same but for the wall clock.
bool is_same_result(const std::string& a, const std::string& b);

}  // namespace slipstream
