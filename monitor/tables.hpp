// The scoreboard as tables of text: the report and the terminal show the same ones.
#pragma once

#include <string>
#include <vector>

#include "monitor/results.hpp"

namespace slipstream {

struct Table {
  struct Column {
    std::string title;
    bool is_number = true;  // right-aligned
  };
  std::string title;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};

// One row per state and estimator: R2, the published R2 where there is one, RMSE, largest error, and the efficiency where there
// is a bound.
Table accuracy_table(const Results& results);
// One row per estimator: NEES and NIS with their mean dimensions n and m and their 95 % bands.
Table consistency_table(const Results& results);
// One row per estimator and sensor: NIS with its dimension and 95 % band, and what was left out.
Table sensor_table(const Results& results);
// One row per estimator: time a step, with the published one, and deadline misses.
Table timing_table(const Results& results);
// One row per estimator: what became of its estimates and messages.
Table delivery_table(const Results& results);

// What is wrong with the sensors, one sentence each, with the names of the estimators that say so.
std::vector<std::string> warning_lines(const Scoreboard& board);

// Why there is no bound, as a sentence; empty if there is one.
std::string no_bound_text(const Scoreboard& board);

// For the terminal: fits into `width` columns by cutting the longest text columns.
std::string to_text(const Table& table, std::size_t width = 100);
std::string to_html(const Table& table);

}  // namespace slipstream
