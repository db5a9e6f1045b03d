#include "reproduce/runner.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>

#include "common/refusal.hpp"
#include "reproduce/files.hpp"
#include "studies/child_process.hpp"
#include "studies/play.hpp"

namespace slipstream {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// A child and what it has said: lines "p DONE TOTAL" and "e TEXT".
struct Child {
  const Experiment* experiment = nullptr;
  std::unique_ptr<ChildProcess> process;
  Clock::time_point started;
  std::string error;
  int done = 0, total = 0;

  void take(const std::string& line) {
    if (line.starts_with("p ")) std::sscanf(line.c_str(), "p %d %d", &done, &total);
    if (line.starts_with("e ")) error = line.substr(2);
  }
  // False at the end of what it says.
  bool read() {
    return process->read([this](const std::string& line) { take(line); });
  }
  // What went wrong, empty if nothing.
  std::string end() {
    const std::string end = process->end();
    return end.empty() || error.empty() ? end : error;
  }
};

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

int be_child(const Experiment& experiment, Bench bench, const std::string& out, const std::string& key, int words) {
  const auto start = Clock::now();
  if (bench.seeds == 0) bench.seeds = experiment.seeds;
  bench.progress = [words](int done, int total) { say_line(words, fmt::format("p {} {}", done, total)); };
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
    say_line(words, "e " + text);
    return 1;
  }
  return 0;
}

Child start(const Experiment& experiment, const Bench& bench, const std::string& out, const std::string& key) {
  Child child;
  child.experiment = &experiment;
  child.started = Clock::now();
  child.process = std::make_unique<ChildProcess>([&](int, int words) { return be_child(experiment, bench, out, key, words); });
  return child;
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
    for (const Child& c : running) ends.push_back({c.process->words(), POLLIN, 0});
    ::poll(ends.data(), ends.size(), 1000);
    if (hooks.interrupted()) {
      for (Child& c : running) c.process->kill();
      return false;
    }
    for (std::size_t i = running.size(); i-- > 0;) {
      if (ends[i].revents == 0 || running[i].read()) continue;
      const std::string error = running[i].end();
      ++finished;
      hooks.finished(running[i].experiment->name, error, since(running[i].started));
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  show();
  return true;
}

}  // namespace slipstream
