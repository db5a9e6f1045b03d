// How a plain parameter struct shows its fields to whoever fills or prints them, without knowing who that is.
//
// A struct P lists its fields once, as `template <typename Self, typename V> static void visit_parameters(Self& p, V& v)`
// with calls v.number(key, p.field, range), v.list(key, p.field, range), v.triple(key, p.field, range), v.choice(key, p.field,
// options), v.choices(key, p.field, options), v.flag(key, p.field). Keys carry their unit as suffix. The field's initialiser is
// the default.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace slipstream {

// Admissible values, both ends included; `positive` excludes zero.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool excludes_min = false;

  bool contains(double x) const { return x <= max && (excludes_min ? x > min : x >= min); }
};

constexpr Range any_number() { return {}; }
constexpr Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
constexpr Range non_negative() { return {0.0, std::numeric_limits<double>::infinity(), false}; }
constexpr Range between(double min, double max) { return {min, max, false}; }

using Choices = std::vector<std::string>;

}  // namespace slipstream
