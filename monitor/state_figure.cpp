// The figures of states: truth, measurements and estimates, and errors, each with its claimed 3-sigma band and, where there is
// one, the bound. One state with its errors below, or several that belong together. Angles are on the turn of their truth, so
// that no curve jumps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "monitor/figure_context.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

// One estimator's curves of the state, in the shown unit.
struct Entry {
  std::size_t index;  // among the estimators: decides the style
  const EstimatorScore* score;
  std::vector<double> mean, error, low, high, error_low, error_high;
  double typical_band;  // median of 3 sigma; NaN without

  const std::vector<Utime>& utime() const { return score->record->utime; }
};

std::vector<Entry> entries_of(const FigureContext& context, const std::string& name) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Entry> entries;
  for (std::size_t k = 0; k < context.board.estimators.size(); ++k) {
    const EstimatorScore& s = context.board.estimators[k];
    const EstimatorRecord& r = *s.record;
    for (std::size_t i = 0; i < s.states.size() && r.states > 0; ++i) {
      if (s.states[i].name != name) continue;
      Entry e{k, &s, context.shown(name, s.states[i].estimate), {}, {}, {}, {}, {}, kNan};
      const std::vector<double> truth = context.shown(name, s.states[i].truth);
      std::vector<double> sigma3(r.utime.size(), kNan);
      for (std::size_t row = 0; row < r.utime.size(); ++row)
        if (std::isfinite(e.mean[row])) sigma3[row] = 3.0 * r.sigma(row, i);
      sigma3 = context.shown(name, std::move(sigma3));
      for (std::size_t row = 0; row < r.utime.size(); ++row) {
        e.error.push_back(e.mean[row] - truth[row]);
        e.low.push_back(e.mean[row] - sigma3[row]);
        e.high.push_back(e.mean[row] + sigma3[row]);
        e.error_low.push_back(-sigma3[row]);
        e.error_high.push_back(sigma3[row]);
      }
      e.typical_band = percentile(finite(e.error_high), 0.5);
      entries.push_back(std::move(e));
      break;
    }
  }
  return entries;
}

// The square root of the bound on a state, in the shown unit; empty if there is none.
struct BoundCurve {
  std::vector<Utime> utime;
  std::vector<double> sigma;
};
BoundCurve bound_of(const FigureContext& context, const std::string& name) {
  const auto* series = std::get_if<BoundSeries>(&context.board.bound);
  const std::vector<double>* variance = series ? series->of(name) : nullptr;
  if (!variance) return {};
  std::vector<double> sigma = *variance;
  for (double& s : sigma) s = std::sqrt(std::max(s, 0.0));  // rounding, where it is zero
  return {series->utime, context.shown(name, std::move(sigma))};
}

constexpr const char* kBoundStyle = "with lines lc rgb \"#000000\" lw 1.8 dt (6,5)";
constexpr const char* kBoundTitle = "bound (1 sigma)";

// Counts the entries of the legend, which it has.
Panel& value_panel(const FigureContext& context, const std::string& name, const std::vector<Entry>& entries, int height_px,
                   PlotScript& plot, std::size_t& legend) {
  const auto reading = context.run.readings().find(name);
  const bool is_measured = reading != context.run.readings().end();
  const std::vector<double>* column = context.run.truth_column(name);
  const std::vector<double> truth = column ? context.shown(name, *column) : std::vector<double>();
  const std::vector<double> measured = is_measured ? context.shown(name, reading->second.value) : std::vector<double>();

  Panel& values = plot.panel(context.label(name), height_px);
  std::vector<double> estimates;
  for (const Entry& e : entries) append_finite(estimates, e.mean);
  std::optional<Band> range = robust_range(estimates, 0.01, 0.06);
  if (column)
    if (const auto of_truth = robust_range(finite(truth), 1e-9, 0.06)) range = hull(*of_truth, range);
  if (range && is_measured) range = hull(*range, robust_range(measured, 0.002, 0.0));
  values.y_range = range;

  // A band that fills the axes hides the rest and says no more than its width does.
  for (const Entry& e : entries)
    if (range && e.typical_band <= 0.5 * (range->high - range->low))
      plot.band(values, decimated(e.utime(), e.low, e.high), estimator_style(e.index).colour, "");
  if (is_measured) plot.line(values, decimated(reading->second.utime, measured), kMeasuredStyle, "measured");
  if (column) plot.line(values, decimated(context.run.truth().utime, truth), kTruthStyle, "truth");
  for (const Entry& e : entries) plot.line(values, decimated(e.utime(), e.mean), line_style(e.index), e.score->name);
  legend = std::max(legend, entries.size() + (is_measured ? 1 : 0) + (column ? 1 : 0));
  return values;
}

