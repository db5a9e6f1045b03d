#include "io/log_writer.hpp"

#include <fmt/format.h>

#include <lcm/lcm-cpp.hpp>

#include "common/refusal.hpp"

namespace slipstream {

struct LogWriter::Impl {
  std::string path;
  lcm::LogFile log;
  lcm::LogEvent event;
  std::int64_t count = 0;

  explicit Impl(const std::string& p) : path(p), log(p, "w") {}
};

LogWriter::LogWriter(const std::string& path) : impl_(std::make_unique<Impl>(path)) {
  if (!impl_->log.good()) throw Refusal(fmt::format("{}: cannot write the log", path));
}

LogWriter::~LogWriter() = default;

void LogWriter::write(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size) {
  Impl& s = *impl_;
  s.event.eventnum = s.count++;
  s.event.timestamp = wall_utime;
  s.event.channel = channel;
  s.event.datalen = static_cast<std::int32_t>(size);
  s.event.data = const_cast<void*>(data);  // LCM's interface; it only reads
  if (s.log.writeEvent(&s.event) != 0)
    throw std::runtime_error(fmt::format("{}: cannot write the log; is the disk full?", s.path));
}

std::int64_t LogWriter::events() const { return impl_->count; }

}  // namespace slipstream
