#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <thread>

#include "common/refusal.hpp"
#include "io/interrupt.hpp"
#include "io/log_writer.hpp"
#include "io/transport.hpp"

namespace slipstream {

namespace {

constexpr std::int64_t kEventHeaderBytes = 28;  // sync word, event number, timestamp, two lengths
constexpr int kEventsPerPoll = 64;

struct LogUrl {
  std::string path;
  double speed = 1.0;
};

LogUrl parse(const std::string& url) {
  LogUrl result;
  const std::string rest = url.substr(std::string("file://").size());
  const auto question = rest.find('?');
  result.path = rest.substr(0, question);
  if (question == std::string::npos) return result;
  const std::string option = rest.substr(question + 1);
  char* end = nullptr;
  if (option.rfind("speed=", 0) == 0) result.speed = std::strtod(option.c_str() + 6, &end);
  if (end == nullptr || end == option.c_str() + 6 || *end != '\0' || !(result.speed >= 0.0 && result.speed <= 1e6))
    throw Refusal(fmt::format(
        "--lcm-url: cannot use '{}'; expected file://LOG?speed=S with S >= 0, where 0 is as fast as possible", url));
  return result;
}

// A log that is being written, under another name until it is complete.
class PartialLog {
 public:
  explicit PartialLog(const std::string& path) : path_(path) {
    try {
      log_ = std::make_unique<LogWriter>(partial());
    } catch (const Refusal&) {
      throw Refusal(fmt::format("{}: cannot write the log", path));
    }
  }
  ~PartialLog() {
    if (!log_) return;
    log_.reset();
    std::error_code ignored;
    std::filesystem::remove(partial(), ignored);
  }
  PartialLog(const PartialLog&) = delete;
  PartialLog& operator=(const PartialLog&) = delete;

  void write(const std::string& channel, std::int64_t utime, const void* data, std::size_t size) {
    log_->write(channel, utime, data, size);
  }
  void complete() {
    log_.reset();  // closes the file
    std::error_code error;
    std::filesystem::rename(partial(), path_, error);
    if (error) throw Refusal(fmt::format("{}: cannot write the log: {}", path_, error.message()));
  }

 private:
  std::string partial() const { return path_ + ".partial"; }

  std::string path_;
  std::unique_ptr<LogWriter> log_;
};

class NewLog final : public Transport {
 public:
  explicit NewLog(const std::string& path) : log_(path) {}
  void subscribe(const std::vector<std::string>&, RawHandler) override {}
  bool poll(int) override { return false; }
  void publish(const std::string& channel, const void* data, std::size_t size) override {
    log_.write(channel, now_, data, size);
  }
  void complete() override { log_.complete(); }
  void at(std::int64_t utime) override { now_ = utime; }

 private:
  PartialLog log_;
  std::int64_t now_ = 0;
};

class LogTransport final : public Transport {
 public:
  LogTransport(const std::string& url, const std::string& out_path) : url_(parse(url)) {
    std::error_code error;
    size_ = static_cast<std::int64_t>(std::filesystem::file_size(url_.path, error));
    if (error) throw Refusal(fmt::format("{}: cannot read the log: {}", url_.path, error.message()));
    log_ = std::make_unique<lcm::LogFile>(url_.path, "r");
    if (!log_->good()) throw Refusal(fmt::format("{}: cannot read the log", url_.path));
    if (!out_path.empty()) {
      if (std::filesystem::equivalent(out_path, url_.path, error))
        throw Refusal(fmt::format("--out: '{}' is the log that is being read", out_path));
      out_ = std::make_unique<PartialLog>(out_path);
    }
  }

  void subscribe(const std::vector<std::string>& channels, RawHandler handler) override {
    channels_ = channels;
    handler_ = std::move(handler);
  }

  bool poll(int) override {
    for (int i = 0; i < kEventsPerPoll && !interrupted(); ++i) {
      const lcm::LogEvent* event = log_->readNextEvent();
      if (event == nullptr) {
        if (read_ != size_)
          throw Refusal(fmt::format("{}: the log is damaged or cut off after byte {} of {}", url_.path, read_, size_));
        return false;
      }
      read_ += kEventHeaderBytes + static_cast<std::int64_t>(event->channel.size()) + event->datalen;
      now_ = event->timestamp;
      pace();
      if (wanted(event->channel))
        handler_(event->channel, event->timestamp, event->data, static_cast<std::size_t>(event->datalen));
    }
    return true;
  }

  void publish(const std::string& channel, const void* data, std::size_t size) override {
    if (out_) out_->write(channel, now_, data, size);
  }

  void complete() override {
    if (out_) out_->complete();
  }

 private:
  bool wanted(const std::string& channel) const {
    for (const std::string& c : channels_) {
      const bool prefix = c.size() >= 2 && c.compare(c.size() - 2, 2, ".*") == 0;
      if (prefix ? channel.compare(0, c.size() - 2, c, 0, c.size() - 2) == 0 : channel == c) return true;
    }
    return false;
  }
  void pace() {
    if (url_.speed == 0.0) return;
    using Clock = std::chrono::steady_clock;
    if (first_ < 0) {
      first_ = now_;
      started_ = Clock::now();
    }
    const auto offset = std::chrono::duration<double, std::micro>(static_cast<double>(now_ - first_) / url_.speed);
    const Clock::time_point due = started_ + std::chrono::duration_cast<Clock::duration>(offset);
    while (Clock::now() < due && !interrupted())
      std::this_thread::sleep_until(std::min(due, Clock::now() + std::chrono::milliseconds(50)));
  }

  LogUrl url_;
  std::int64_t size_ = 0;
  std::int64_t read_ = 0;
  std::int64_t now_ = 0;
  std::int64_t first_ = -1;
  std::chrono::steady_clock::time_point started_;
  std::unique_ptr<lcm::LogFile> log_;
  std::unique_ptr<PartialLog> out_;
  std::vector<std::string> channels_;
  RawHandler handler_;
};

}  // namespace

std::unique_ptr<Transport> open_new_log(const std::string& path) { return std::make_unique<NewLog>(path); }

std::unique_ptr<Transport> open_log(const std::string& url, const std::string& out_path) {
  return std::make_unique<LogTransport>(url, out_path);
}

}  // namespace slipstream
