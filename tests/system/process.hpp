// A program as a child process: its output in files, a limit for every wait, and never a survivor or a zombie.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace slipstream::test {

// Far beyond what any step of a test takes: whoever reaches it hangs.
inline constexpr double kLimit_s = 60.0;

inline std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class Process {
 public:
  // Runs the command in `directory`; stdout goes to `output`, stderr to `output`.err.
  Process(const std::vector<std::string>& command, std::string output, const std::string& directory)
      : output_(std::move(output)) {
    std::vector<char*> arguments;
    for (const std::string& a : command) arguments.push_back(const_cast<char*>(a.c_str()));
    arguments.push_back(nullptr);
    const std::string errors = output_ + ".err";
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ != 0) return;
    // The child, where only async-signal-safe calls are allowed. It ends with the test, however that ends.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int out = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    const int err = open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (getppid() != parent || chdir(directory.c_str()) != 0 || out < 0 || err < 0) _exit(126);
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    for (int fd = 3; fd < 256; ++fd) close(fd);  // the test's own bus stays the test's
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  ~Process() {
    if (is_running()) kill();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  bool is_running() {
    if (pid_ <= 0) return false;
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == 0) return true;
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    pid_ = -1;
    return false;
  }
  // The exit code, 128 + N if signal N ended it. Who does not end in time is killed: 128 + SIGKILL.
  int wait(double limit_s = kLimit_s) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    while (is_running()) {
      if (std::chrono::steady_clock::now() > end) kill();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return exit_code_;
  }
  void signal(int number) {
    if (pid_ > 0) ::kill(pid_, number);
  }
  void kill() {
    signal(SIGKILL);
    while (is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  std::string out() const { return text_of(output_); }
  std::string err() const { return text_of(output_ + ".err"); }
  bool said(const std::string& text) const { return out().find(text) != std::string::npos; }

 private:
  std::string output_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

}  // namespace slipstream::test
