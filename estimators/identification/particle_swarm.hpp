// Particle swarm: the minimum of a function in a box, without derivatives (document 002, section 5.1). The .cpp is the only
// file that names pagmo.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace slipstream {

struct SwarmSettings {
  int particles = 200;  // at least 5
  int max_iterations = 50;
  // Stops when the best value has improved by less than tolerance * max(1, |best|) over the last `patience` iterations: the
  // rule and the patience that MATLAB's particleswarm documents.
  double tolerance = 1e-6;
  int patience = 20;
  std::uint64_t seed = 1;
};

struct SwarmResult {
  std::vector<double> best;
  double value = 0.0;
  int iterations = 0;           // in which every particle moved once
  std::vector<double> history;  // best value of the start and after each iteration
  bool converged = false;       // stopped by the rule, not by max_iterations
};

// Minimises f over lower <= x <= upper, both of one length, lower < upper. One thread, and the same result for the same seed
// and the same pagmo. A value that is not finite counts as the worst possible one.
SwarmResult minimise(const std::function<double(const std::vector<double>&)>& f, const std::vector<double>& lower,
                     const std::vector<double>& upper, const SwarmSettings& settings);

}  // namespace slipstream
