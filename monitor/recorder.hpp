// Every message into the log of its run. What comes before a run is known waits, so that a log begins with its announcements.
//
// `Log` is what writes the file (this room names no such thing; main.cpp does): made from a path, with write() and events().
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>

namespace slipstream {

template <typename Log>
class Recorder {
 public:
  void open(const std::string& path) {
    log_.reset();  // it may have the same path: what it still holds must not reach the new file
    log_ = std::make_unique<Log>(path);
  }
  void close() {
    flush();
    log_.reset();
  }
  // The newest message is held back: it may be the one that opens the next log.
  void add(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size) {
    flush();
    const auto* bytes = static_cast<const char*>(data);
    pending_.push_back({channel, wall_utime, std::string(bytes, bytes + size)});
    for (pending_size_ += size; pending_size_ > kMaxPending; pending_.pop_front())
      pending_size_ -= pending_.front().data.size();
  }
  void flush() {
    if (!log_) return;
    for (const Event& e : pending_) log_->write(e.channel, e.wall_utime, e.data.data(), e.data.size());
    pending_.clear();
    pending_size_ = 0;
  }
  // Leaves the newest message for the next log.
  void close_before_newest() { log_.reset(); }
  std::int64_t events() const { return log_ ? log_->events() : 0; }

 private:
  static constexpr std::size_t kMaxPending = 4u << 20;
  struct Event {
    std::string channel;
    std::int64_t wall_utime;
    std::string data;
  };
  std::unique_ptr<Log> log_;
  std::deque<Event> pending_;
  std::size_t pending_size_ = 0;
};

}  // namespace slipstream
