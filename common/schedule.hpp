// The instants of what happens at a fixed rate: the k-th is at round(k / rate) microseconds, so that no period drifts.
#pragma once

#include "common/types.hpp"

namespace slipstream {

// 0, 1/rate, 2/rate, ...
class Schedule {
 public:
  explicit Schedule(double rate_hz) : rate_hz_(rate_hz) {}
  Utime next() const { return utime_of(static_cast<double>(k_) / rate_hz_); }
  void pass() { ++k_; }

 private:
  double rate_hz_;
  std::int64_t k_ = 0;
};

}  // namespace slipstream
