// What the makers of figures share: the run, its time axis, labels, styles and axis ranges.
#pragma once

#include <algorithm>
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
  std::string label(const std::string& name) const;                                      // with its unit; of an angle: degrees
  std::vector<double> shown(const std::string& name, std::vector<double> values) const;  // in that unit
  std::string marks_text() const;                                                        // what the vertical lines are

  std::string unit_of(const std::string& name) const;  // empty: not known

  const RunRecord& run;
  const Scoreboard& board;
  double end_s;
  std::vector<double> marks_s;  // gear changes
  std::map<std::string, std::string> units;
};

// Of one panel among so many in a figure, if three of them may be as high as `most`.
inline int panel_height(int most, std::size_t panels) {
  return panels <= 3 ? most : std::max(150, most * 3 / static_cast<int>(panels));
}

// Rows of the legend for so many entries.
int legend_rows(std::size_t entries);

std::vector<double> finite(const std::vector<double>& values);
void append_finite(std::vector<double>& to, const std::vector<double>& from, bool absolute = false);

// From the p to the 1 - p percentile, widened by a margin: a start transient or a stray point does not flatten the rest.
std::optional<Band> robust_range(const std::vector<double>& values, double p, double margin);
Band hull(const Band& a, const std::optional<Band>& b);

// One state: value above, error below. In state_figure.cpp.
Figure state_figure(const FigureContext& context, const std::string& name);

// States that belong together, below each other: one figure of their values and, where there is truth, one of their errors.
std::vector<Figure> group_figures(const FigureContext& context, const std::string& title,
                                  const std::vector<std::string>& names);

// The way seen from above, where estimators have the states east_m and north_m. In top_view.cpp; nothing if none has.
std::optional<Figure> top_view(const FigureContext& context);

}  // namespace slipstream
