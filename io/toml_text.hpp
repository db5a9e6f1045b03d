// Numbers and text as TOML prints them, and the words of "expected ...".
#pragma once

#include <string>

#include "common/parameters.hpp"

namespace slipstream {

// The shortest decimals that read back to the same bits; whole numbers without a point.
std::string digits(double value);

// The same as a TOML float, which is always told from an integer.
std::string toml_number(double value);

// A basic string: quoted, on one line, every control character escaped.
std::string toml_text(const std::string& text);

// "a number greater than 0 and at most 10"; "a finite number ..." where what was found is not finite.
std::string expected_number(const Range& range, bool found_finite = true);

// "one of "a", "b""
std::string expected_choice(const Choices& options);

// "[inner]"
inline std::string bracketed(const std::string& inner) { return std::string("[").append(inner).append("]"); }

template <typename Items, typename Print>
std::string joined(const Items& items, const Print& print) {
  std::string line;
  for (const auto& item : items) line += (line.empty() ? "" : ", ") + print(item);
  return line;
}

}  // namespace slipstream
