#include "studies/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "common/refusal.hpp"

namespace slipstream {
namespace {

std::array<int, 2> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw Refusal(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  return ends;
}

}  // namespace

ChildProcess::ChildProcess(const Body& body) {
  const std::array<int, 2> orders = make_pipe(), words = make_pipe();
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw Refusal(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (pid_ == 0) {
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_DFL);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) std::_Exit(2);  // it ended before we asked
    ::close(orders[1]);
    ::close(words[0]);
    std::_Exit(body(orders[0], words[1]));
  }
  ::close(orders[0]);
  ::close(words[1]);
  orders_ = orders[1];
  words_ = words[0];
}

ChildProcess::~ChildProcess() {
  if (pid_ == 0) return;
  kill();
  end();
}

bool ChildProcess::read(const std::function<void(const std::string& line)>& take) {
  std::array<char, 65536> buffer;
  const ssize_t n = ::read(words_, buffer.data(), buffer.size());
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  if (n == 0) return false;
  unread_.append(buffer.data(), static_cast<std::size_t>(n));
  std::size_t begin = 0;
  for (std::size_t end = unread_.find('\n'); end != std::string::npos; end = unread_.find('\n', begin)) {
    take(unread_.substr(begin, end - begin));
    begin = end + 1;
  }
  unread_.erase(0, begin);
  return true;
}

void ChildProcess::order(std::string_view bytes) {
  struct sigaction ignore = {}, before = {};
  ignore.sa_handler = SIG_IGN;
  ::sigaction(SIGPIPE, &ignore, &before);
  while (::write(orders_, bytes.data(), bytes.size()) < 0 && errno == EINTR) {
  }
  ::sigaction(SIGPIPE, &before, nullptr);
}

void ChildProcess::kill() { ::kill(pid_, SIGKILL); }

std::string ChildProcess::end() {
  ::close(orders_);
  ::close(words_);
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  return WIFSIGNALED(status) ? fmt::format("was ended by signal {}", WTERMSIG(status))
                             : fmt::format("ended with code {}", WEXITSTATUS(status));
}

void say_line(int words, const std::string& line) { say(words, line + "\n"); }

void say(int words, const std::string& text) {
  for (std::size_t said = 0; said < text.size();) {
    const ssize_t n = ::write(words, text.data() + said, text.size() - said);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) std::_Exit(2);  // nobody listens any more
    said += static_cast<std::size_t>(n);
  }
}

}  // namespace slipstream