// Nothing if the truth is not known. Returns what the caption must say of it.
std::string error_panel(const FigureContext& context, const std::string& name, const std::string& label,
                        const std::vector<Entry>& entries, const BoundCurve& bound, int height_px, bool has_legend,
                        PlotScript& plot) {
  std::vector<double> errors;
  for (const Entry& e : entries) append_finite(errors, e.error, true);
  if (errors.empty()) return "";
  Panel& panel = plot.panel(label, height_px);
  // The errors decide the range, and the bound; a band widens it as long as the errors stay readable.
  const double largest = std::max(percentile(errors, 0.995), 1e-12);
  double reach = 1.3 * largest;
  for (const Entry& e : entries)
    if (1.3 * e.typical_band <= 4.0 * largest) reach = std::max(reach, 1.3 * e.typical_band);
  if (!bound.sigma.empty()) reach = std::max(reach, 1.3 * percentile(bound.sigma, 0.5));
  panel.y_range = Band{-reach, reach};
  std::string remark;
  for (const Entry& e : entries) {
    if (e.typical_band <= reach)
      plot.band(panel, decimated(e.utime(), e.error_low, e.error_high), estimator_style(e.index).colour, "");
    else if (std::isfinite(e.typical_band))
      remark += fmt::format(" The band of {} for {} is wider than the axes and not drawn: typically {} to either side.",
                            e.score->name, context.label(name), number_text(e.typical_band, 3));
  }
  plot.constant(panel, 0.0, "with lines lc rgb \"#000000\" lw 1", "");
  for (const Entry& e : entries)
    plot.line(panel, decimated(e.utime(), e.error), line_style(e.index, 1.6), has_legend ? e.score->name : "");
  if (!bound.sigma.empty()) {
    std::vector<double> below;
    for (const double s : bound.sigma) below.push_back(-s);
    plot.line(panel, decimated(bound.utime, bound.sigma), kBoundStyle, has_legend ? kBoundTitle : "");
    plot.line(panel, decimated(bound.utime, below), kBoundStyle, "");
  }
  return remark;
}

constexpr const char* kBand =
    "Shaded: the three standard deviations that each estimator claims, to either side. What lies outside the axes is cut off.";
constexpr const char* kBoundCaption =
    " Dashed: one standard deviation of the posterior Cramer-Rao bound, below which no estimator's root mean square over many "
    "runs "
    "can be; a single run may.";

}  // namespace

Figure state_figure(const FigureContext& context, const std::string& name) {
  PlotScript plot(context.end_s, context.marks_s);
  const std::vector<Entry> entries = entries_of(context, name);
  const BoundCurve bound = bound_of(context, name);
  std::size_t legend = 0;
  Panel& values = value_panel(context, name, entries, 300, plot, legend);
  const std::size_t panels = plot.panels();
  const std::string with_unit = context.label(name);
  const std::string remark =
      error_panel(context, name, "error" + with_unit.substr(with_unit.find(" (")), entries, bound, 220, false, plot);
  const bool has_errors = plot.panels() > panels, has_bound = has_errors && !bound.sigma.empty();
  if (has_bound) {
    plot.line_entry(values, kBoundStyle, kBoundTitle);
    ++legend;
  }
  const std::string caption = has_errors ? std::string("Above: value. Below: estimate minus truth. ") + kBand +
                                               (has_bound ? kBoundCaption : "") + remark
                                         : "Value, with the band of three standard deviations that each estimator claims.";
  return {"state-" + name, readable_name(name), caption + context.marks_text(), plot.text(legend_rows(legend))};
}

std::vector<Figure> group_figures(const FigureContext& context, const std::string& title,
                                  const std::vector<std::string>& names) {
  PlotScript values(context.end_s, context.marks_s), errors(context.end_s, context.marks_s);
  std::size_t legend = 0, estimators = 0;
  bool has_bound = false;
  std::string remarks;
  for (const std::string& name : names) {
    const std::vector<Entry> entries = entries_of(context, name);
    estimators = std::max(estimators, entries.size());
    const BoundCurve bound = bound_of(context, name);
    has_bound = has_bound || !bound.sigma.empty();
    value_panel(context, name, entries, 170, values, legend);
    remarks += error_panel(context, name, "error, " + context.label(name), entries, bound, 170, errors.empty(), errors);
  }
  std::string id = title;
  std::replace(id.begin(), id.end(), ' ', '-');
  std::vector<Figure> figures{
      {"state-" + id, title,
       "Values, with the band of three standard deviations that each estimator claims." + context.marks_text(),
       values.text(legend_rows(legend))}};
  if (!errors.empty())
    figures.push_back(
        {"error-" + id, title + ", errors",
         std::string("Estimate minus truth. ") + kBand + (has_bound ? kBoundCaption : "") + remarks + context.marks_text(),
         errors.text(legend_rows(estimators + (has_bound ? 1 : 0)))});
  return figures;
}

}  // namespace slipstream
