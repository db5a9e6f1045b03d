#include "monitor/plot_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

namespace slipstream {
namespace {

constexpr int kWidth = 1000;  // px; the fonts below are for this width
constexpr int kFont = 16;
constexpr int kLegendRow = 24;
constexpr int kBottom = 64;
constexpr int kGap = 22;

// Quoted for gnuplot: no quote, backslash, backtick or control character survives.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const bool special = c == '"' || c == '\\' || c == '`' || c == '\'' || (c >= 0 && c < ' ');
    result += special ? '_' : c;
  }
  return result + '"';
}

std::string titled(const std::string& title) { return title.empty() ? "notitle" : "title " + quoted(title) + " noenhanced"; }

std::string filled(const std::string& colour) {
  return fmt::format("with filledcurves fc rgb \"{}\" fs transparent solid 0.18 noborder", colour);
}

// Calls visit(begin, end) for at most `buckets` runs of equally many of n samples.
template <typename Visit>
void for_buckets(std::size_t n, std::size_t buckets, const Visit& visit) {
  const std::size_t count = std::min(n, buckets);
  for (std::size_t b = 0; b < count; ++b) visit(b * n / count, (b + 1) * n / count);
}

}  // namespace

Curve decimated(std::span<const Utime> utime, std::span<const double> value) {
  Curve curve;
  const auto add = [&](std::size_t i) {
    curve.x.push_back(seconds(utime[i]));
    curve.y.push_back(value[i]);
  };
  const std::size_t buckets = utime.size() <= kMaxPlotPoints ? utime.size() : kMaxPlotPoints / 2;
  for_buckets(utime.size(), buckets, [&](std::size_t begin, std::size_t end) {
    std::size_t low = begin, high = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (std::isnan(value[low]) || value[i] < value[low]) low = i;
      if (std::isnan(value[high]) || value[i] > value[high]) high = i;
    }
    add(std::min(low, high));
    if (low != high) add(std::max(low, high));
  });
  return curve;
}

BandCurve decimated(std::span<const Utime> utime, std::span<const double> low, std::span<const double> high) {
  BandCurve band;
  for_buckets(utime.size(), kMaxPlotPoints / 2, [&](std::size_t begin, std::size_t end) {
    double lowest = low[begin], highest = high[begin];
    for (std::size_t i = begin; i < end; ++i) {
      if (!(low[i] >= lowest)) lowest = std::isnan(low[i]) ? lowest : low[i];
      if (!(high[i] <= highest)) highest = std::isnan(high[i]) ? highest : high[i];
    }
    band.x.push_back(seconds(utime[begin]));
    band.low.push_back(lowest);
    band.high.push_back(highest);
  });
  return band;
}

Style estimator_style(std::size_t index) {
  static const std::array<Style, 6> kStyles{{{"#0072B2", "1", "7"},
                                             {"#D55E00", "(14,6)", "9"},
                                             {"#009E73", "(4,4)", "5"},
                                             {"#CC79A7", "(14,5,3,5)", "13"},
                                             {"#56B4E9", "(8,3,3,3,3,3)", "11"},
                                             {"#E69F00", "(20,8)", "3"}}};
  return kStyles[index % kStyles.size()];
}

Panel& PlotScript::panel(const std::string& y_label, int height_px) {
  panels_.push_back(std::make_unique<Panel>());
  panels_.back()->y_label = y_label;
  panels_.back()->height_px = height_px;
  return *panels_.back();
}

std::string PlotScript::block(std::span<const double> x, std::span<const double> y, std::span<const double> y2) {
  const std::string name = fmt::format("$d{}", blocks_++);
  data_ += name + " << EOD\n";
  bool any = false, gap = false;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(y[i]) || (!y2.empty() && !std::isfinite(y2[i]))) {
      gap = any;
      continue;
    }
    if (gap) data_ += '\n';  // an empty line interrupts a curve
    gap = false;
    any = true;
    fmt::format_to(std::back_inserter(data_), "{:.7g} {:.6g}", x[i], y[i]);
    if (!y2.empty()) fmt::format_to(std::back_inserter(data_), " {:.6g}", y2[i]);
    data_ += '\n';
  }
  if (!any) data_ += y2.empty() ? "NaN NaN\n" : "NaN NaN NaN\n";
  data_ += "EOD\n";
  return name;
}

