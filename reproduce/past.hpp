// What the experiments past the documents share: a bar that was set beforehand, and whether a value meets it.
#pragma once

#include <fmt/format.h>

#include <string>

#include "reproduce/outcome.hpp"

namespace slipstream {

// "the bar of 0.998 is met", "the bar of 3 is missed".
inline std::string against_bar(double bar, Aim aim, double value) {
  const bool met = aim == Aim::kHigh ? value >= bar : value <= bar;
  return fmt::format("the bar of {:g} is {}", bar, met ? "met" : "missed");
}

}  // namespace slipstream
