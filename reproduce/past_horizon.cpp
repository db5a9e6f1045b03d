// Past document 002: the moving horizon's windows solved by real-time iteration (estimators/rti.hpp) beside Ipopt, on the same
// drives and with the same weights.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "monitor/text.hpp"
#include "reproduce/monte_carlo.hpp"
#include "reproduce/past.hpp"

namespace slipstream {
namespace {

constexpr const char* kItem = "Moving horizon";

struct Case {
  const char *scenario, *algorithm, *tuning, *state, *label;
  int window;
  double period_ms;
  double bar_us = 0.0;      // for the median step; 0: none was set
  const char* rivals = "";  // what the same window costs elsewhere
};
constexpr Case kCases[] = {
    {"unimog", "mhe", "matched", "friction", "Unimog, N = 4", 4, 10.0, 1.2, "acados, RTI with HPIPM: 7.6 us"},
    {"unimog", "mhe", "matched", "friction", "Unimog, N = 20", 20, 10.0, 4.0, "acados, RTI with HPIPM: 26 us"},
    {"unimog", "mhe", "document", "friction", "Unimog, document's form, N = 4", 4, 10.0, 0.4, "DAQP, condensed: 0.20 us"},
    {"unimog", "mhe", "document", "friction", "Unimog, document's form, N = 20", 20, 10.0, 0.7, "DAQP, condensed: 0.22 us"},
    {"circle", "mhe", "matched", "lateral_speed_mps", "circle, N = 4", 4, 10.0},
    {"scale_car_rich", "hierarchical_mhe", "matched", "friction", "scale car, two levels, N = 4", 4, 1.0},
};

// Largest difference of two tracks in the first one's standard deviations, where both are to be used.
double largest_difference(const Track& a, const Track& b) {
  double most = 0.0;
  for (std::size_t s = 0; s < a.mean.size(); ++s)
    for (std::size_t i = 0; i < a.mean[s].size(); ++i) {
      const double off = std::abs(a.mean[s][i] - b.mean[s][i]) / a.sigma[s][i];
      if (std::isfinite(off)) most = std::max(most, off);
    }
  return most;
}

std::vector<double> positive(std::vector<double> values) {
  for (double& v : values) v = v > 0.0 ? v : std::numeric_limits<double>::quiet_NaN();
  return values;
}

}  // namespace

void reproduce_moving_horizon(const Bench& bench, Outcome& o) {
  Table table{"Real-time iteration (RTI) beside Ipopt",
              {{"window", false},
               {"R2, Ipopt"},
               {"R2, RTI"},
               {"largest difference (sigma)"},
               {"median step, Ipopt (us)"},
               {"median step, RTI (us)"},
               {"99th percentile, RTI (us)"},
               {"largest KKT residual, RTI (1)"},
               {"steps that fell back, Ipopt"},
               {"steps that fell back, RTI"}},
              {}};
  int done = 0;
  const int total = static_cast<int>(std::size(kCases)) * bench.seeds;
  Played shown;
  for (const Case& c : kCases) {
    const std::string prefix = fmt::format("tuning.{}.", c.tuning);
    const auto columns = over_seeds(bench, done, total, [&](int seed) {
      const std::vector<std::string> common{seed_is(seed), fmt::format("{}mhe_window={}", prefix, c.window)};
      std::vector<std::string> real_time = common;
      real_time.push_back(prefix + "mhe_solver=\"rti\"");
      const Scenario ipopt = bench.scenario(c.scenario, common), rti = bench.scenario(c.scenario, real_time);
      Played p = play(ipopt, {{c.algorithm, c.tuning, "Ipopt"}, {c.algorithm, c.tuning, "RTI", &rti}});
      const Track &with_ipopt = p.tracks[0], &with_rti = p.tracks[1];
      const std::vector<double> values{p.score(0, c.state).r2,
                                       p.score(1, c.state).r2,
                                       largest_difference(with_ipopt, with_rti),
                                       median(with_ipopt.step_time_us),
                                       median(with_rti.step_time_us),
                                       percentile(with_rti.step_time_us, 0.99),
                                       score_residuals(with_rti.kkt_residual).max,
                                       static_cast<double>(with_ipopt.tally.fallback),
                                       static_cast<double>(with_rti.tally.fallback)};
      if (seed == 1 && &c == &kCases[0]) shown = std::move(p);
      return values;
    });
    done += bench.seeds;
    const auto largest = [&](std::size_t i) { return *std::max_element(columns[i].begin(), columns[i].end()); };
    table.rows.push_back({c.label, fmt::format("{:.5f}", median(columns[0])), fmt::format("{:.5f}", median(columns[1])),
                          fmt::format("{:.1e}", largest(2)), fmt::format("{:.0f}", median(columns[3])),
                          fmt::format("{:.2f}", median(columns[4])), fmt::format("{:.2f}", median(columns[5])),
                          fmt::format("{:.1e}", largest(6)), fmt::format("{:.0f}", largest(7)),
                          fmt::format("{:.0f}", largest(8))});
    std::vector<double> ratio = columns[3];
    for (std::size_t i = 0; i < ratio.size(); ++i) ratio[i] /= columns[4][i];
    o.rows.push_back(reported(kItem, fmt::format("step time of Ipopt by that of RTI, {}", c.label), "", ratio,
                              "medians of the same runs, with everything that an estimator does in a step"));
    if (c.bar_us > 0.0) {
      Row row = reported(kItem, fmt::format("median step of RTI, {}", c.label), "us", columns[4],
                         fmt::format("everything that an estimator does in a step, the session's own calls of the clock among "
                                     "it. The solver alone elsewhere, on another machine: {}",
                                     c.rivals));
      row.verdict = against_bar(c.bar_us, Aim::kLow, row.ours);
      o.rows.push_back(row);
    }
    o.rows.push_back(reported(kItem, fmt::format("R2 {} by RTI, {}", readable_name(c.state), c.label), "", columns[1],
                              fmt::format("by Ipopt {:.5f}", median(columns[0]))));
    o.rows.push_back(
        reported(kItem, fmt::format("largest difference of RTI and Ipopt, in sigma, {}", c.label), "", columns[2],
                 fmt::format("of all runs {:.1e}. Ipopt solves each window to its end, RTI until its residual is below 0.01; "
                             "where it falls back, at most {:.0f} times a run here, it publishes the Kalman update",
                             largest(2), largest(8))));
    o.rows.push_back(reported(
        kItem, fmt::format("share of the sampling period that a step of RTI takes, {}", c.label), "%",
        [&] {
          std::vector<double> share = columns[5];
          for (double& s : share) s *= 0.1 / c.period_ms;
          return share;
        }(),
        fmt::format("99th percentile of the steps; the period is {:g} ms", c.period_ms)));
  }
  o.tables.push_back({kItem,
                      "Same weights, same bounds, same start. R2 of the friction, on the circle of the lateral speed; medians "
                      "over the runs, differences, residuals and fallbacks the largest of all.",
                      table});
  Sketch s(kItem, "Unimog, N = 4: time and residual of a step", 10.0);
  s.panel("time a step (us)", 260).log_y();
  for (const std::size_t k : {0U, 1U})
    s.line(shown.tracks[k].label, shown.tracks[k].t_s, shown.tracks[k].step_time_us, line_of(k, 1.2));
  s.panel("KKT residual (1)", 220).log_y();
  for (const std::size_t k : {0U, 1U})
    s.line(shown.tracks[k].label, shown.tracks[k].t_s, positive(shown.tracks[k].kkt_residual), line_of(k, 1.2));
  o.figures.push_back(
      s.finish("Seed 1, logarithmic scales. The residual is in the estimate's standard deviations: what is left "
               "undone is far below what the noise leaves open."));
}

}  // namespace slipstream
