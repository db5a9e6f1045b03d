// A forked child that speaks to its parent in lines. Work goes into processes because Ipopt is not safe to use from several
// threads, and because one that crashes takes nothing else down. No child outlives its parent, however that ends.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <string_view>

namespace slipstream {

class ChildProcess {
 public:
  // In the child: reads orders from one descriptor, says lines into the other; its value is the exit code. SIGINT is the
  // parent's to hear: it ends the child.
  using Body = std::function<int(int orders, int words)>;
  explicit ChildProcess(const Body& body);  // refuses if there is no process to be had
  ~ChildProcess();                          // kills it if it still runs
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  int words() const { return words_; }  // to poll
  // What it has said by now, line by line. False at the end of what it says.
  bool read(const std::function<void(const std::string& line)>& take);
  void order(std::string_view bytes);  // a child that is gone does not hear them
  void kill();
  // Waits for its end: empty if it went well, else "was ended by signal 9" or "ended with code 1".
  std::string end();

 private:
  pid_t pid_ = 0;
  int orders_ = -1, words_ = -1;
  std::string unread_;
};

// In a child: a line, or several with their ends, to the parent. End the child if nobody listens.
void say_line(int words, const std::string& line);
void say(int words, const std::string& lines);

}  // namespace slipstream
