// Says which messages were ignored, without letting a flood fill the terminal: the first of each kind, then the second, the
// fourth, the eighth, ...
#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <map>
#include <string>

namespace slipstream {

class Rejections {
 public:
  // The line to say about this one; empty: say nothing.
  std::string line(const std::string& channel, const std::string& reason) {
    std::string kind = fmt::format("ignored a message on {}: {}", channel, reason);
    if (counts_.size() >= kMostKinds && !counts_.contains(kind)) return "";
    const std::uint64_t count = ++counts_[kind];
    if (!std::has_single_bit(count)) return "";
    return count == 1 ? kind : fmt::format("{} ({} so far)", kind, count);
  }

 private:
  static constexpr std::size_t kMostKinds = 256;
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace slipstream
