// The way from above: east against north in equal scale, truth, estimates and the GNSS fixes that the first estimator used.
//
// A fix is drawn where the estimator says it was: its position after the update plus what the update left of the innovation
// (diagnosis.hpp, r_G). The antenna's lever arm is not taken off.
#include <algorithm>
#include <cmath>

#include "monitor/diagnosis.hpp"
#include "monitor/figure_context.hpp"

namespace slipstream {
namespace {

// At most kMaxPlotPoints of the points, evenly in time: a way has no peaks to keep.
Curve thinned(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t every = (x.size() + kMaxPlotPoints - 1) / kMaxPlotPoints;
  Curve curve;
  for (std::size_t i = 0; i < x.size(); i += every) {
    const bool known = std::isfinite(x[i]) && std::isfinite(y[i]);
    curve.x.push_back(known ? x[i] : 0.0);
    curve.y.push_back(known ? y[i] : std::nan(""));
  }
  return curve;
}

const StateColumn* state_of(const EstimatorScore& s, const std::string& name) {
  const auto found =
      std::find_if(s.states.begin(), s.states.end(), [&](const StateColumn& state) { return state.name == name; });
  return found == s.states.end() || s.record->states == 0 ? nullptr : &*found;
}

}  // namespace

std::optional<Figure> top_view(const FigureContext& context) {
  struct Way {
    Curve curve;
    std::string style, title;
  };
  std::vector<Way> ways;
  std::string caption = "Seen from above, in equal scale.";
  for (std::size_t k = 0; k < context.board.estimators.size(); ++k) {
    const EstimatorScore& s = context.board.estimators[k];
    const StateColumn *east = state_of(s, "east_m"), *north = state_of(s, "north_m");
    if (!east || !north) continue;
    if (ways.empty()) {
      Curve fixes;
      for (const Vector3& p : fix_positions(*s.record, "gnss")) {
        fixes.x.push_back(p[0]);
        fixes.y.push_back(p[1]);
      }
      if (!fixes.x.empty()) {
        ways.push_back({thinned(fixes.x, fixes.y), "with points pt 7 ps 0.3 lc rgb \"#9a9a9a\"", "GNSS fixes"});
        caption += " GNSS fixes are drawn where " + s.name + " used them.";
      }
      const std::vector<double>*true_east = context.run.truth_column("east_m"),
            *true_north = context.run.truth_column("north_m");
      if (true_east && true_north) ways.push_back({thinned(*true_east, *true_north), kTruthStyle, "truth"});
    }
    ways.push_back({thinned(east->estimate, north->estimate), line_style(k), s.name});
  }
  std::vector<double> x, y;
  for (const Way& way : ways)
    for (std::size_t i = 0; i < way.curve.x.size(); ++i) {
      if (!std::isfinite(way.curve.y[i])) continue;
      x.push_back(way.curve.x[i]);
      y.push_back(way.curve.y[i]);
    }
  const std::optional<Band> across = robust_range(x, 0.001, 0.05), up = robust_range(y, 0.001, 0.05);
  if (!across || !up) return std::nullopt;
  // Metres a pixel: as wide as the figure, or as high as 700 px.
  constexpr double kHighest_px = 700.0, kLowest_px = 160.0;
  const double scale = std::max((across->high - across->low) / kPlotWidth_px, (up->high - up->low) / kHighest_px);
  const double middle = 0.5 * (across->low + across->high), height_px = std::max((up->high - up->low) / scale, kLowest_px);
  const double half_width = 0.5 * scale * kPlotWidth_px, half_height = 0.5 * scale * height_px;
  PlotScript plot("east (m)", Band{middle - half_width, middle + half_width});
  Panel& panel = plot.panel("north (m)", static_cast<int>(height_px));
  panel.y_range = Band{0.5 * (up->low + up->high) - half_height, 0.5 * (up->low + up->high) + half_height};
  for (const Way& way : ways) plot.line(panel, way.curve, way.style, way.title);
  return Figure{"way", "the way", caption, plot.text(legend_rows(ways.size()))};
}

}  // namespace slipstream
