// Classical Runge-Kutta step of fourth order for x' = f(x), inputs held constant over the step:
//   k1 = f(x), k2 = f(x + dt/2 k1), k3 = f(x + dt/2 k2), k4 = f(x + dt k3),  x+ = x + dt/6 (k1 + 2 k2 + 2 k3 + k4)
#pragma once

#include <array>
#include <type_traits>

#include "common/types.hpp"

namespace slipstream {

// States that are constant, whose derivative is 0, are left alone. H: double, or as many durations as T has lanes (pack.hpp).
template <typename T, int N, typename F, typename H>
Vector<T, N> rk4_step(const F& f, const Vector<T, N>& x, const H& dt_s,
                      const std::type_identity_t<std::array<bool, N>>& is_constant = {}) {
  // Element by element: Eigen's packets of a state written piece by piece stall.
  const auto along = [&](const Vector<T, N>& k, const H& h) {
    Vector<T, N> y = x;
    for (std::size_t i = 0; i < N; ++i)
      if (!is_constant[i]) y[i] = x[i] + k[i] * h;
    return y;
  };
  const Vector<T, N> k1 = f(x);
  const Vector<T, N> k2 = f(along(k1, 0.5 * dt_s));
  const Vector<T, N> k3 = f(along(k2, 0.5 * dt_s));
  const Vector<T, N> k4 = f(along(k3, dt_s));
  Vector<T, N> to = x;
  for (std::size_t i = 0; i < N; ++i)
    if (!is_constant[i]) to[i] = x[i] + (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * (dt_s / 6.0);
  return to;
}

}  // namespace slipstream
