// A timetable: values at points of time, linear between them, constant before the first and after the last.
//
//   y(t) = y_i + (y_{i+1} - y_i) (t - t_i) / (t_{i+1} - t_i),   t_i <= t <= t_{i+1}
//
// Every point is a kink; two points at one time are a step. A vehicle whose state has the time makes each an event, counts in
// its mode those that are past, and asks for the line until the next one, which is smooth.
#pragma once

#include <algorithm>
#include <string>
#include <utility>
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

// The line from from_s to the next point; a step at from_s is past. The lists fit together: see require_timetable.
inline TimetableLine timetable_line(double from_s, const std::vector<double>& time_s, const std::vector<double>& value) {
  const auto next = static_cast<std::size_t>(std::upper_bound(time_s.begin(), time_s.end(), from_s) - time_s.begin());
  if (next == 0) return {from_s, value.front(), 0.0};
  if (next == time_s.size()) return {from_s, value.back(), 0.0};
  return {time_s[next - 1], value[next - 1], (value[next] - value[next - 1]) / (time_s[next] - time_s[next - 1])};
}

// Refuses lists that are empty, of different lengths, or whose times decrease or are three times the same; `times` and `values`
// are their keys.
inline void require_timetable(const std::string& times, const std::vector<double>& time_s, const std::string& values,
                              const std::vector<double>& value) {
  if (time_s.empty()) throw Refusal("vehicle." + times + ": is empty, expected at least one time");
  if (value.size() != time_s.size())
    throw Refusal("vehicle." + values + ": has " + std::to_string(value.size()) + " values, expected " +
                  std::to_string(time_s.size()) + ", one for each of vehicle." + times);
  for (std::size_t i = 1; i < time_s.size(); ++i)
    if (time_s[i] < time_s[i - 1] || (i > 1 && time_s[i] == time_s[i - 2]))
      throw Refusal("vehicle." + times + ": expected increasing times, or two that are equal for a step, found " +
                    std::to_string(time_s[i]) + " after " + std::to_string(time_s[i - 1]));
}

// The points of one or several timetables in order: a vehicle's clockwork of modes and events.
class TimePoints {
 public:
  using Mode = std::size_t;  // points past

  // Any order, any number of times each.
  explicit TimePoints(std::vector<double> s = {}) : at_s_(std::move(s)) {
    std::sort(at_s_.begin(), at_s_.end());
    at_s_.erase(std::unique(at_s_.begin(), at_s_.end()), at_s_.end());
  }
  std::size_t modes() const { return at_s_.size() + 1; }
  Mode at_start() const { return !at_s_.empty() && at_s_.front() <= 0.0 ? 1 : 0; }
  // A time from which on the mode lasts.
  double begin_s(Mode mode) const { return mode == 0 ? at_s_.front() - 1.0 : at_s_[mode - 1]; }
  // Crosses zero, rising, when the mode ends; negative for the last one.
  double event(double t, Mode mode) const { return mode < at_s_.size() ? t - at_s_[mode] : -1.0; }
  Mode after(Mode mode) const { return std::min(mode + 1, at_s_.size()); }

 private:
  std::vector<double> at_s_;
};

}  // namespace slipstream
