// Wrong input from outside: one line that says where, what was found and what was expected. Every main() turns it
// into that line on stderr and a non-zero exit.
#pragma once

#include <stdexcept>
#include <string>

namespace slipstream {

class Refusal : public std::runtime_error {
 public:
  explicit Refusal(const std::string& line) : std::runtime_error(line) {}
};

}  // namespace slipstream