void PlotScript::line(Panel& panel, const Curve& curve, const std::string& style, const std::string& title) {
  // A legend needs larger points than a cloud of them.
  const std::size_t size = style.find(" ps ");
  const bool enlarged = size != std::string::npos && !title.empty();
  panel.curves.push_back(
      fmt::format("{} using 1:2 {} {}", block(curve.x, curve.y, {}), style, enlarged ? "notitle" : titled(title)));
  if (enlarged) line_entry(panel, style, title);
}

void PlotScript::line_entry(Panel& panel, const std::string& style, const std::string& title) {
  const std::size_t size = style.find(" ps ");
  const std::size_t rest = size == std::string::npos ? size : style.find(' ', size + 4);
  panel.curves.push_back(fmt::format("keyentry {}{}{} {}", style.substr(0, size), size == std::string::npos ? "" : " ps 0.9",
                                     rest == std::string::npos ? "" : style.substr(rest), titled(title)));
}

void PlotScript::band(Panel& panel, const BandCurve& band, const std::string& colour, const std::string& title) {
  panel.curves.push_back(
      fmt::format("{} using 1:2:3 {} {}", block(band.x, band.low, band.high), filled(colour), titled(title)));
}

void PlotScript::band_entry(Panel& panel, const std::string& colour, const std::string& title) {
  panel.curves.push_back(fmt::format("keyentry {} {}", filled(colour), titled(title)));
}

void PlotScript::constant_band(Panel& panel, Band limits, const std::string& title) {
  band(panel, {{begin_s_, end_s_}, {limits.low, limits.low}, {limits.high, limits.high}}, "#000000", title);
}

void PlotScript::constant(Panel& panel, double y, const std::string& style, const std::string& title) {
  line(panel, {{begin_s_, end_s_}, {y, y}}, style, title);
}

std::string PlotScript::text(int legend_rows) const {
  const int top = legend_rows * kLegendRow + 14;
  int height = top + kBottom - kGap;
  for (const auto& panel : panels_) height += panel->height_px + kGap;
  std::string s = data_;
  s += fmt::format("set terminal svg size {},{} dynamic noenhanced font \"sans-serif,{}\" background \"#ffffff\"\n", kWidth,
                   height, kFont);
  s += "set encoding utf8\nset datafile missing \"NaN\"\nset grid xtics ytics lc rgb \"#d8d8d8\" lw 1 dt 1\n";
  s += "set border 3 lc rgb \"#444444\"\nset tics nomirror out scale 0.6\nset xtics textcolor rgb \"#222222\"\n";
  s += fmt::format("set xrange [{:.9g}:{:.9g}]\nset lmargin at screen 0.108\nset rmargin at screen 0.985\n", begin_s_,
                   std::max(end_s_, begin_s_ + 1e-6));
  for (const double mark : marks_s_)
    s += fmt::format(
        "set arrow from first {0:.9g}, graph 0 to first {0:.9g}, graph 1 nohead back lc rgb \"#999999\" dt (3,4)\n", mark);
  s += fmt::format(
      "set key at screen 0.5465, screen {:.5f} center top horizontal Left reverse samplen 2.5 spacing 1.1 noenhanced\n",
      1.0 - 4.0 / height);
  // A label instead of an xlabel: gnuplot leaves that one out when ticks point outwards from a fixed margin.
  s += fmt::format("set label 1 {} at screen 0.5465, screen {:.5f} center\n", quoted(x_label_), 14.0 / height);
  s += "set multiplot\n";
  int y = height - top;
  for (std::size_t i = 0; i < panels_.size(); ++i) {
    const Panel& p = *panels_[i];
    s += fmt::format("set tmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n", static_cast<double>(y) / height,
                     static_cast<double>(y - p.height_px) / height);
    y -= p.height_px + kGap;
    s += fmt::format("set ylabel {} noenhanced offset 0.4,0\n", quoted(p.y_label));
    s += p.log_y ? "set logscale y\nset format y \"%g\"\nset ytics 10\n"
                 : "unset logscale y\nset format y \"%g\"\nset ytics autofreq\n";
    if (p.whole_numbers) s += "set ytics 1\n";
    s += p.y_range ? fmt::format("set yrange [{:.9g}:{:.9g}]\n", p.y_range->low, p.y_range->high) : "set autoscale y\n";
    s += i + 1 == panels_.size() ? "set format x \"%g\"\n" : "set format x \"\"\n";
    if (i > 0) s += "unset key\nunset label 1\n";
    s += fmt::format("plot {}\n", fmt::join(p.curves, ", \\\n  "));
  }
  return s + "unset multiplot\n";
}

}  // namespace slipstream
