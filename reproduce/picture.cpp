#include "reproduce/picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/check.hpp"

namespace slipstream {
namespace {

std::vector<Utime> as_utime(const std::vector<double>& t_s) {
  std::vector<Utime> utime;
  for (const double t : t_s) utime.push_back(utime_of(t));
  return utime;
}

// A time series has x in order and is thinned to what can be seen; a path in the plane is not in order and is thinned evenly.
Curve thinned(const std::vector<double>& x, const std::vector<double>& y) {
  SLIPSTREAM_CHECK(x.size() == y.size());
  if (x.size() <= kMaxPlotPoints) return {x, y};
  if (std::is_sorted(x.begin(), x.end())) return decimated(as_utime(x), y);
  Curve curve;
  const std::size_t step = x.size() / kMaxPlotPoints + 1;
  for (std::size_t i = 0; i < x.size(); i += step) {
    curve.x.push_back(x[i]);
    curve.y.push_back(y[i]);
  }
  return curve;
}

}  // namespace

std::string line_of(std::size_t index, double width) { return line_style(index, width); }
std::string dots_of(std::size_t index) {
  const Style s = estimator_style(index);
  return fmt::format("with linespoints pt {} ps 0.7 lc rgb \"{}\" lw 1.6", s.marker, s.colour);
}

Sketch::Sketch(std::string item, std::string title, double end_s, std::vector<double> marks_s)
    : item_(std::move(item)), title_(std::move(title)), plot_(end_s, std::move(marks_s)) {}
Sketch::Sketch(std::string item, std::string title, std::string x_label, Band x_range)
    : item_(std::move(item)), title_(std::move(title)), plot_(std::move(x_label), x_range) {}

std::string Sketch::shown(const std::string& name) {
  if (name.empty() || !in_legend_.insert(name).second) return "";
  legend_letters_ += name.size();
  return name;
}

Sketch& Sketch::panel(const std::string& y_label, int height_px) {
  panel_ = &plot_.panel(y_label, height_px);
  if (!first_) first_ = panel_;
  return *this;
}
Sketch& Sketch::range(double low, double high) {
  panel_->y_range = Band{low, high};
  return *this;
}
Sketch& Sketch::log_y() {
  panel_->log_y = true;
  return *this;
}

Sketch& Sketch::line(const std::string& name, const std::vector<double>& x, const std::vector<double>& y,
                     const std::string& style) {
  const std::string title = shown(name);
  const bool elsewhere = !title.empty() && panel_ != first_;
  plot_.line(*panel_, thinned(x, y), style, elsewhere ? "" : title);
  if (elsewhere) plot_.line_entry(*first_, style, title);
  for (std::size_t i = 0; i < x.size(); ++i)
    fmt::format_to(std::back_inserter(csv_), "{},{},{:.9g},{:.9g},,\n", panel_->y_label, name, x[i], y[i]);
  return *this;
}

Sketch& Sketch::band(const std::string& name, const std::vector<double>& x, const std::vector<double>& low,
                     const std::vector<double>& high, const std::string& colour) {
  SLIPSTREAM_CHECK(x.size() == low.size() && x.size() == high.size());
  const bool is_short = x.size() <= kMaxPlotPoints;
  const std::string title = shown(name);
  const bool elsewhere = !title.empty() && panel_ != first_;
  plot_.band(*panel_, is_short ? BandCurve{x, low, high} : decimated(as_utime(x), low, high), colour, elsewhere ? "" : title);
  if (elsewhere) plot_.band_entry(*first_, colour, title);
  for (std::size_t i = 0; i < x.size(); ++i)
    fmt::format_to(std::back_inserter(csv_), "{},{},{:.9g},,{:.9g},{:.9g}\n", panel_->y_label, name, x[i], low[i], high[i]);
  return *this;
}

Sketch& Sketch::level(const std::string& name, double y, const std::string& style) {
  plot_.constant(*panel_, y, style, shown(name));
  return *this;
}

Picture Sketch::finish(const std::string& caption) const {
  // About 95 letters fit into a row of the legend, with 6 for each sample line.
  const int rows = static_cast<int>((legend_letters_ + 6 * in_legend_.size()) / 95) + 1;
  return {item_, title_, caption, plot_.text(std::max(rows, legend_rows(in_legend_.size()))), "", "", csv_};
}

Sketch map_sketch(const std::string& item, const std::string& title, Band x, Band y, const std::string& x_label,
                  const std::string& y_label) {
  // Widen whichever axis is too short for a panel between 260 and 700 px high in one scale.
  const double px_per_m = kPlotWidth_px / (x.high - x.low);
  double height = px_per_m * (y.high - y.low);
  if (height > 700.0) {
    const double wide = kPlotWidth_px * (y.high - y.low) / 700.0, middle = 0.5 * (x.low + x.high);
    x = {middle - 0.5 * wide, middle + 0.5 * wide};
    height = 700.0;
  } else if (height < 260.0) {
    const double tall = 260.0 / px_per_m, middle = 0.5 * (y.low + y.high);
    y = {middle - 0.5 * tall, middle + 0.5 * tall};
    height = 260.0;
  }
  Sketch sketch(item, title, x_label, x);
  sketch.panel(y_label, static_cast<int>(std::lround(height))).range(y.low, y.high);
  return sketch;
}

Band range_of(const std::vector<std::vector<double>>& series, double margin) {
  bool any = false;
  Band r{0.0, 1.0};
  for (const auto& s : series)
    for (const double v : s) {
      if (!std::isfinite(v)) continue;
      r.low = any ? std::min(r.low, v) : v;
      r.high = any ? std::max(r.high, v) : v;
      any = true;
    }
  const double pad = std::max(margin * (r.high - r.low), 1e-9);
  return {r.low - pad, r.high + pad};
}

}  // namespace slipstream
