// A timetable: values at points of time, linear between them, constant before the first and after the last.
//
//   y(t) = y_i + (y_{i+1} - y_i) (t - t_i) / (t_{i+1} - t_i),   t_i <= t <= t_{i+1}
//
// Every point is a kink. A vehicle makes each an event and asks for the line between two of them, which is smooth.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/refusal.hpp"

namespace slipstream {

// The straight piece between two points, and its continuation beyond them.
struct TimetableLine {
  double from_s = 0.0;
  double value = 0.0;  // at from_s
  double rate = 0.0;   // per second

  template <typename T>
  T at(const T& t) const {
    return value + rate * (t - from_s);
  }
};

// The line from from_s to the next point. The lists fit together: see require_timetable.
inline TimetableLine timetable_line(double from_s, const std::vector<double>& time_s, const std::vector<double>& value) {
  const auto next = static_cast<std::size_t>(std::upper_bound(time_s.begin(), time_s.end(), from_s) - time_s.begin());
  if (next == 0) return {from_s, value.front(), 0.0};
  if (next == time_s.size()) return {from_s, value.back(), 0.0};
  return {time_s[next - 1], value[next - 1], (value[next] - value[next - 1]) / (time_s[next] - time_s[next - 1])};
}

// Refuses lists that are empty, of different lengths, or whose times do not increase; `times` and `values` are their keys.
inline void require_timetable(const std::string& times, const std::vector<double>& time_s, const std::string& values,
                              const std::vector<double>& value) {
  if (time_s.empty()) throw Refusal("vehicle." + times + ": is empty, expected at least one time");
  if (value.size() != time_s.size())
    throw Refusal("vehicle." + values + ": has " + std::to_string(value.size()) + " values, expected " +
                  std::to_string(time_s.size()) + ", one for each of vehicle." + times);
  for (std::size_t i = 1; i < time_s.size(); ++i)
    if (time_s[i] <= time_s[i - 1])
      throw Refusal("vehicle." + times + ": expected increasing values, found " + std::to_string(time_s[i]) + " after " +
                    std::to_string(time_s[i - 1]));
}

}  // namespace slipstream
