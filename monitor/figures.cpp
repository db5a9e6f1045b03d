#include "monitor/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "monitor/figure_context.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

// States that are shown in one figure, where there are all of them.
struct StateGroup {
  const char* title;
  std::array<const char*, 3> names;
};
constexpr std::array<StateGroup, 5> kGroups{
    {{"position", {"east_m", "north_m", "up_m"}},
     {"velocity", {"v_east_mps", "v_north_mps", "v_up_mps"}},
     {"attitude", {"roll_rad", "pitch_rad", "yaw_rad"}},
     {"accelerometer bias", {"accelerometer_bias_x_mps2", "accelerometer_bias_y_mps2", "accelerometer_bias_z_mps2"}},
     {"gyro bias", {"gyro_bias_x_radps", "gyro_bias_y_radps", "gyro_bias_z_radps"}}}};

class FigureMaker : private FigureContext {
 public:
  explicit FigureMaker(const Results& results) : FigureContext(results) {}

  std::vector<Figure> make() {
    inputs();
    sensors();
    std::vector<std::string> states;
    for (const EstimatorScore& s : board.estimators)
      for (const StateColumn& state : s.states)
        if (std::find(states.begin(), states.end(), state.name) == states.end()) states.push_back(state.name);
    if (const std::optional<Figure> way = top_view(*this)) figures_.push_back(*way);
    for (const StateGroup& group : kGroups) {
      const std::vector<std::string> names(group.names.begin(), group.names.end());
      const auto is_there = [&](const std::string& name) {
        return std::find(states.begin(), states.end(), name) != states.end();
      };
      if (!std::all_of(names.begin(), names.end(), is_there)) continue;
      for (Figure& figure : group_figures(*this, group.title, names)) figures_.push_back(std::move(figure));
      std::erase_if(states,
                    [&](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); });
    }
    for (const std::string& name : states) figures_.push_back(state_figure(*this, name));
    innovations();
    consistency(true);
    consistency(false);
    step_times();
    return std::move(figures_);
  }

 private:
  void add(const std::string& id, const std::string& title, const std::string& caption, const PlotScript& script,
           std::size_t legend_entries) {
    figures_.push_back({id, title, caption, script.text(legend_rows(legend_entries))});
  }

  bool is_input(const std::string& quantity) const {
    const auto& names = run.info().input_names;
    return std::find(names.begin(), names.end(), quantity) != names.end();
  }

  void inputs() {
    PlotScript plot(end_s, marks_s);
    for (const auto& [quantity, reading] : run.readings()) {
      if (!is_input(quantity)) continue;
      Panel& panel = plot.panel(label(quantity), 230);
      plot.line(panel, decimated(reading.utime, shown(quantity, reading.value)), "with steps lc rgb \"#0072B2\" lw 2.2",
                "as published");
    }
    const std::vector<double>* gear = run.truth_column("gear");
    if (gear) {
      Panel& panel = plot.panel("gear", plot.empty() ? 230 : 120);
      plot.line(panel, decimated(run.truth().utime, *gear), "with steps lc rgb \"#000000\" lw 2.2", "");
      if (const auto range = robust_range(finite(*gear), 1e-9, 0.0)) {
        panel.y_range = Band{std::floor(range->low) - 0.5, std::ceil(range->high) + 0.5};
        panel.whole_numbers = range->high - range->low <= 16.0;
      }
    }
    if (!plot.empty())
      add("inputs", "What drives the models",
          (gear ? "Input as published on the bus, and the gear of the true drivetrain." : "Input as published on the bus.") +
              marks_text(),
          plot, 1);
  }

  // Measured quantities that no estimator has as a state: those have no other figure. Latitude and longitude are in the top
  // view.
  void sensors() {
    PlotScript plot(end_s, marks_s);
    std::vector<std::string> quantities;
    for (const auto& [quantity, unused] : run.readings()) {
      bool is_elsewhere = is_input(quantity) || quantity == "latitude_deg" || quantity == "longitude_deg";
      for (const EstimatorScore& s : board.estimators)
        for (const StateColumn& state : s.states) is_elsewhere = is_elsewhere || state.name == quantity;
      if (!is_elsewhere) quantities.push_back(quantity);
    }
    for (const std::string& quantity : quantities) {
      const ReadingRecord& reading = run.readings().at(quantity);
      Panel& panel = plot.panel(label(quantity), panel_height(240, quantities.size()));
      plot.line(panel, decimated(reading.utime, shown(quantity, reading.value)), kMeasuredStyle, "measured");
      if (const std::vector<double>* truth = run.truth_column(quantity))
        plot.line(panel, decimated(run.truth().utime, shown(quantity, *truth)), kTruthStyle, "truth");
    }
    if (!plot.empty())
      add("sensors", "Further measurements", "Measured quantities that are not states." + marks_text(), plot, 2);
  }

  void innovations() {
    PlotScript plot(end_s, marks_s);
    std::set<std::string> quantities;
    for (const EstimatorScore& s : board.estimators)
      for (const auto& [quantity, unused] : s.record->innovation_of) quantities.insert(quantity);
    for (const std::string& quantity : quantities) {
      Panel& panel = plot.panel("innovation, " + label(quantity), panel_height(240, quantities.size()));
      std::vector<double> all;
      for (std::size_t k = 0; k < board.estimators.size(); ++k) {
        const auto& of = board.estimators[k].record->innovation_of;
        const auto found = of.find(quantity);
        if (found == of.end()) continue;
        const InnovationRecord& r = found->second;
        append_finite(all, r.innovation, true);
        plot.line(panel, decimated(r.utime, r.innovation), point_style(k), board.estimators[k].name);
        std::vector<double> up, down;
        for (const double sigma : r.sigma) {
          up.push_back(3.0 * sigma);
          down.push_back(-3.0 * sigma);
        }
        plot.line(panel, decimated(r.utime, up), line_style(k, 1.6), "");
        plot.line(panel, decimated(r.utime, down), line_style(k, 1.6), "");
      }
      if (!all.empty()) {
        const double reach = 1.4 * std::max(percentile(all, 0.998), 1e-12);
        panel.y_range = Band{-reach, reach};
      }
    }
    if (!plot.empty())
      add("innovations", "Innovations",
          "Measurement minus prediction, in the measurement's unit. Lines: three standard deviations of its claimed "
          "distribution, to either side." +
              marks_text(),
          plot, board.estimators.size());
  }

  // NIS or NEES over its dimension, one panel an estimator, with its mean over a sliding window.
  void consistency(bool nis) {
    constexpr std::size_t kWindow = 50;
    PlotScript plot(end_s, marks_s);
    for (std::size_t k = 0; k < board.estimators.size(); ++k) {
      const EstimatorScore& s = board.estimators[k];
      const Consistency& score = nis ? s.nis_score : s.nees_score;
      if (score.samples == 0) continue;
      std::vector<Utime> utime;
      std::vector<double> value, window;
      double sum = 0.0;
      double least = score.dimension;  // steps of unequal dimension: the fewer the measurements, the wider the band
      for (std::size_t row = 0; row < s.record->utime.size(); ++row) {
        const double q = nis ? s.record->nis[row] : s.nees[row];
        if (!std::isfinite(q)) continue;
        const double dimension = nis ? s.record->nis_dimension[row] : score.dimension;
        least = std::min(least, dimension);
        utime.push_back(s.record->utime[row]);
        value.push_back(std::max(q / dimension, 1e-12));
        sum += value.back();
        if (value.size() > kWindow) sum -= value[value.size() - 1 - kWindow];
        window.push_back(value.size() < kWindow ? std::nan("") : std::max(sum / kWindow, 1e-12));
      }
      Panel& panel = plot.panel(fmt::format("{}, {}", nis ? "NIS/m" : "NEES/n", s.name), 200);
      panel.log_y = true;
      const Band single{chi_square_quantile(0.025, least) / least, chi_square_quantile(0.975, least) / least};
      plot.constant_band(panel, single, "95 % of single values");
      plot.line(panel, decimated(utime, value), "with points pt 7 ps 0.3 lc rgb \"#9a9a9a\"", "each step");
      plot.constant(panel, 1.0, "with lines lc rgb \"#000000\" lw 1.2", "expected mean");
      plot.line(panel, decimated(utime, window), "with lines lc rgb \"#D55E00\" lw 2.4",
                fmt::format("mean of {} steps", kWindow));
      const double low = std::min(percentile(value, 0.02), single.low), high = std::max(percentile(value, 0.999), single.high);
      panel.y_range = Band{low / 2.0, high * 2.0};
    }
    if (plot.empty()) return;
    if (nis)
      add("nis", "Consistency of the innovations (NIS)",
          "Normalised innovation squared over its dimension. A consistent estimator has mean 1 and 95 % of its values in the "
          "grey band (drawn for the steps with the fewest measurements); below it is too cautious, above it too sure." +
              marks_text(),
          plot, 4);
    else
      add("nees", "Consistency of the errors (NEES)",
          "Normalised estimation error squared over its dimension, read as the figure above. Errors are correlated in time: "
          "excursions last longer than those of the innovations." +
              marks_text(),
          plot, 4);
  }

  void step_times() {
    PlotScript plot(end_s, {});
    std::vector<double> all;
    for (const EstimatorScore& s : board.estimators)
      for (const double t : s.record->step_time_us)
        if (t > 0.0) all.push_back(t);
    if (all.empty()) return;
    Panel& panel = plot.panel("time a step (\u00b5s)", 260);
    panel.log_y = true;
    for (std::size_t k = 0; k < board.estimators.size(); ++k) {
      const EstimatorRecord& r = *board.estimators[k].record;
      if (!r.utime.empty()) plot.line(panel, decimated(r.utime, r.step_time_us), point_style(k), board.estimators[k].name);
    }
    double high = *std::max_element(all.begin(), all.end());
    if (run.info().deadline_s > 0.0) {
      plot.constant(panel, run.info().deadline_s * 1e6, "with lines lc rgb \"#000000\" lw 2 dt (10,6)", "deadline");
      high = std::max(high, run.info().deadline_s * 1e6);
    }
    panel.y_range = Band{*std::min_element(all.begin(), all.end()) / 1.5, high * 1.5};
    add("steptime", "Time a step", "Wall-clock time of one predict and update, on a logarithmic axis.", plot,
        board.estimators.size() + 1);
  }

  std::vector<Figure> figures_;
};

}  // namespace

std::vector<Figure> make_figures(const Results& results) { return FigureMaker(results).make(); }

}  // namespace slipstream
