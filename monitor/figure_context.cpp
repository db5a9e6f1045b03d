#include "monitor/figure_context.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "monitor/angles.hpp"
#include "monitor/text.hpp"

namespace slipstream {

std::string line_style(std::size_t estimator, double width) {
  const Style style = estimator_style(estimator);
  return fmt::format("with lines lc rgb \"{}\" lw {} dt {}", style.colour, width, style.dash);
}

std::string point_style(std::size_t estimator) {
  const Style style = estimator_style(estimator);
  return fmt::format("with points pt {} ps 0.3 lc rgb \"{}\"", style.marker, style.colour);
}

FigureContext::FigureContext(const Results& results)
    : run(results.record), board(results.board), end_s(seconds(results.record.simulated())) {
  constexpr std::size_t kMaxMarks = 64;
  if (const std::vector<double>* gear = run.truth_column("gear"))
    for (std::size_t i = 1; i < gear->size() && marks_s.size() < kMaxMarks; ++i)
      if ((*gear)[i] != (*gear)[i - 1] && std::isfinite((*gear)[i] + (*gear)[i - 1]))
        marks_s.push_back(seconds(run.truth().utime[i]));
  for (const EstimatorScore& s : board.estimators)
    for (const StateColumn& state : s.states) units.emplace(state.name, state.unit);
  for (std::size_t i = 0; i < run.info().truth_names.size(); ++i)
    units.emplace(run.info().truth_names[i], run.info().truth_units[i]);
}

std::string FigureContext::unit_of(const std::string& name) const {
  const auto unit = units.find(name);
  return unit != units.end() ? unit->second : name.ends_with("_rad") ? "rad" : "";
}

std::string FigureContext::label(const std::string& name) const { return axis_label(name, shown_unit(unit_of(name))); }

std::vector<double> FigureContext::shown(const std::string& name, std::vector<double> values) const {
  const double scale = shown_scale(unit_of(name));
  if (scale != 1.0)
    for (double& value : values) value *= scale;
  return values;
}

std::string FigureContext::marks_text() const { return marks_s.empty() ? "" : " Dotted vertical lines: gear changes."; }

int legend_rows(std::size_t entries) { return std::max(1, static_cast<int>(entries + 3) / 4); }

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> result;
  append_finite(result, values);
  return result;
}

void append_finite(std::vector<double>& to, const std::vector<double>& from, bool absolute) {
  for (const double v : from)
    if (std::isfinite(v)) to.push_back(absolute ? std::abs(v) : v);
}

std::optional<Band> robust_range(const std::vector<double>& values, double p, double margin) {
  if (values.empty()) return std::nullopt;
  const double low = percentile(values, p), high = percentile(values, 1.0 - p);
  const double span = high > low ? high - low : std::max(1.0, std::abs(high)) * 0.1;
  return Band{low - margin * span, high + margin * span};
}

Band hull(const Band& a, const std::optional<Band>& b) {
  return b ? Band{std::min(a.low, b->low), std::max(a.high, b->high)} : a;
}

}  // namespace slipstream
