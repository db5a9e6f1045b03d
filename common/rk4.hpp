// Classical Runge-Kutta step of fourth order for x' = f(x), inputs held constant over the step:
//   k1 = f(x), k2 = f(x + dt/2 k1), k3 = f(x + dt/2 k2), k4 = f(x + dt k3),  x+ = x + dt/6 (k1 + 2 k2 + 2 k3 + k4)
#pragma once

#include "common/types.hpp"

namespace slipstream {

template <typename T, int N, typename F>
Vector<T, N> rk4_step(const F& f, const Vector<T, N>& x, double dt_s) {
  const Vector<T, N> k1 = f(x);
  const Vector<T, N> k2 = f(Vector<T, N>(x + k1 * (0.5 * dt_s)));
  const Vector<T, N> k3 = f(Vector<T, N>(x + k2 * (0.5 * dt_s)));
  const Vector<T, N> k4 = f(Vector<T, N>(x + k3 * dt_s));
  return x + (k1 + (k2 + k3) * 2.0 + k4) * (dt_s / 6.0);
}

}  // namespace slipstream
