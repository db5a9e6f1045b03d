// What an experiment leaves: values beside the published ones with a verdict, tables, figures, notes.
//
// Verdict on a value with a published counterpart. `ours` is the median over the runs, the spread their 5th to 95th percentile
// (nearest rank), and half a unit of the last printed digit is granted to the published value:
//   better                 the median is better and the published value lies outside the spread
//   equal within spread    the published value lies inside the spread, or the median agrees with it to the printed digit
//   equal to the printed digit                             the same of a single run, which has no spread
//   worse, because ...     the rest
//   not computed           some run gave no number
// A value that should be met rather than beaten is "met" to the printed digit or within a stated tolerance, else "different,
// because ...".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "monitor/statistics.hpp"
#include "monitor/tables.hpp"
#include "reproduce/picture.hpp"

namespace slipstream {

// A number as a document prints it: "0.9639" has the resolution 0.0001.
struct Printed {
  explicit Printed(const std::string& text);
  Printed(double v, double r) : value(v), resolution(r) {}
  double value;
  double resolution;
};

enum class Aim { kHigh, kLow };

struct Row {
  std::string item;      // "Table 7", "Fig. 43"
  std::string quantity;  // what, of which estimator and case
  std::string unit;      // "" for a pure number
  std::optional<double> published;
  double ours = 0.0;
  std::optional<Band> spread;
  int runs = 1;
  std::string verdict;
  std::string note;
};

// One value over its runs against a printed one; `because` explains a worse one.
Row judged(const std::string& item, const std::string& quantity, const std::string& unit, const Printed& published, Aim aim,
           const std::vector<double>& ours, const std::string& because, const std::string& note = "");
// To be met, with a tolerance that the note explains; 0: to the printed digit.
Row met(const std::string& item, const std::string& quantity, const std::string& unit, const Printed& published, double ours,
        double tolerance, const std::string& because, const std::string& note = "");
// A value of ours that the document does not have.
Row reported(const std::string& item, const std::string& quantity, const std::string& unit, const std::vector<double>& ours,
             const std::string& note = "");

struct TableItem {
  std::string item;  // "Table 7"
  std::string caption;
  Table table;
};

struct Outcome {
  std::vector<Row> rows;
  std::vector<TableItem> tables;
  std::vector<Picture> figures;
  std::vector<std::string> notes;
};

// Parameters that the document prints, as this bench has them: a table, and a row each that they are the same.
struct Parameter {
  std::string name, printed;
  double ours;
  std::string unit;
};
void add_parameters(Outcome& o, const std::string& item, const std::string& title, const std::string& caption,
                    const std::vector<Parameter>& parameters);

double median(std::vector<double> values);  // NaN for none, and where one of them is NaN

}  // namespace slipstream
