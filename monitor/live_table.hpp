// What stands in the terminal: on a tty a table redrawn in place, else a line per event; at the end the scoreboard.
#pragma once

#include <map>
#include <string>

#include "monitor/health.hpp"
#include "monitor/results.hpp"

namespace slipstream {

class LiveTable {
 public:
  // The present state of a run as lines of at most `width` columns, without control sequences.
  std::string lines(const RunRecord& run, std::size_t width = 100);

  // The same text for a tty: moves up over what it wrote last and replaces it.
  std::string redraw(const RunRecord& run, std::size_t width = 100);

  // Forgets what it wrote, because something else was written below it.
  void let_scroll() { lines_written_ = 0; }
  void begin_run() {
    scores_.clear();
    health_.clear();
  }

 private:
  std::map<std::string, RunningScore> scores_;
  std::map<std::string, Health> health_;
  int lines_written_ = 0;
};

// The final scoreboard: accuracy, consistency, time a step, messages.
std::string scoreboard_text(const Results& results, std::size_t width = 100);

}  // namespace slipstream
