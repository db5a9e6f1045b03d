// A smooth profile: values at points, with a quintic smoothstep between them, constant before the first and after the last.
//
//   y(x) = y_i + (y_{i+1} - y_i) S((x - x_i) / (x_{i+1} - x_i)),   x_i <= x <= x_{i+1},   S(u) = u^3 (10 - 15 u + 6 u^2)
//
// S' and S'' vanish at both ends: y has two continuous derivatives and is level at every point. No points at all: y = 0.
//
// Bumps, the slope h' of their height, each from p to p + l and level with its road at both ends:
//
//   h(x) = H sin^4(a),   a = pi (x - p) / l,   k = pi / l
//   h' = 4 H k sin^3 cos,   h'' = 4 H k^2 sin^2 (3 - 4 sin^2),   h''' = 8 H k^3 sin cos (3 - 8 sin^2)
//
// h has three continuous derivatives; its steepest slope is at sin^2 = 3/4: |h'| = (3 sqrt(3) / 4) pi H / l.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/dual.hpp"
#include "common/refusal.hpp"
#include "common/types.hpp"

namespace slipstream {

// y and its derivatives with respect to the argument.
template <typename T>
struct Derivatives {
  T y{0.0}, first{0.0}, second{0.0};
};

template <typename T>
Derivatives<T> smooth_profile(const T& x, const std::vector<double>& points, const std::vector<double>& values) {
  if (points.empty()) return {};
  const auto next = static_cast<std::size_t>(std::upper_bound(points.begin(), points.end(), value_of(x)) - points.begin());
  if (next == 0) return {T(values.front())};
  if (next == points.size()) return {T(values.back())};
  const double length = points[next] - points[next - 1], rise = values[next] - values[next - 1];
  const T u = (x - points[next - 1]) / length, rest = 1.0 - u;
  return {values[next - 1] + rise * (u * u * u * (10.0 + u * (6.0 * u - 15.0))), (30.0 * rise / length) * (u * u * rest * rest),
          (60.0 * rise / (length * length)) * (u * rest * (1.0 - 2.0 * u))};
}

struct Bumps {
  std::vector<double> position_m, length_m, height_m;  // one behind the other; a negative height is a dip

  // h', h'', h'''.
  template <typename T>
  Derivatives<T> slope(const T& x) const {
    using std::sin, std::cos;
    const auto next =
        static_cast<std::size_t>(std::upper_bound(position_m.begin(), position_m.end(), value_of(x)) - position_m.begin());
    if (next == 0 || value_of(x) >= position_m[next - 1] + length_m[next - 1]) return {};
    const double k = kPi / length_m[next - 1], h = height_m[next - 1];
    const T a = k * (x - position_m[next - 1]), s = sin(a), c = cos(a), s2 = s * s;
    return {(4.0 * h * k) * (s2 * s * c), (4.0 * h * k * k) * (s2 * (3.0 - 4.0 * s2)),
            (8.0 * h * k * k * k) * (s * c * (3.0 - 8.0 * s2))};
  }
  double steepest() const {
    double steepest = 0.0;
    for (std::size_t i = 0; i < position_m.size(); ++i)
      steepest = std::max(steepest, 0.75 * std::sqrt(3.0) * kPi * std::abs(height_m[i]) / length_m[i]);
    return steepest;
  }
};

// Refuses lists of different lengths and points that do not increase; `points_key` and `values_key` are their keys.
inline void require_profile(const std::string& points_key, const std::vector<double>& points, const std::string& values_key,
                            const std::vector<double>& values) {
  if (values.size() != points.size())
    throw Refusal("vehicle." + values_key + ": has " + std::to_string(values.size()) + " values, expected " +
                  std::to_string(points.size()) + ", one for each of vehicle." + points_key);
  for (std::size_t i = 1; i < points.size(); ++i)
    if (!(points[i] > points[i - 1]))
      throw Refusal("vehicle." + points_key + ": expected increasing numbers, found " + std::to_string(points[i]) + " after " +
                    std::to_string(points[i - 1]));
}

}  // namespace slipstream
