// The indices of a study: what an estimator's errors e^r_(alpha,k) = x^ - x come to over runs r, samples k and states alpha.
//
//   eta         = 1/N_MC sum_r 1/N_k sum_k sqrt(1/n_x sum_alpha e^2)
//   eps_k       = 1/N_MC sum_r             sqrt(1/n_x sum_alpha e^2)
//   eps_alpha,k = 1/N_MC sum_r |e|                                                       (document 000, eqs 27 to 30)
//
// The states may have different units, as the document's do: eta and eps_k are then of the numbers in these units, and who
// calls chooses the states. What is not known (NaN) makes what it enters not known, so that an estimator gains nothing by
// giving no estimate where it is hard; a run whose eta is not known is left out of the averages and counted.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace slipstream {

// Of one run.
struct RunIndices {
  double eta = 0.0;
  std::vector<double> eps;                     // per sample: sqrt(1/n_x sum_alpha e^2)
  std::vector<std::vector<double>> eps_state;  // per state and sample: |e|
};

// `error`: a column per state, all of one length; not empty.
RunIndices run_indices(std::span<const std::vector<double>> error);

struct StudyIndices {
  std::size_t runs = 0;    // averaged over: N_MC
  std::size_t failed = 0;  // left out
  RunIndices mean;         // eta, eps_k, eps_alpha,k; NaN without a run
};

// Sums in the order of the runs as they come, so that the same runs in the same order give the same bits: who calls sorts them
// by index. All runs have as many states and samples as the first.
class IndexAverage {
 public:
  void add(const RunIndices& run);
  StudyIndices result() const;

 private:
  RunIndices sum_;
  std::size_t runs_ = 0, failed_ = 0;
};

}  // namespace slipstream
