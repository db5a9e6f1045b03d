// Angles among the series: a quantity whose unit is "rad" is one, and full turns of it mean nothing. The only place that knows.
//
//   nearest(a; b) = a - 2 pi round((a - b)/2 pi)        the turn of a nearest to b: nearest(a; b) - b is in [-pi, pi]
//
// A truth series is kept unwrapped, each known value on the turn nearest to the known one before it, so that it is interpolated
// on the circle and its variance means something. An estimate is scored and drawn on the turn nearest to its truth. What is
// already there stays as it is, bit for bit: a heading that counts its laps scores as published.
//
// For people (report, tables, terminal) angles are in degrees; in files they stay in rad.
#pragma once

#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/types.hpp"

namespace slipstream {

inline bool is_angle(std::string_view unit) { return unit == "rad"; }

inline double nearest_turn(double angle, double reference) {
  const double turns = std::round((angle - reference) / (2.0 * kPi));
  return turns == 0.0 || !std::isfinite(turns) ? angle : angle - 2.0 * kPi * turns;
}

// The estimate of an angle on the turn of its truth; where that is not known, of the estimate before it.
inline std::vector<double> on_turn_of(std::span<const double> truth, std::span<const double> estimate) {
  std::vector<double> result(estimate.begin(), estimate.end());
  double reference = std::nan("");
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (std::isfinite(truth[i])) reference = truth[i];
    result[i] = nearest_turn(result[i], reference);
    if (std::isfinite(result[i])) reference = result[i];
  }
  return result;
}

// What people are shown.
inline double shown_scale(std::string_view unit) { return is_angle(unit) ? 180.0 / kPi : 1.0; }
inline std::string shown_unit(std::string_view unit) { return is_angle(unit) ? "deg" : std::string(unit); }

}  // namespace slipstream
