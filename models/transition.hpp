// A process model in discrete time: x+ = f(x, u, dt), by Runge-Kutta steps of fourth order as many as stability needs, u
// constant.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/jacobian.hpp"
#include "common/rk4.hpp"
#include "models/process.hpp"

namespace slipstream {

// How many Runge-Kutta steps dt needs: stable up to 2.78 over the fastest rate, 2 to keep some distance.
inline int transition_steps(double fastest_rate_hz, double dt_s) {
  constexpr double kMostSteps = 10000.0;
  const double times_rate = 0.5 * dt_s * fastest_rate_hz;
  return !(times_rate > 1.0) ? 1 : static_cast<int>(std::min(std::ceil(times_rate), kMostSteps));
}
// On the way from x.
template <ProcessModel M>
int transition_steps(const M& model, const Vector<double, M::kStates>& x, double dt_s) {
  return transition_steps(model.fastest_rate_hz(x), dt_s);
}

// The model's constants, or none.
template <ProcessModel M>
consteval std::array<bool, M::kStates> constant_states() {
  if constexpr (requires { M::kConstant; }) return M::kConstant;
  return {};
}

// U, H: double, or as many inputs and durations as T has lanes, where the model takes them (process.hpp).
template <ProcessModel M, typename T, typename U, typename H>
Vector<T, M::kStates> single_transition(const M& model, const Vector<T, M::kStates>& x, const Vector<U, M::kInputs>& u,
                                        const H& dt_s) {
  return rk4_step([&](const Vector<T, M::kStates>& s) { return model.derivative(s, u); }, x, dt_s, constant_states<M>());
}

// x+ = f(x, u, dt) for any scalar.
template <ProcessModel M, typename T>
Vector<T, M::kStates> transition(const M& model, Vector<T, M::kStates> x, const Vector<double, M::kInputs>& u, double dt_s) {
  Vector<double, M::kStates> at;
  for (int i = 0; i < M::kStates; ++i) at[i] = value_of(x[i]);
  const int steps = transition_steps(model, at, dt_s);
  for (int i = 0; i < steps; ++i) x = single_transition(model, x, u, dt_s / steps);
  return x;
}

// x+ and F = df/dx. The usual single step is a path of its own: it is what a filter does a million times.
template <ProcessModel M>
[[gnu::noinline]] void divided_transition(const M& model, const Vector<double, M::kStates>& x,
                                          const Vector<double, M::kInputs>& u, double dt_s, Vector<double, M::kStates>& to,
                                          Matrix<double, M::kStates>& f) {
  value_and_jacobian<M::kStates>([&](const auto& s) { return transition(model, s, u, dt_s); }, x, to, f);
}
template <ProcessModel M>
void transition_and_jacobian(const M& model, const Vector<double, M::kStates>& x, const Vector<double, M::kInputs>& u,
                             double dt_s, Vector<double, M::kStates>& to, Matrix<double, M::kStates>& f) {
  if (transition_steps(model, x, dt_s) > 1) return divided_transition(model, x, u, dt_s, to, f);
  value_and_jacobian<M::kStates>([&](const auto& s) { return single_transition(model, s, u, dt_s); }, x, to, f);
}

}  // namespace slipstream
