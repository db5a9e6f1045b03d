// How far a long computation is: one line at the bottom of a terminal that is redrawn; elsewhere a line now and then.
#pragma once

#include <chrono>
#include <string>

namespace slipstream {

class ProgressLine {
 public:
  // Not on a terminal only lines that `matter` are printed.
  void show(const std::string& line, bool matters);
  void clear();  // before another line is printed

 private:
  std::string shown_;
};

// "[120/300] 85 runs/s, 2 s left"
class RunsProgress {
 public:
  void show(std::size_t done, std::size_t finished_here, std::size_t all);
  void clear() { line_.clear(); }

 private:
  using Clock = std::chrono::steady_clock;
  ProgressLine line_;
  Clock::time_point started_ = Clock::now(), shown_{}, printed_ = started_;
};

}  // namespace slipstream
