// Dual numbers of which each lane has a value and a gradient of its own: what must choose does so lane by lane.
//
// With it a model's f(x, u) and df/dx of several instants come out of one evaluation: Dual<PackOf<width, lanes>, n>.
#pragma once

#include "common/dual.hpp"
#include "common/pack.hpp"

namespace slipstream {

template <int W, int L, int N>
Dual<PackOf<W, L>, N> clamp(const Dual<PackOf<W, L>, N>& x, double low, double high) {
  using P = PackOf<W, L>;
  const P end = clamp(x.value, low, high), off = (x.value - end) * (x.value - end);
  return {end, x.grad * select_less(0.0, off, P(0.0), P(1.0))};  // a comparison of its own: shared, it is made lane by lane
}
template <int W, int L, int N>
Dual<PackOf<W, L>, N> abs(const Dual<PackOf<W, L>, N>& a) {
  const PackOf<W, L> sign = select_less(a.value, 0.0, PackOf<W, L>(-1.0), PackOf<W, L>(1.0));
  return {a.value * sign, a.grad * sign};
}

}  // namespace slipstream
