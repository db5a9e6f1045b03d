// An LCM log file, written event by event without loss.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace slipstream {

class LogWriter {
 public:
  // Creates or replaces the file; refuses a path that cannot be written.
  explicit LogWriter(const std::string& path);
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  void write(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size);
  std::int64_t events() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
