// What the measurements can tell about each state: observability, linear and along a trajectory, and as a number for each
// state.
//
// Linear, x' = A x, z = C x:  O = [C; C A; ...; C A^(n-1)],  observable where rank O = n  (document 002, eqs 5.2-5.5).
//
// Local and nonlinear, at instants k of a trajectory x_k with inputs u_k:
//
//   Phi_k = F_{k-1} ... F_0,   O = [...; R_k^-1/2 H_k Phi_k P_0^1/2; ...]        F = df/dx, H = dh/dx by dual numbers
//
// with P_0 the start's and R the sensors' variances, both diagonal; R of a relative noise is the expected one, as in
// kalman.hpp. So O has no dimension: a singular value s means that the window's measurements divide the start's variance in
// that direction by 1 + s^2. The variance ratio of a state, diag((I + O'O)^-1), is what is left of its start's variance,
// without process noise.
//
//   rank          singular values above 1e-10 of the largest: what is below is rounding of the products
//   unobservable  states with a part above 1e-6 in the null space of O
//   weak          observable, and more than half of the start's variance is left
//   fading        the null space shrinks by more than 1 % over the window: what nobody measures dies out by itself
//
// Krener and Ide, Measures of unobservability (IEEE CDC 2009); Simon, Optimal State Estimation (2006), section 1.7.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "models/scenario.hpp"

namespace slipstream {

// a: n x n; c: m x n. The result is (n m) x n.
Eigen::MatrixXd observability_matrix(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c);
int numerical_rank(const Eigen::MatrixXd& matrix);

struct Observability {
  struct State {
    std::string name;
    double variance_ratio = 1.0;  // left of the start's variance after the window; 1: the measurements say nothing
    bool unobservable = false;
    bool weak = false;
  };
  std::string model;
  std::vector<std::string> outputs;  // those that a sensor measures
  std::vector<State> states;
  double window_s = 0.0;  // ends where the model is no longer finite
  int rank = 0;
  std::vector<double> singular_values;  // one per state, largest first
  double gramian_condition = 1.0;       // of O'O: (largest / smallest singular value)^2, infinite where rank < n
  bool fading = false;                  // only where rank < n

  bool observable() const { return rank == static_cast<int>(states.size()); }
  std::vector<std::string> unobservable() const;
  std::vector<std::string> weak() const;
};

inline constexpr double kObservabilityWindow_s = 1.0;

// Of the scenario's process model (the tuning's, where it has its own) with the sensors that there are. The trajectory starts
// from the tuning's initial mean and has no input. If that is not observable, one that starts a standard deviation beside it
// decides: at rest, drag and slip have no slope. Refuses an initial variance of zero.
Observability observability_of(const Scenario& scenario, const Tuning& tuning);

// Along given states (in the model's order) and inputs, dt_s apart, every sensor at every instant. inputs[k] acts from
// states[k] to states[k + 1]. Refuses rows of another length.
Observability observability_along(const Scenario& scenario, const Tuning& tuning,
                                  const std::vector<std::vector<double>>& states,
                                  const std::vector<std::vector<double>>& inputs, double dt_s);

// One line for users where the model is not observable, else empty; empty, too, where the model was not finite at the very
// start, so that nothing can be said.
std::string observability_line(const Observability& o);

}  // namespace slipstream
