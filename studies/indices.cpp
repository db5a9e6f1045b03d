#include "studies/indices.hpp"

#include <cmath>
#include <limits>

#include "common/check.hpp"

namespace slipstream {
namespace {

void add_to(std::vector<double>& sum, const std::vector<double>& term) {
  if (sum.empty()) sum.assign(term.size(), 0.0);
  SLIPSTREAM_CHECK(sum.size() == term.size());
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += term[k];
}

void divide(std::vector<double>& sum, double n) {
  for (double& s : sum) s /= n;
}

}  // namespace

RunIndices run_indices(std::span<const std::vector<double>> error) {
  SLIPSTREAM_CHECK(!error.empty() && !error[0].empty());
  const std::size_t samples = error[0].size();
  RunIndices run;
  std::vector<double> squares(samples, 0.0);
  for (const std::vector<double>& state : error) {
    SLIPSTREAM_CHECK(state.size() == samples);
    std::vector<double>& absolute = run.eps_state.emplace_back();
    for (std::size_t k = 0; k < samples; ++k) {
      absolute.push_back(std::abs(state[k]));
      squares[k] += state[k] * state[k];
    }
  }
  double sum = 0.0;
  for (const double s : squares) {
    run.eps.push_back(std::sqrt(s / static_cast<double>(error.size())));
    sum += run.eps.back();
  }
  run.eta = sum / static_cast<double>(samples);
  return run;
}

void IndexAverage::add(const RunIndices& run) {
  if (!std::isfinite(run.eta)) {
    ++failed_;
    return;
  }
  ++runs_;
  sum_.eta += run.eta;
  add_to(sum_.eps, run.eps);
  if (sum_.eps_state.empty()) sum_.eps_state.resize(run.eps_state.size());
  SLIPSTREAM_CHECK(sum_.eps_state.size() == run.eps_state.size());
  for (std::size_t i = 0; i < run.eps_state.size(); ++i) add_to(sum_.eps_state[i], run.eps_state[i]);
}

StudyIndices IndexAverage::result() const {
  StudyIndices result{runs_, failed_, sum_};
  if (runs_ == 0) {
    result.mean.eta = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  const double n = static_cast<double>(runs_);
  result.mean.eta /= n;
  divide(result.mean.eps, n);
  for (std::vector<double>& state : result.mean.eps_state) divide(state, n);
  return result;
}

}  // namespace slipstream
