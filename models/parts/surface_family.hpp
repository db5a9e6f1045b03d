// A road between the surfaces of Table 1: the tyre's curve as a function of its peak D alone.
//
//   mu(l; D) = D sin(C atan(B l - E (B l - atan(B l)))),   B, C, E piecewise linear in D through the four surfaces,
//
// constant below ice and above dry. At a surface's own D the curve is that surface's, exactly. Between them it is an
// interpolation that no measurement stands for. Source of the four: document 002, Table 1; of the formula: parts/pacejka.hpp.
#pragma once

#include <array>
#include <cmath>

#include "common/dual.hpp"
#include "common/pack.hpp"
#include "models/parts/pacejka.hpp"

namespace slipstream {

// For many values at once, where the library has none: three halvings, atan x = 2 atan(x / (1 + sqrt(1 + x^2))), take any x to
// below tan(pi/16) = 0.2, where the series up to x^19 misses less than 1e-16. Abramowitz and Stegun, 4.4.42 and 4.4.34.
template <typename T>
T arc_tangent(const T& x) {
  if constexpr (requires { std::atan(x); }) {
    return std::atan(x);
  } else if constexpr (requires { x.grad; }) {
    using std::atan;
    return atan(x);
  } else {
    T y = x;
    for (int i = 0; i < 3; ++i) y = y / (1.0 + sqrt(1.0 + y * y));
    const T z = y * y;
    T sum(1.0 / 21.0);
    for (int k = 19; k > 0; k -= 2) sum = 1.0 / k - z * sum;
    return 8.0 * (y * sum);
  }
}

struct SurfaceFamily {
  // From the smallest D.
  static constexpr std::array<PacejkaTyre, 4> kTyres{kSurfaces[3].tyre, kSurfaces[2].tyre, kSurfaces[1].tyre,
                                                     kSurfaces[0].tyre};

  template <typename T>
  static T friction(const T& slip, const T& d) {
    using std::sin;
    T b(kTyres[0].b), c(kTyres[0].c), e(kTyres[0].e);
    for (std::size_t i = 1; i < kTyres.size(); ++i) {
      const PacejkaTyre &low = kTyres[i - 1], &high = kTyres[i];
      const T share = (1.0 / (high.d - low.d)) * clamp(d - low.d, 0.0, high.d - low.d);
      b = b + (high.b - low.b) * share, c = c + (high.c - low.c) * share, e = e + (high.e - low.e) * share;
    }
    const T bl = b * slip;
    return d * sin(c * arc_tangent<T>(bl - e * (bl - arc_tangent<T>(bl))));
  }
};

}  // namespace slipstream
