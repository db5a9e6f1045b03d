// A gnuplot script for one figure of stacked panels that share their horizontal axis, time unless said otherwise. Numbers go in
// as inline data blocks; the only text that reaches gnuplot is quoted, without its special characters, and never interpreted
// (noenhanced).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/types.hpp"
#include "monitor/statistics.hpp"

namespace slipstream {

inline constexpr std::size_t kMaxPlotPoints = 2000;  // per curve
inline constexpr int kPlotWidth_px = 877;            // of the axes; a panel's height relative to it sets the scale of a map

// y over x; a NaN in y interrupts the line.
struct Curve {
  std::vector<double> x, y;
};

// At most kMaxPlotPoints points: of each of equally many samples the smallest and the largest, so that no peak is lost.
Curve decimated(std::span<const Utime> utime, std::span<const double> value);

// low and high over x: of equally many samples the lowest low and the highest high.
struct BandCurve {
  std::vector<double> x, low, high;
};
BandCurve decimated(std::span<const Utime> utime, std::span<const double> low, std::span<const double> high);

// Okabe and Ito's colour-blind-safe palette without yellow, one colour, dash and marker per estimator.
struct Style {
  std::string colour, dash, marker;
};
Style estimator_style(std::size_t index);

struct Panel {
  std::string y_label;
  int height_px = 240;
  bool log_y = false;
  bool whole_numbers = false;  // ticks at every integer
  std::optional<Band> y_range;
  std::vector<std::string> curves;  // plot clauses
};

class PlotScript {
 public:
  // x from 0 to end_s; vertical lines at `marks_s`.
  PlotScript(double end_s, std::vector<double> marks_s) : end_s_(end_s), marks_s_(std::move(marks_s)) {}

  // Another horizontal axis than time.
  PlotScript(std::string x_label, Band x_range) : begin_s_(x_range.low), end_s_(x_range.high), x_label_(std::move(x_label)) {}

  Panel& panel(const std::string& y_label, int height_px);
  // Each adds a curve to a panel; an empty title keeps it out of the legend.
  void line(Panel& panel, const Curve& curve, const std::string& style, const std::string& title);
  void band(Panel& panel, const BandCurve& band, const std::string& colour, const std::string& title);
  void constant_band(Panel& panel, Band band, const std::string& title);
  // An entry of the legend, which the first panel carries, for a curve of another one.
  void line_entry(Panel& panel, const std::string& style, const std::string& title);
  void band_entry(Panel& panel, const std::string& colour, const std::string& title);
  void constant(Panel& panel, double y, const std::string& style, const std::string& title);

  // The whole script, for gnuplot's standard input. `legend_rows` is the room left above the panels.
  std::string text(int legend_rows) const;
  bool empty() const { return panels_.empty(); }
  std::size_t panels() const { return panels_.size(); }

 private:
  std::string block(std::span<const double> x, std::span<const double> y, std::span<const double> y2);

  double begin_s_ = 0.0;
  double end_s_;
  std::vector<double> marks_s_;
  std::string x_label_ = "time (s)";
  std::string data_;
  int blocks_ = 0;
  std::vector<std::unique_ptr<Panel>> panels_;
};

}  // namespace slipstream
