#include "reproduce/runner.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "common/refusal.hpp"
#include "studies/play.hpp"
#include "reproduce/files.hpp"

namespace slipstream {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// A child and what it has said: lines "p DONE TOTAL" and "e TEXT".
struct Child {
  const Experiment* experiment = nullptr;
  pid_t pid = 0;
  int pipe = -1;
  Clock::time_point started;
  std::string unread, error;
  int done = 0, total = 0;

  void take(const std::string& line) {
    if (line.starts_with("p ")) std::sscanf(line.c_str(), "p %d %d", &done, &total);
    if (line.starts_with("e ")) error = line.substr(2);
  }
  // False at the end of what it says.
  bool read() {
    std::array<char, 4096> buffer;
    const ssize_t n = ::read(pipe, buffer.data(), buffer.size());
    if (n < 0) return errno == EINTR || errno == EAGAIN;
    if (n == 0) return false;
    unread.append(buffer.data(), static_cast<std::size_t>(n));
    for (std::size_t end = unread.find('\n'); end != std::string::npos; end = unread.find('\n')) {
      take(unread.substr(0, end));
      unread.erase(0, end + 1);
    }
    return true;
  }
};

void say(int pipe, const std::string& line) {
  const std::string text = line + "\n";
  if (::write(pipe, text.data(), text.size()) < 0) std::_Exit(2);  // nobody listens any more
}

// What fell back or gave nothing usable is not in the scores, so it is told.
void tell_steps(Outcome& o) {
  std::int64_t all = 0;
  std::string told;
  for (const auto& [who, t] : step_tally()) {
    all += t.steps;
    if (t.fallback + t.invalid > 0)
      told += fmt::format("{}{}: {} fell back and {} were invalid of {}", told.empty() ? " " : "; ", who, t.fallback, t.invalid,
                          t.steps);
  }
  if (all > 0)
    o.notes.push_back(
        fmt::format("Of {} steps of estimators{}", all, told.empty() ? " none fell back or was invalid." : ":" + told + "."));
}

// Every figure and table that an experiment promises.
void require_items(const Experiment& experiment, const Outcome& o) {
  for (const std::string& item : experiment.items) {
    const bool is_figure = item.starts_with("Fig."), is_table = item.starts_with("Table");
    const bool there =
        std::any_of(o.figures.begin(), o.figures.end(), [&](const Picture& p) { return p.item == item; }) ||
        (!is_figure && std::any_of(o.tables.begin(), o.tables.end(), [&](const TableItem& t) { return t.item == item; }));
    if ((is_figure || is_table) && !there) throw Refusal(fmt::format("{} is missing in what it has computed", item));
  }
}

[[noreturn]] void be_child(const Experiment& experiment, Bench bench, const std::string& out, const std::string& key,
                           int pipe) {
  std::signal(SIGINT, SIG_IGN);  // the parent hears it and ends us
  std::signal(SIGTERM, SIG_DFL);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const auto start = Clock::now();
  if (bench.seeds == 0) bench.seeds = experiment.seeds;
  bench.progress = [pipe](int done, int total) { say(pipe, fmt::format("p {} {}", done, total)); };
  try {
    Part part{experiment.document, experiment.name, key, 0.0, {}};
    experiment.run(bench, part.outcome);
    tell_steps(part.outcome);
    require_items(experiment, part.outcome);
    part.elapsed_s = since(start);
    write_part(out, std::move(part));
  } catch (const std::exception& e) {
    std::string text = e.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    say(pipe, "e " + text);
    std::_Exit(1);
  }
  std::_Exit(0);
}

Child start(const Experiment& experiment, const Bench& bench, const std::string& out, const std::string& key) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw Refusal(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  const pid_t pid = ::fork();
  if (pid < 0) throw Refusal(fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (pid == 0) {
    ::close(ends[0]);
    be_child(experiment, bench, out, key, ends[1]);
  }
  ::close(ends[1]);
  Child child;
  child.experiment = &experiment;
  child.pid = pid;
  child.pipe = ends[0];
  child.started = Clock::now();
  return child;
}

// The child's end: what went wrong, empty if nothing.
std::string reap(Child& child) {
  ::close(child.pipe);
  int status = 0;
  while (::waitpid(child.pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  if (!child.error.empty()) return child.error;
  return WIFSIGNALED(status) ? fmt::format("was ended by signal {}", WTERMSIG(status))
                             : fmt::format("ended with code {}", WEXITSTATUS(status));
}

}  // namespace

bool run_experiments(const std::vector<const Experiment*>& todo, const Bench& bench, const std::string& out,
                     const std::string& key, int jobs, const RunnerHooks& hooks) {
  std::vector<const Experiment*> waiting = todo;
  std::stable_sort(waiting.begin(), waiting.end(),
                   [](const Experiment* a, const Experiment* b) { return a->minutes < b->minutes; });  // taken from the back
  std::vector<Child> running;
  std::size_t finished = 0;
  const auto show = [&] {
    std::vector<RunnerHooks::Activity> activity;
    for (const Child& c : running) activity.push_back({c.experiment->name, c.done, c.total});
    hooks.progress(activity, finished, todo.size());
  };
  while (!waiting.empty() || !running.empty()) {
    while (!waiting.empty() && running.size() < static_cast<std::size_t>(jobs)) {
      running.push_back(start(*waiting.back(), bench, out, key));
      waiting.pop_back();
    }
    show();
    std::vector<pollfd> ends;
    for (const Child& c : running) ends.push_back({c.pipe, POLLIN, 0});
    ::poll(ends.data(), ends.size(), 1000);
    if (hooks.interrupted()) {
      for (Child& c : running) ::kill(c.pid, SIGKILL);
      for (Child& c : running) reap(c);
      return false;
    }
    for (std::size_t i = running.size(); i-- > 0;) {
      if (ends[i].revents == 0 || running[i].read()) continue;
      const std::string error = reap(running[i]);
      ++finished;
      hooks.finished(running[i].experiment->name, error, since(running[i].started));
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  show();
  return true;
}

}  // namespace slipstream
