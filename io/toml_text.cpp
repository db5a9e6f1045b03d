#include "io/toml_text.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>

namespace slipstream {

// Shortest decimals that read back to the same bits.
std::string digits(double value) {
  char buffer[64];
  const bool whole = std::abs(value) < 1e15 && value == std::trunc(value);
  const auto end = whole ? std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed).ptr
                         : std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return std::string(buffer, end);
}

std::string toml_number(double value) {
  const std::string text = digits(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string toml_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (byte < 0x20 || byte == 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04X", byte);
      quoted += escape;
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

namespace {

std::string limits_of(const Range& range) {
  const bool below = std::isfinite(range.min), above = std::isfinite(range.max);
  if (below && above && !range.excludes_min) return "from " + digits(range.min) + " to " + digits(range.max);
  std::string line;
  if (below) line += range.excludes_min ? "greater than " + digits(range.min) : "of at least " + digits(range.min);
  if (above) line += (below ? " and at most " : "of at most ") + digits(range.max);
  return line;
}

}  // namespace

std::string expected_number(const Range& range, bool found_finite) {
  const std::string limits = limits_of(range);
  return std::string(found_finite ? "a number" : "a finite number") + (limits.empty() ? "" : " " + limits);
}

std::string expected_choice(const Choices& options) {
  const std::string list = joined(options, toml_text);
  return options.size() == 1 ? list : "one of " + list;
}

}  // namespace slipstream
