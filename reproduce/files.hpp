// The files that the experiments leave in the output folder:
//
//   results.json          list of {document, item, quantity, unit, published, ours, spread, runs, verdict, note}
//   report.html           everything on one page, self-contained
//   figures/fig_16.svg    and fig_16.csv, its numbers: panel,series,x,y,low,high; of document 001: 001_fig_16
//   tables/table_7.csv
//   parts/NAME.json       an experiment's outcome: what an interrupted call has finished, a second one does not repeat
//
// The .cpp is one of the two files that name the JSON library.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reproduce/experiment.hpp"

namespace slipstream {

struct Part {
  std::string document, experiment;
  std::string key;  // of the program and its inputs: a part with another key is out of date
  double elapsed_s = 0.0;
  Outcome outcome;
};

// Refuses a folder that cannot be made or written to.
void prepare_output(const std::string& out);

// Draws the figures, writes all files of the part, its own .json last.
void write_part(const std::string& out, Part part);

// Empty if there is none with this key that can be read.
std::optional<Part> read_part(const std::string& out, const std::string& experiment, const std::string& key);

void write_results(const std::string& out, const std::vector<Part>& parts);
void write_report(const std::string& out, const std::vector<Part>& parts, const std::vector<std::string>& warnings);

// "Fig. 16" -> "fig_16".
std::string file_stem(const std::string& item);
// The same of an item of a document: "fig_16" of document 002, whose items came first, "001_fig_16" of any other.
std::string item_stem(const std::string& document, const std::string& item);

}  // namespace slipstream
