// The bus: LCM behind plain structs. The only header through which the programs meet LCM.
//
// Every received byte is hostile: sizes, strings and numbers are checked before a handler sees the message; what fails is
// counted per channel and reported, never thrown. Queues are unlimited and the receive buffer is 4 MiB, because LCM drops
// silently; `poll` drains everything that is pending.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/messages.hpp"

namespace slipstream {

inline constexpr const char* kDefaultLcmUrl = "udpm://239.255.76.67:7667?ttl=0";

// Participant names appear in channels, file names and plots: 1 to 32 characters of [A-Za-z0-9_-].
bool is_valid_name(const std::string& name);

// A number that no other process on this bus has, for Announcement::instance: the wall clock and the process id.
std::int64_t process_instance();

struct Handlers {
  std::function<void(const RunDescriptor&)> run;
  std::function<void(const Tick&)> tick;
  std::function<void(const Reading&)> reading;  // every input and sensor
  std::function<void(const Truth&)> truth;
  std::function<void(const Estimate&)> estimate;
  std::function<void(const Announcement&)> announcement;
  std::function<void(const Progress&)> progress;
  std::function<void(const Control&)> control;
  // Every message of the bus as it came, before it is decoded: for recorders.
  std::function<void(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size)> raw;
  // A message that could not be used: malformed, not finite where it must be, a name out of form.
  std::function<void(const std::string& channel, const std::string& reason)> rejected;
};

class Bus {
 public:
  // Opens a URL: udpm://GROUP:PORT?ttl=N, or file://LOG?speed=S to read a log. Refuses a URL it cannot open, and says what to
  // do about a missing multicast route. With a log, what is published goes to the log `log_out` (empty: nowhere).
  explicit Bus(const std::string& lcm_url, const std::string& log_out = "");
  // A new log that is only written to.
  static Bus new_log(const std::string& path);
  ~Bus();
  Bus(Bus&&) noexcept;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  // Subscribes to the channels of those handlers that are set. Call once.
  void subscribe(Handlers handlers);

  // Waits up to timeout_ms for a message, then handles all that are pending. False at the end of a log. Refuses a log that is
  // damaged or cut off, when it gets there.
  bool poll(int timeout_ms);

  void publish(const RunDescriptor& m);
  void publish(const Reading& m);
  void publish(const Truth& m);
  void publish(const Tick& m);
  void publish(const Estimate& m);
  void publish(const Announcement& m);
  void publish(const Progress& m);
  void publish(const Control& m);
  // A message as it came (Handlers::raw).
  void publish_raw(const std::string& channel, const void* data, std::size_t size);
  // Of a new log: the time of what is published from now on.
  void at(std::int64_t utime);

  // With a log: `log_out` is complete. Until then it is not there under its name, and without this call it never is.
  void complete();

 private:
  struct Impl;
  explicit Bus(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
