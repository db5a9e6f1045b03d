// What the experiments share: values over seeds, marks, and columns of a result.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "studies/play.hpp"
#include "reproduce/experiment.hpp"

namespace slipstream {

// values(seed) for the seeds 1 ... bench.seeds, as one column per value. Reports progress as parts first ... first + seeds of
// total.
template <typename F>
std::vector<std::vector<double>> over_seeds(const Bench& bench, int first, int total, const F& values) {
  std::vector<std::vector<double>> columns;
  for (int seed = 1; seed <= bench.seeds; ++seed) {
    bench.progress(first + seed - 1, total);
    const std::vector<double> v = values(seed);
    columns.resize(v.size());
    for (std::size_t i = 0; i < v.size(); ++i) columns[i].push_back(v[i]);
  }
  bench.progress(first + bench.seeds, total);
  return columns;
}

inline constexpr const char* kOurStepTakesLonger = "our step takes longer";

inline std::string seed_is(int seed) { return fmt::format("run.seed={}", seed); }

inline double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// The computing time of all steps.
inline double total_s(const Track& track) {
  return 1e-6 * std::accumulate(track.step_time_us.begin(), track.step_time_us.end(), 0.0);
}

// A state's estimate with two standard deviations to either side.
inline Sketch& two_sigma(Sketch& sketch, const std::string& name, const Track& track, const std::string& state,
                         const std::string& colour) {
  std::vector<double> low = track.of(state), high = low;
  for (std::size_t i = 0; i < low.size(); ++i) {
    low[i] -= 2.0 * track.sigma_of(state)[i];
    high[i] += 2.0 * track.sigma_of(state)[i];
  }
  return sketch.band(name, track.t_s, low, high, colour);
}

inline std::vector<double> absolute(std::vector<double> values) {
  for (double& v : values) v = std::abs(v);
  return values;
}

// Where a column changes its value: the gear changes of a truth.
inline std::vector<double> changes_s(const std::vector<double>& t_s, const std::vector<double>& value) {
  std::vector<double> at;
  for (std::size_t i = 1; i < value.size(); ++i)
    if (value[i] != value[i - 1]) at.push_back(t_s[i]);
  return at;
}

}  // namespace slipstream
