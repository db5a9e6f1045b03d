#include "studies/progress_line.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace slipstream {
namespace {

constexpr double kRedraw_s = 0.2;  // on a terminal
constexpr double kPrint_s = 5.0;   // elsewhere

// Columns of the terminal; 0: nobody sees a line being redrawn (a file, or the pseudo-terminal of mpirun, which has no size).
std::size_t width() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 10 ? size.ws_col - 1U : 0U;
}

bool is_terminal() { return width() > 0; }

std::string duration_text(double s) {
  if (s < 90.0) return fmt::format("{:.0f} s", std::ceil(s));
  return s < 5400.0 ? fmt::format("{:.0f} min", s / 60.0) : fmt::format("{:.1f} h", s / 3600.0);
}

}  // namespace

void ProgressLine::show(const std::string& line, bool matters) {
  if (line == shown_) return;
  if (is_terminal()) {
    fmt::print("\r{:<{}.{}}", line, width(), width());
  } else if (matters || shown_.empty()) {
    fmt::print("{}\n", line);
  }
  std::fflush(stdout);
  shown_ = line;
}

void ProgressLine::clear() {
  if (is_terminal() && !shown_.empty()) fmt::print("\r{:<{}}\r", "", width());
  shown_.clear();
}

void RunsProgress::show(std::size_t done, std::size_t finished_here, std::size_t all) {
  const Clock::time_point now = Clock::now();
  const auto since = [now](Clock::time_point t) { return std::chrono::duration<double>(now - t).count(); };
  if (finished_here == 0 || since(is_terminal() ? shown_ : printed_) < (is_terminal() ? kRedraw_s : kPrint_s)) return;
  shown_ = printed_ = now;
  const double rate = static_cast<double>(finished_here) / since(started_);
  line_.show(
      fmt::format("[{}/{}] {:.3g} runs/s, {} left", done, all, rate, duration_text(static_cast<double>(all - done) / rate)),
      true);
}

}  // namespace slipstream
