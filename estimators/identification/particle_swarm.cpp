#include "estimators/identification/particle_swarm.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <pagmo/algorithms/pso.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>
#include <utility>

#include "common/check.hpp"
#include "common/random.hpp"

namespace slipstream {
namespace {

// pagmo's swarm has a number of iterations and nothing else to stop it. Calling it iteration by iteration would be another
// algorithm: each call starts the particles from their best places. So the function that it calls counts, and ends it.
struct Stop {};

struct Watch {
  const std::function<double(const std::vector<double>&)>& f;
  const SwarmSettings& settings;
  SwarmResult result;
  int in_iteration = 0;

  double evaluate(const std::vector<double>& x) {
    double value = f(x);
    if (!std::isfinite(value)) value = std::numeric_limits<double>::max();
    if (result.best.empty() || value < result.value) {
      result.best = x;
      result.value = value;
    }
    if (++in_iteration == settings.particles) {
      in_iteration = 0;
      end_iteration();
    }
    return value;
  }
  // The first one is the start: the particles where they were put.
  void end_iteration() {
    result.history.push_back(result.value);
    result.iterations = static_cast<int>(result.history.size()) - 1;
    if (result.iterations < settings.patience) return;
    const double before = result.history[result.history.size() - 1 - static_cast<std::size_t>(settings.patience)];
    result.converged = before - result.value < settings.tolerance * std::max(1.0, std::abs(result.value));
    if (result.converged) throw Stop{};
  }
};

// What pagmo calls a problem; it is copied, so it only points to the watch.
struct BoxProblem {
  Watch* watch = nullptr;
  std::vector<double> lower, upper;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const { return {watch->evaluate(x)}; }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const { return {lower, upper}; }
};

}  // namespace

SwarmResult minimise(const std::function<double(const std::vector<double>&)>& f, const std::vector<double>& lower,
                     const std::vector<double>& upper, const SwarmSettings& settings) {
  SLIPSTREAM_CHECK(!lower.empty() && lower.size() == upper.size());
  for (std::size_t i = 0; i < lower.size(); ++i) SLIPSTREAM_CHECK(lower[i] < upper[i]);
  SLIPSTREAM_CHECK(settings.particles >= 5 && settings.max_iterations >= 1 && settings.patience >= 1);
  Watch watch{f, settings, {}, 0};
  RandomStream random(settings.seed, 0, "particle_swarm");
  const auto seed = [&] { return static_cast<unsigned>(random.bits() >> 32); };
  try {
    pagmo::population swarm(pagmo::problem(BoxProblem{&watch, lower, upper}),
                            static_cast<pagmo::population::size_type>(settings.particles), seed());
    // Velocity with a constriction (Clerc and Kennedy, 2002; pagmo variant 5), everybody a neighbour of everybody (1). The
    // canonical constriction, 0.7298, leaves the swarm wide after 50 iterations; with 0.6 the stand needs 40 (seeds 1001 to
    // 1020).
    const pagmo::pso pso(static_cast<unsigned>(settings.max_iterations), 0.6, 2.05, 2.05, 0.5, 5, 1, 4, false, seed());
    pso.evolve(swarm);
  } catch (const Stop&) {
  }
  return std::move(watch.result);
}

}  // namespace slipstream
