// A figure under construction: series into panels, once for gnuplot and once as numbers for a CSV file.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "monitor/figure_context.hpp"

namespace slipstream {

// A finished figure, as plain text.
struct Picture {
  std::string item;     // "Fig. 16"
  std::string title;    // what it shows
  std::string caption;  // what to see in it
  std::string script;   // for gnuplot; empty once drawn
  std::string svg;      // the drawn file's name in the figures folder; empty: not drawn, `error` says why
  std::string error;
  std::string csv;  // panel,series,x,y[,low,high]
};

// Series styles beside kTruthStyle and kMeasuredStyle; those of estimators come in the order of estimator_style.
std::string line_of(std::size_t index, double width = 2.0);
std::string dots_of(std::size_t index);  // large markers, for sweeps

class Sketch {
 public:
  // Time from 0 to end_s, with vertical marks.
  Sketch(std::string item, std::string title, double end_s, std::vector<double> marks_s = {});
  Sketch(std::string item, std::string title, std::string x_label, Band x_range);

  Sketch& panel(const std::string& y_label, int height_px = 300);
  Sketch& range(double low, double high);
  Sketch& log_y();
  // Each adds to the newest panel. The legend shows a name once, the CSV file at every series.
  Sketch& line(const std::string& name, const std::vector<double>& x, const std::vector<double>& y, const std::string& style);
  Sketch& band(const std::string& name, const std::vector<double>& x, const std::vector<double>& low,
               const std::vector<double>& high, const std::string& colour);
  Sketch& level(const std::string& name, double y, const std::string& style);

  Picture finish(const std::string& caption) const;

 private:
  std::string item_, title_;
  PlotScript plot_;
  Panel* panel_ = nullptr;
  Panel* first_ = nullptr;                     // has the legend of all
  std::string shown(const std::string& name);  // for the legend: empty the second time
  std::set<std::string> in_legend_;
  std::size_t legend_letters_ = 0;
  std::string csv_ = "panel,series,x,y,low,high\n";
};

// A map of paths in one scale for both axes: x to the right, y upwards, metres.
Sketch map_sketch(const std::string& item, const std::string& title, Band x, Band y, const std::string& x_label,
                  const std::string& y_label);

// min and max over several series, widened by a margin of their distance.
Band range_of(const std::vector<std::vector<double>>& series, double margin = 0.05);

}  // namespace slipstream
