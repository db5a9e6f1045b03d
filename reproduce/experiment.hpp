// What an experiment is: a name, the items of a document that it regenerates, and a function that computes them.
//
// Two documents may both have a "Fig. 5": an item is its document's, and its file is named so (item_stem).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "models/recorded.hpp"
#include "models/scenario.hpp"
#include "reproduce/outcome.hpp"

namespace slipstream {

struct Bench {
  int seeds = 0;         // of every Monte Carlo spread: 1 ... seeds; 0: each experiment's own
  std::string data_dir;  // recorded drives; empty: there are none
  // A scenario of scenarios/, with assignments KEY=VALUE over it.
  std::function<Scenario(const std::string& name, const std::vector<std::string>& overrides)> scenario;
  // The streams of a recorded scenario, from a folder below data_dir.
  std::function<RecordedStreams(const Scenario& scenario, const std::string& folder)> streams;
  // Columns of a CSV file below data_dir.
  std::function<std::vector<std::vector<double>>(const std::string& file, const std::vector<std::string>& columns)> columns;
  // `done` of `total` parts of this experiment are finished.
  std::function<void(int done, int total)> progress;
};

struct Experiment {
  std::string document;  // "001"
  std::string name;
  std::string chapter;  // heading in the report
  std::string title;
  std::vector<std::string> items;  // "Fig. 5", "Table 4"
  double minutes;                  // rough, on one core: the longest starts first
  void (*run)(const Bench&, Outcome&);
  bool needs_data = false;  // nothing of it without recorded drives
  int seeds = 20;           // where the call does not say
};

// In the order of the documents.
const std::vector<Experiment>& experiments();

}  // namespace slipstream
