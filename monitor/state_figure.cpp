// The figure of one state: truth, measurements and estimates above, errors below, each with its claimed 3-sigma band.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "monitor/figure_context.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

// One estimator's curves of the state.
struct Entry {
  std::size_t index;  // among the estimators: decides the style
  const EstimatorScore* score;
  std::size_t state;
  std::vector<double> error, low, high, error_low, error_high;
  double typical_band;  // median of 3 sigma; NaN without

  const std::vector<Utime>& utime() const { return score->record->utime; }
  const std::vector<double>& mean() const { return score->record->mean[state]; }
};

std::vector<Entry> entries_of(const FigureContext& context, const std::string& name) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Entry> entries;
  for (std::size_t k = 0; k < context.board.estimators.size(); ++k) {
    const EstimatorScore& s = context.board.estimators[k];
    const EstimatorRecord& r = *s.record;
    for (std::size_t i = 0; i < s.states.size() && r.states > 0; ++i) {
      if (s.states[i].name != name) continue;
      Entry e{k, &s, i, {}, {}, {}, {}, {}, kNan};
      for (std::size_t row = 0; row < r.utime.size(); ++row) {
        const double x = r.mean[i][row], sigma3 = std::isfinite(x) ? 3.0 * r.sigma(row, i) : kNan;
        e.error.push_back(x - s.states[i].truth[row]);
        e.low.push_back(x - sigma3);
        e.high.push_back(x + sigma3);
        e.error_low.push_back(-sigma3);
        e.error_high.push_back(sigma3);
      }
      e.typical_band = percentile(finite(e.error_high), 0.5);
      entries.push_back(std::move(e));
      break;
    }
  }
  return entries;
}

}  // namespace

Figure state_figure(const FigureContext& context, const std::string& name) {
  PlotScript plot(context.end_s, context.marks_s);
  const std::vector<Entry> entries = entries_of(context, name);
  const auto reading = context.run.readings().find(name);
  const bool is_measured = reading != context.run.readings().end();
  const std::vector<double>* truth = context.run.truth_column(name);

  Panel& values = plot.panel(context.label(name), 300);
  std::vector<double> estimates, errors;
  for (const Entry& e : entries) {
    append_finite(estimates, e.mean());
    append_finite(errors, e.error, true);
  }
  std::optional<Band> range = robust_range(estimates, 0.01, 0.06);
  if (truth)
    if (const auto of_truth = robust_range(finite(*truth), 1e-9, 0.06)) range = hull(*of_truth, range);
  if (range && is_measured) range = hull(*range, robust_range(reading->second.value, 0.002, 0.0));
  values.y_range = range;

  // A band that fills the axes hides the rest and says no more than its width does.
  for (const Entry& e : entries)
    if (range && e.typical_band <= 0.5 * (range->high - range->low))
      plot.band(values, decimated(e.utime(), e.low, e.high), estimator_style(e.index).colour, "");
  std::size_t legend = entries.size();
  if (is_measured) {
    plot.line(values, decimated(reading->second.utime, reading->second.value), kMeasuredStyle, "measured");
    ++legend;
  }
  if (truth) {
    plot.line(values, decimated(context.run.truth().utime, *truth), kTruthStyle, "truth");
    ++legend;
  }
  for (const Entry& e : entries) plot.line(values, decimated(e.utime(), e.mean()), line_style(e.index), e.score->name);

  std::string caption = "Value, with the band of three standard deviations that each estimator claims.";
  if (!errors.empty()) {
    const std::string with_unit = context.label(name);
    Panel& panel = plot.panel("error" + with_unit.substr(with_unit.find(" (")), 220);
    // The errors decide the range; a band widens it as long as the errors stay readable.
    const double largest = std::max(percentile(errors, 0.995), 1e-12);
    double reach = 1.3 * largest;
    for (const Entry& e : entries)
      if (1.3 * e.typical_band <= 4.0 * largest) reach = std::max(reach, 1.3 * e.typical_band);
    panel.y_range = Band{-reach, reach};
    caption =
        "Above: value. Below: estimate minus truth. Shaded: the three standard deviations that each estimator "
        "claims, to either side. What lies outside the axes is cut off.";
    for (const Entry& e : entries) {
      if (e.typical_band <= reach)
        plot.band(panel, decimated(e.utime(), e.error_low, e.error_high), estimator_style(e.index).colour, "");
      else if (std::isfinite(e.typical_band))
        caption += fmt::format(" The band of {} is wider than the axes and not drawn: typically {} to either side.",
                               e.score->name, number_text(e.typical_band, 3));
    }
    plot.constant(panel, 0.0, "with lines lc rgb \"#000000\" lw 1", "");
    for (const Entry& e : entries) plot.line(panel, decimated(e.utime(), e.error), line_style(e.index, 1.6), "");
  }
  return {"state-" + name, readable_name(name), caption + context.marks_text(), plot.text(legend_rows(legend))};
}

}  // namespace slipstream
