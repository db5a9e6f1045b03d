// What the makers of figures share: the run, its time axis, labels, styles and axis ranges.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "monitor/figures.hpp"
#include "monitor/plot_script.hpp"

namespace slipstream {

inline constexpr const char* kTruthStyle = "with lines lc rgb \"#000000\" lw 2.6 dt 1";
inline constexpr const char* kMeasuredStyle = "with points pt 7 ps 0.22 lc rgb \"#9a9a9a\"";
std::string line_style(std::size_t estimator, double width = 2.0);
std::string point_style(std::size_t estimator);

struct FigureContext {
  explicit FigureContext(const Results& results);
  std::string label(const std::string& name) const;  // with its unit
  std::string marks_text() const;                    // what the vertical lines are

  const RunRecord& run;
  const Scoreboard& board;
  double end_s;
  std::vector<double> marks_s;  // gear changes
  std::map<std::string, std::string> units;
};

// Rows of the legend for so many entries.
int legend_rows(std::size_t entries);

std::vector<double> finite(const std::vector<double>& values);
void append_finite(std::vector<double>& to, const std::vector<double>& from, bool absolute = false);

// From the p to the 1 - p percentile, widened by a margin: a start transient or a stray point does not flatten the rest.
std::optional<Band> robust_range(const std::vector<double>& values, double p, double margin);
Band hull(const Band& a, const std::optional<Band>& b);

// One state: value above, error below. In state_figure.cpp.
Figure state_figure(const FigureContext& context, const std::string& name);

}  // namespace slipstream
