// Where encoded messages come from and go to: an LCM network, or a log file read at a chosen speed. Only bus.cpp includes this.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace slipstream {

using RawHandler = std::function<void(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size)>;

class Transport {
 public:
  virtual ~Transport() = default;
  // Literal channels, or patterns of the form PREFIX.* ; call once.
  virtual void subscribe(const std::vector<std::string>& channels, RawHandler handler) = 0;
  // Waits up to timeout_ms, then handles all that is pending. False when nothing can follow.
  virtual bool poll(int timeout_ms) = 0;
  virtual void publish(const std::string& channel, const void* data, std::size_t size) = 0;
  // Nothing more will be published: what goes to a file gets its name.
  virtual void complete() {}
  // The time that a new log gives to what is published from now on.
  virtual void at(std::int64_t) {}
};

// udpm://, and whatever else LCM opens.
std::unique_ptr<Transport> open_network(const std::string& url);
// file://PATH?speed=S: S = 0 as fast as possible, 1 as recorded. What is published goes to `out_path` (empty: nowhere), which
// is there when it is complete, or not at all.
std::unique_ptr<Transport> open_log(const std::string& url, const std::string& out_path);
// A new log at `path`, which is there when it is complete, or not at all.
std::unique_ptr<Transport> open_new_log(const std::string& path);

}  // namespace slipstream
