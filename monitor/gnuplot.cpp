#include "monitor/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr std::size_t kMaxOutput = 64u << 20;

// Both ends are closed in a child unless it is given them as a standard stream.
class Pipe {
 public:
  Pipe() { ok_ = ::pipe2(ends_.data(), O_CLOEXEC) == 0; }
  ~Pipe() {
    close(0);
    close(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  bool ok() const { return ok_; }
  int end(std::size_t i) const { return ends_[i]; }
  void close(std::size_t i) {
    if (ends_[i] >= 0) ::close(ends_[i]);
    ends_[i] = -1;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
  bool ok_ = false;
};

// A child that closes its input early must not kill us.
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before_);
  }
  ~IgnoreBrokenPipe() { ::sigaction(SIGPIPE, &before_, nullptr); }

 private:
  struct sigaction before_ {};
};

// 0 or an errno. Its own process group: an interrupt at the terminal is for us, not for it.
int start(pid_t& child, const Pipe& in, const Pipe& out, const Pipe& err) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.end(0), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.end(1), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.end(1), STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t broken_pipe;
  sigemptyset(&broken_pipe);
  sigaddset(&broken_pipe, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &broken_pipe);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::array<char, 8> program{"gnuplot"};
  std::array<char, 3> no_settings{"-d"};
  std::array<char*, 3> arguments{program.data(), no_settings.data(), nullptr};
  const int error = ::posix_spawnp(&child, "gnuplot", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

// Appends what is there; closes the pipe at its end.
void drain(Pipe& pipe, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t n = ::read(pipe.end(0), buffer.data(), buffer.size());
  if (n > 0 && text.size() < kMaxOutput) text.append(buffer.data(), static_cast<std::size_t>(n));
  if (n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN)) pipe.close(0);
}

}  // namespace

Drawing draw(const std::string& script, double limit_s) {
  using Clock = std::chrono::steady_clock;
  const auto until = Clock::now() + std::chrono::duration<double>(limit_s);
  Drawing drawing;
  Pipe in, out, err;
  if (!in.ok() || !out.ok() || !err.ok()) {
    drawing.error = std::strerror(errno);
    return drawing;
  }
  const IgnoreBrokenPipe guard;
  pid_t child = 0;
  if (const int error = start(child, in, out, err)) {
    drawing.installed = error != ENOENT;
    drawing.error = std::strerror(error);
    return drawing;
  }
  in.close(0);
  out.close(1);
  err.close(1);
  ::fcntl(in.end(1), F_SETFL, O_NONBLOCK);
  std::size_t sent = 0;
  std::string complaints;
  bool timed_out = false;
  while (out.end(0) >= 0 || err.end(0) >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
    if (left <= 0) {
      timed_out = true;
      ::kill(child, SIGKILL);
      break;
    }
    std::array<pollfd, 3> ends{{{in.end(1), POLLOUT, 0}, {out.end(0), POLLIN, 0}, {err.end(0), POLLIN, 0}}};
    if (::poll(ends.data(), ends.size(), static_cast<int>(left)) < 0) continue;  // interrupted: look at the time again
    if (ends[0].revents != 0) {
      const ssize_t n = ::write(in.end(1), script.data() + sent, script.size() - sent);
      if (n > 0) sent += static_cast<std::size_t>(n);
      if (sent == script.size() || (n < 0 && errno != EAGAIN && errno != EINTR)) in.close(1);
    }
    if (ends[1].revents != 0) drain(out, drawing.svg);
    if (ends[2].revents != 0) drain(err, complaints);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const bool complete = drawing.svg.find("</svg>") != std::string::npos;
  if (timed_out || !WIFEXITED(status) || WEXITSTATUS(status) != 0 || !complete) {
    drawing.svg.clear();
    drawing.error = timed_out ? fmt::format("gnuplot did not finish within {} s", limit_s)
                              : "gnuplot failed: " + plain_line(complaints, 300);
  }
  return drawing;
}

std::string inline_svg(const std::string& svg, const std::string& prefix, const std::string& title) {
  std::string s = svg;
  const auto replace_all = [&s](std::string_view from, const std::string& to) {
    for (std::size_t at = s.find(from); at != std::string::npos; at = s.find(from, at + to.size()))
      s.replace(at, from.size(), to);
  };
  const std::size_t begin = s.find("<svg");
  const std::size_t head_end = s.find('>', begin);
  if (begin == std::string::npos || head_end == std::string::npos) return "";
  const std::size_t box = s.find("viewBox=\"", begin);
  const std::size_t box_end = box == std::string::npos ? box : s.find('"', box + 9);
  const std::string view = box_end == std::string::npos || box_end > head_end ? "" : s.substr(box, box_end + 1 - box);
  s = s.substr(head_end + 1);
  replace_all("xlink:href=", "href=");
  replace_all(" id=\"", " id=\"" + prefix);
  replace_all(" id='", " id='" + prefix);
  replace_all("href='#", "href='#" + prefix);
  replace_all("href=\"#", "href=\"#" + prefix);
  replace_all("url(#", "url(#" + prefix);
  // gnuplot's own title would show as a tooltip, its description names its version.
  for (const auto& [open, close] : {std::pair<std::string, std::string>{"<title>", "</title>"}, {"<desc>", "</desc>"}}) {
    for (std::size_t from = s.find(open); from != std::string::npos; from = s.find(open)) {
      const std::size_t to = s.find(close, from);
      if (to == std::string::npos) break;
      s.erase(from, to + close.size() - from);
    }
  }
  return fmt::format("<svg role=\"img\" aria-label=\"{}\" {}>{}", html_escape(title), view, s);
}

}  // namespace slipstream
