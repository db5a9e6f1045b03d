// Document 001 on a drive that is long enough to need its fixes: a minute of city with curves, a hill and bumps, sensors with
// biases, delays and mounting places (scenarios/city.toml); its filter, the one a practitioner would use, and the fusion of
// three that it names as future work.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reproduce/localisation.hpp"

namespace slipstream {
namespace {

constexpr const char* kItem = "City drive";

struct Case {
  int hz;
  std::string tuning;
  std::string label;
  std::string mismatch;  // why the filter cannot be consistent; empty: it should be
};

enum Value { kHeight, kDistance, kYaw, kInsideAxes, kInsideAngles, kValues };

void append(std::vector<double>& values, const Played& p, std::size_t track) {
  values.push_back(largest(p.error(track, "up_m")));
  values.push_back(distance_rmse_m(p, track));
  values.push_back(kDegPerRad * largest(p.error(track, "yaw_rad")));
  double axes = 0.0, angles = 0.0;
  for (const NavigationAxis& a : kAxes) axes += within_three_sigma_percent(p, track, a.state) / 3.0;
  for (const NavigationAxis& a : kAngles) angles += within_three_sigma_percent(p, track, a.state) / 3.0;
  values.push_back(axes);
  values.push_back(angles);
}

// The start is drawn from the matched tuning's distribution, which all but the document's filter believe.
Scenario city(const Bench& bench, int hz, int seed) {
  Scenario s =
      bench.scenario("city", {seed_is(seed), fmt::format("sensor.gnss.rate_hz={}", hz), "tuning.document.use_lidar=false"});
  draw_navigation_start(s, "matched");
  Tuning gnss = s.estimator.tunings.at("matched");
  gnss.strapdown.use_lidar = gnss.strapdown.use_forward_speed = false;
  s.estimator.tunings["gnss"] = gnss;
  return s;
}

void draw(const Scenario& s, const Played& p, Outcome& o) {
  const FixSeries fixes = gnss_fixes(s, p);
  Sketch map = map_sketch("City drive, path", "A minute of city driving", range_of({p.truth_of("east_m")}),
                          range_of({p.truth_of("north_m")}), "east (m)", "north (m)");
  map.line("GNSS", fixes.axis[0], fixes.axis[1], "with points pt 7 ps 0.3 lc rgb \"#9a9a9a\"")
      .line("truth", p.truth_of("east_m"), p.truth_of("north_m"), kTruthStyle)
      .line("estimate, IMU and GNSS", p.tracks[0].of("east_m"), p.tracks[0].of("north_m"), line_of(0, 1.4));
  o.figures.push_back(map.finish("516 m, GNSS at 25 Hz, seed 1."));
  const std::vector<Shown> shown{{&p, 0, "IMU and GNSS"}, {&p, 2, "document filter"}};
  const std::string caption =
      "Estimate minus truth and three standard deviations; GNSS at 25 Hz, seed 1. Above: biases estimated, antenna and IMU "
      "where they are. "
      "Below: the document's nine states, which know no biases and no doubt about the start, and so promise too much.";
  o.figures.push_back(axis_errors("City drive, axes", "Errors of the axes in the city", shown, caption));
  o.figures.push_back(angle_errors("City drive, angles", "Errors of the angles in the city", shown, caption));
}

}  // namespace

void reproduce_localisation_city(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "Ours, without a published counterpart but for the height: 60 s, 516 m, up to 14 m/s, a hill of 4 m, three bumps, and a "
      "standstill at "
      "both ends. IMU 500 Hz with biases, 0.3 m from the reference point and askew; GNSS with 0.10, 0.10 and 0.15 m a fix, 50 "
      "ms late. Every "
      "start is drawn from what the filter believes, and so are the true biases. Errors are those of the newest estimate at "
      "every instant, "
      "when the fixes of the last 50 ms are still on their way.");
  const std::string no_biases = "it knows no biases, and no doubt about the start";
  const std::vector<Case> at_25{{25, "gnss", "IMU and GNSS", ""},
                                {25, "matched", "IMU, GNSS, LIDAR and forward speed", ""},
                                {25, "document", "document filter, IMU and GNSS", no_biases}};
  const std::vector<std::vector<Case>> rates{at_25, {{50, "gnss", "IMU and GNSS", ""}}, {{100, "gnss", "IMU and GNSS", ""}}};
  Table table{"Medians over the runs; within 3 sigma: means",
              {{"GNSS", false},
               {"filter", false},
               {"largest height error (m)"},
               {"3D RMSE (m)"},
               {"largest yaw error (deg)"},
               {"axes within 3 sigma (%)"},
               {"angles within 3 sigma (%)"},
               {"mean NEES at the end"}},
              {}};
  std::vector<std::pair<std::string, NeesOverRuns>> consistent;
  int done = 0;
  const int total = static_cast<int>(rates.size()) * bench.seeds;
  for (const std::vector<Case>& cases : rates) {
    std::vector<Follower> followers;
    for (const Case& c : cases) followers.push_back({"es_ekf", c.tuning, c.label});
    std::vector<NeesOverRuns> nees(cases.size());
    const auto columns = over_seeds(bench, done, total, [&](int seed) {
      const Scenario s = city(bench, cases[0].hz, seed);
      const Played p = play(s, followers);
      if (seed == 1 && cases.size() > 1) draw(s, p, o);
      std::vector<double> values;
      for (std::size_t k = 0; k < cases.size(); ++k) {
        append(values, p, k);
        nees[k].add(p.tracks[k]);
      }
      return values;
    });
    done += bench.seeds;
    for (std::size_t k = 0; k < cases.size(); ++k) {
      const Case& c = cases[k];
      const auto value = [&](Value v) { return columns[k * kValues + v]; };
      const std::string of = fmt::format("{} Hz, {}", c.hz, c.label);
      if (c.hz == 50)
        o.rows.push_back(reported(kItem, "largest height error, " + of, "m", value(kHeight)));
      else
        o.rows.push_back(judged(kItem, "largest height error, " + of, "m", Printed(c.hz == 25 ? "0.80" : "0.20"), Aim::kLow,
                                value(kHeight), "",
                                "published on another drive, of 2.2 s; the issue's bar at 25 Hz is 0.20 m"));
      o.rows.push_back(reported(kItem, "3D RMSE, " + of, "m", value(kDistance)));
      o.rows.push_back(reported(kItem, "largest yaw error, " + of, "deg", value(kYaw)));
      o.rows.push_back(nees[k].at_the_end(kItem, of, c.mismatch));
      table.rows.push_back({fmt::format("{} Hz", c.hz), c.label, fmt::format("{:.3f}", median(value(kHeight))),
                            fmt::format("{:.4f}", median(value(kDistance))), fmt::format("{:.2f}", median(value(kYaw))),
                            fmt::format("{:.1f}", mean(value(kInsideAxes))), fmt::format("{:.1f}", mean(value(kInsideAngles))),
                            fmt::format("{:.2f} of {}", mean(nees[k].last), nees[k].dimension.back())});
      if (c.mismatch.empty()) consistent.emplace_back(fmt::format("{} Hz{}", c.hz, c.tuning == "gnss" ? "" : ", all"), nees[k]);
    }
  }
  o.tables.push_back(
      {kItem,
       "More fixes are better, as the document says: the error shrinks with the rate, by less than its square root, because "
       "the fixes come late and the IMU fills the time between them.",
       table});
  std::vector<std::pair<std::string, const NeesOverRuns*>> shown;
  for (const auto& [label, nees] : consistent) shown.emplace_back(label, &nees);
  o.figures.push_back(
      nees_figure("City drive, NEES", "NEES over the runs in the city", shown,
                  "Mean over the runs of the squared errors of all 15 states over their claimed covariance, at "
                  "every instant. \"All\": with LIDAR and forward speed. The peaks at 30 and 39 s are the first two bumps."));
}

}  // namespace slipstream
