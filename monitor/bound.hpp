// The posterior Cramer-Rao bound of a run: the least mean squared error that any estimator can have of each state.
//
//   E[(x^_k - x_k)(x^_k - x_k)'] >= J_k^-1
//
// J_k: the recursion of Tichavsky, Muravchik and Nehorai (IEEE Transactions on Signal Processing 46, 1998, Proposition 1) for
// additive Gaussian noise, in the form of bound_recursion.hpp. Mean is over the draws of start, process noise and measurement
// noise together, so the errors of a single run may lie below the bound: only their mean square over many runs may not.
//
// The recursion's expectations over the state are left out: its Jacobians are those along the true trajectory of this run.
// Where they do not depend on the state (a linear model) this is the posterior bound itself. Else it differs from run to run,
// and over several runs the variances are averaged. That mean is never below the posterior bound: one step J -> J+ is concave
// and increasing in J and the Jacobians' products, so E[J] <= J_PCRB, and E[J^-1] >= E[J]^-1 >= J_PCRB^-1 (Jensen, twice). The
// averaged variance may therefore be somewhat too high, by the spread of the trajectories, but never too low.
//
// It bounds estimators that know the plant's equations, noise laws and true inputs, and that are told what the sensors of the
// model's outputs measure, all of it. Those that know less, who are told inputs at steps or have other parameters, cannot do
// better on the mean either. Where there is no bound, a sentence says why.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/types.hpp"

namespace slipstream {

struct Scenario;

struct BoundSeries {
  std::vector<std::string> states;
  std::vector<Utime> utime;                   // of the truth's samples; after what is measured there
  std::vector<std::vector<double>> variance;  // of each state, in its unit squared; an entry an instant

  // Null: none of the states.
  const std::vector<double>* of(const std::string& state) const;
};

// The bound, or in one sentence, without a full stop, why there is none.
using Bound = std::variant<BoundSeries, std::string>;

// What truly happened. `column`: of a truth's name, as long as utime; null if there is none.
struct TrueRun {
  std::span<const Utime> utime;
  std::function<const std::vector<double>*(const std::string& name)> column;
};

// What speaks against a bound already before the run; nothing if there is one. The model is estimator.model, not a tuning's
// own.
std::optional<std::string> why_no_bound(const Scenario& scenario);

// Of the run as far as its truth goes; linear in its length. The truth must be known at every push and measurement.
Bound posterior_bound(const Scenario& scenario, const TrueRun& run);

}  // namespace slipstream
