// The indices of a study, each defined here: a pure function of the lines of its runs, summed in the order of the items, so
// that the same lines give the same bits whoever made them.
//
// e: estimate minus truth; r of N runs, k of the N_k samples of a run, alpha of the n scored states:
//   eps_k       = 1/N sum_r sqrt(1/n sum_alpha e^2)                                              (document 000, eq. 28)
//   eta         = 1/N sum_r 1/N_k sum_k sqrt(1/n sum_alpha e^2)                                               (eq. 29)
//   eps_alpha,k = 1/N sum_r |e|                                                                               (eq. 30)
//   RMSE_alpha  = sqrt(mean of e^2 over all samples of all runs)
// NEES and NIS: mean over all samples of all runs, and the 95 % band of the mean of N d-dimensional chi-squares:
//   NIS:  N = all samples, because innovations of a consistent filter are white
//   NEES: N = runs: errors are correlated in time, so the band is wider than 95 %. With series, NEES_k has its exact band of
//         N = runs at each sample, and nees_inside is the share of the samples within it (Bar-Shalom, Li, Kirubarajan 2001,
//         section 5.4.2).
// k counts from 1: the start itself is in no eta and eps. A run has no eta if the estimator was at some time after its first
// estimate without one: an estimator gains nothing by giving up where it is hard. Efficiency: the mean of the bound's variance
// over the mean of e^2 (monitor/bound.hpp); its interval is that of a ratio of means over runs (Cochran, Sampling Techniques,
// 1977, section 2.11): 1.96 sqrt(n/(n-1) sum_r (b_r - R s_r)^2) / sum_r s_r. Comparisons are of eta, run by run
// (comparison.hpp).
// What is not known (an estimate that is not to be used) is in no mean; the tally counts it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/study.hpp"
#include "monitor/scores.hpp"
#include "studies/comparison.hpp"
#include "studies/run_line.hpp"

namespace slipstream {

struct StateSummary {
  std::string state;
  std::int64_t samples = 0;
  double rmse;
  double most = 0.0;                     // the largest error of all
  std::optional<double> bound_rmse;      // of the Cramer-Rao bound over the same samples
  std::optional<double> efficiency;      // bound_rmse^2 / rmse^2
  std::optional<double> efficiency_off;  // to either end of its 95 % interval
  std::vector<double> rmse_of_run;       // NaN where the run is missing or shows nothing
  std::vector<double> eps_k;             // eps_alpha,k at EstimatorSummary::t_s; with series
};

struct EstimatorSummary {
  std::string estimator;
  StepTally tally;
  double eta;
  std::vector<double> eta_of_run;  // NaN where the run is missing or shows nothing
  std::optional<int> worst_run;    // of the largest eta
  std::vector<StateSummary> states;
  Consistency nees, nis;
  std::vector<double> t_s, eps_k, nees_k;  // with series
  std::optional<double> nees_inside;
  double step_time_us;  // mean of a step; wall clock, no part of the results
};

struct CaseSummary {
  std::string scenario;
  std::vector<std::pair<std::string, std::string>> point;  // key and value of each axis of the grid
  int runs = 0;                                            // that are there
  std::vector<EstimatorSummary> estimators;
  std::optional<std::string> why_no_bound;
  std::vector<Comparison> comparisons;
};

struct Summary {
  std::vector<CaseSummary> cases;
  std::vector<std::size_t> missing;  // items
};

// Lines come in the order of their items, each at most once.
class Summariser {
 public:
  explicit Summariser(const Study& study);
  void add(const RunLine& line);
  Summary finish();

 private:
  void compare_pairs(std::size_t index);

  struct Samples {
    std::int64_t runs = 0;
    double norm = 0.0, nees = 0.0;
    std::int64_t norms = 0, neeses = 0;
    std::vector<double> absolute;
    std::vector<std::int64_t> known;
  };
  struct Sums {
    // Of each state, over the runs: of s = sum e^2 and b, the sum of the bound's variance: s, b, b^2, b s, s^2.
    std::vector<double> square_sum, bound_sum, bound_bound, bound_square, square_square;
    NormalisedSum nees, nis;
    double step_time_us = 0.0;
    std::map<double, Samples> samples;  // by t_s
  };

  const Study& study_;
  Summary summary_;
  std::vector<std::vector<Sums>> sums_;          // of cases and estimators
  std::vector<std::vector<std::uint64_t>> run_;  // of cases: that are there
  std::size_t next_ = 0;                         // item
};

// The whole of results.json. Nothing in it depends on the wall clock.
std::string results_json(const Study& study, const Summary& summary);
// The whole of timings.json.
std::string timings_json(const Study& study, const Summary& summary);

// For the terminal: indices, consistency, and how to see a run live.
std::string summary_text(const Study& study, const Summary& summary);

// "slipstream-plant scenarios/NAME.toml --set run.seed=...", below the folder of the results.
std::string replay_command(const Study& study, std::size_t item);

}  // namespace slipstream
