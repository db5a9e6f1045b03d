// Document 001's filter on a recorded drive of its kind (coursera_carla_pt1): against what a plain filter is known to attain
// there, with a LIDAR that is believed to be mounted otherwise than it is, from an unknown start, and through gaps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/chi_square.hpp"
#include "common/readings.hpp"
#include "reproduce/localisation.hpp"

namespace slipstream {
namespace {

constexpr const char* kItem = "Recorded drive";
constexpr const char* kFolder = "coursera_carla_pt1";
const std::vector<std::string> kPosition{"east_m", "north_m", "up_m"};

Played played(const Bench& bench, const std::string& name, const std::vector<std::string>& overrides,
              const std::vector<Follower>& followers, const Tamper& tamper = {}) {
  const Scenario s = bench.scenario(name, overrides);
  const RecordedStreams streams = bench.streams(s, kFolder);
  return play(s, followers, &streams, kPosition, tamper);
}

double mean_of_known(const std::vector<double>& values) {
  std::vector<double> known;
  std::copy_if(values.begin(), values.end(), std::back_inserter(known), [](double v) { return std::isfinite(v); });
  return mean(known);
}

void nees_row(const std::string& who, const Track& track, Outcome& o) {
  Row row = reported(
      kItem, "mean position NEES, " + who, "", {mean_of_known(track.nees)},
      "3 expected; the issue asks for 2.4 to 3.6. One drive: its errors are correlated, a 95 % band of independent values "
      "would be too narrow");
  row.verdict = Band{2.4, 3.6}.contains(row.ours) ? "inside 2.4 to 3.6" : row.ours < 2.4 ? "below 2.4" : "above 3.6";
  o.rows.push_back(row);
}

const char* const kReadme =
    "attained by a plain error-state filter in NumPy, as the README beside the data says; no value of the document";

void accuracy(const Bench& bench, Outcome& o) {
  const std::vector<Follower> followers{{"es_ekf", "document", "document tuning"}, {"es_ekf", "matched", "matched"}};
  const std::vector<std::string> no_lidar{"tuning.document.use_lidar=false", "tuning.matched.use_lidar=false"};
  const Played gnss = played(bench, "coursera_carla", no_lidar, followers),
               all = played(bench, "coursera_carla", {}, followers);
  struct Sensors {
    const Played& p;
    const char *name, *attained_m;
    double bar_m;
  };
  for (const auto& [p, name, attained_m, bar_m] :
       {Sensors{gnss, "IMU and GNSS", "0.195", 0.2}, {all, "IMU, GNSS and LIDAR", "0.177", 0.18}}) {
    for (std::size_t k = 0; k < followers.size(); ++k) {
      const std::string who = fmt::format("{}, {}", name, followers[k].label);
      const std::string note = fmt::format("{}; the issue's bar is {:.3f} m", kReadme, bar_m);
      o.rows.push_back(met(kItem, "3D RMSE, " + who, "m", Printed(attained_m), distance_rmse_m(p, k), 0.005,
                           "its biases are estimated", note));
      nees_row(who, p.tracks[k], o);
    }
    for (const auto& [sensor, nis] : p.tracks[0].sensors)
      o.rows.push_back(reported(kItem, fmt::format("mean NIS of {}, {}, {}", sensor, name, followers[0].label), "",
                                {mean_of_known(nis.nis)}, "3 expected"));
    for (const NavigationAxis& a : kAxes)
      o.rows.push_back(reported(kItem, fmt::format("largest error {}, {}, {}", a.name, name, followers[0].label), "m",
                                {largest(p.error(0, a.state))}));
  }
  const FixSeries fixes = gnss_fixes(bench.scenario("coursera_carla", {}), all);
  Sketch map = map_sketch("Recorded drive, path", "A recorded drive in CARLA", range_of({all.truth_of("east_m")}),
                          range_of({all.truth_of("north_m")}), "x (m)", "y (m)");
  map.line("truth", all.truth_of("east_m"), all.truth_of("north_m"), kTruthStyle)
      .line("IMU, GNSS and LIDAR", all.tracks[0].of("east_m"), all.tracks[0].of("north_m"), line_of(0, 1.4))
      .line("GNSS", fixes.axis[0], fixes.axis[1], "with points pt 7 ps 0.5 lc rgb \"#D55E00\"");
  o.figures.push_back(
      map.finish("GNSS at 1 Hz. The truth ends at 45.7 s, the sensors go on: where the estimate continues nobody knows."));
  const std::vector<Shown> shown{{&gnss, 0, "IMU and GNSS"}, {&all, 0, "IMU, GNSS and LIDAR"}};
  o.figures.push_back(
      axis_errors("Recorded drive, axes", "Errors of the axes on the recorded drive", shown,
                  "The document's filter with the variances that the data have; estimate minus truth, and three standard "
                  "deviations. The saw's teeth are the GNSS fixes, once a second."));
  o.figures.push_back(angle_errors("Recorded drive, angles", "Errors of the angles on the recorded drive", shown,
                                   "As before. Fixes of the position correct the angles only while the car accelerates."));
}

void wrong_calibration(const Bench& bench, Outcome& o) {
  const std::vector<Follower> followers{{"es_ekf", "document", "document tuning"},
                                        {"es_ekf", "matched", "matched, with a gate"}};
  const Played p = played(bench, "coursera_wrong_lidar", {}, followers);
  Table table{"What the monitor says of a wrong mounting angle", {{"filter", false}, {"warning", false}}, {}};
  for (std::size_t k = 0; k < followers.size(); ++k) {
    const Track& t = p.tracks[k];
    const std::string who = "wrong LIDAR calibration, " + followers[k].label;
    const double rmse = distance_rmse_m(p, k);
    const double nis = mean_of_known(t.sensors.at("gnss").nis);
    if (k == 0) {
      o.rows.push_back(met(kItem, "3D RMSE, " + who, "m", Printed("2.25"), rmse, 0.02, "", kReadme));
      o.rows.push_back(met(kItem, "mean NIS of GNSS, " + who, "", Printed(500.0, 1.0), nis, 50.0, "",
                           std::string(kReadme) + "; \"about 500\""));
    } else {
      o.rows.push_back(reported(kItem, "3D RMSE, " + who, "m", {rmse}, "the gate cannot know which of the two is wrong"));
      o.rows.push_back(reported(kItem, "fixes left out by the gate, " + who, "",
                                {static_cast<double>(t.sensors.at("gnss").gated + t.sensors.at("lidar").gated)}));
    }
    for (const Finding& f : t.findings) table.rows.push_back({followers[k].label, f.text});
    if (t.findings.empty()) table.rows.push_back({followers[k].label, "-"});
  }
  const Played right = played(bench, "coursera_carla", {}, {followers[0]});
  for (const Finding& f : right.tracks[0].findings) table.rows.push_back({"right calibration", f.text});
  if (right.tracks[0].findings.empty()) table.rows.push_back({"right calibration", "nothing"});
  o.tables.push_back({"Recorded drive, warnings",
                      "The course's deliberately wrong calibration: yaw of the LIDAR's map 0.05 rad where it is 0.1 rad.",
                      table});
}

void unknown_start(const Bench& bench, Outcome& o) {
  const Played p = played(bench, "coursera_carla", {}, {{"es_ekf", "fixes", ""}, {"es_ekf", "matched", ""}});
  const Track& t = p.tracks[0];
  const auto& east = t.of("east_m");
  const auto first = std::find_if(east.begin(), east.end(), [](double v) { return std::isfinite(v); });
  o.rows.push_back(reported(kItem, "first estimate, started from the fixes", "s",
                            {t.t_s[static_cast<std::size_t>(first - east.begin())]},
                            "the car stands until 3 s: before it moves nobody knows its heading"));
  const double from_fixes = distance_rmse_m(p, 0, 10.0), given = distance_rmse_m(p, 1, 10.0);
  o.rows.push_back(reported(kItem, "3D RMSE after 10 s, started from the fixes", "m", {from_fixes}));
  o.rows.push_back(reported(kItem, "3D RMSE after 10 s, started at truth", "m", {given}));
  o.rows.push_back(reported(kItem, "their ratio", "", {from_fixes / given}, "the issue asks for 1.15 at most"));
}

// Fixes of these sensors are dropped for so long.
struct Gap {
  const char* name;
  double gnss_s, lidar_s;
};
struct GapScore {
  double largest_m = 0.0;        // distance between estimate and truth in the gap
  double within_nine = 0.0;      // e' P^-1 e <= 9, per cent of the gap
  double within_997 = 0.0;       // inside the ellipsoid of 99.73 %: what three sigma are of one number
  double recovered_m = 0.0;      // after two fixes of what was dropped last
  double recovered_sigma = 0.0;  // there, sqrt(e' P^-1 e)
  double step_deg =
      0.0;  // largest change of an angle's error in an update, from the gap's end to a second after the second fix
};

GapScore score_gap(const Bench& bench, const Gap& gap, double from_s, Played* kept = nullptr) {
  const double to_s = from_s + std::max(gap.gnss_s, gap.lidar_s);
  const std::string_view last = gap.gnss_s >= gap.lidar_s ? kGnss : kLidar;
  int back = 0;
  double recovered_s = 0.0;
  Played p = played(bench, "coursera_carla", {}, {{"es_ekf", "matched", ""}}, [&](Reading& r) {
    const double t_s = seconds(r.header.utime);
    const double length_s = r.quantity == kGnss ? gap.gnss_s : r.quantity == kLidar ? gap.lidar_s : 0.0;
    if (t_s >= from_s && t_s < from_s + length_s) return false;
    if (r.quantity == last && t_s >= to_s && ++back == 2) recovered_s = t_s;
    return true;
  });
  const Track& t = p.tracks[0];
  std::array<std::vector<double>, 3> e, angle;
  for (std::size_t a = 0; a < 3; ++a) {
    e[a] = p.error(0, kAxes[a].state);
    angle[a] = p.error(0, kAngles[a].state);
  }
  GapScore score;
  double rows = 0.0;
  for (std::size_t i = 1; i < t.t_s.size(); ++i) {
    const double distance = std::hypot(e[0][i], e[1][i], e[2][i]);
    if (!std::isfinite(distance)) continue;
    if (t.t_s[i] >= from_s && t.t_s[i] < to_s) {
      score.largest_m = std::max(score.largest_m, distance);
      rows += 1.0;
      score.within_nine += t.nees[i] <= 9.0 ? 1.0 : 0.0;
      score.within_997 += t.nees[i] <= chi_square_quantile(0.9973, 3) ? 1.0 : 0.0;
    }
    if (t.t_s[i] >= to_s - 1.0 && t.t_s[i] <= recovered_s + 1.0)
      for (std::size_t a = 0; a < 3; ++a)
        score.step_deg = std::max(score.step_deg, kDegPerRad * std::abs(angle[a][i] - angle[a][i - 1]));
    if (score.recovered_m == 0.0 && t.t_s[i] >= recovered_s - 1e-9) {
      score.recovered_m = distance;
      score.recovered_sigma = std::sqrt(t.nees[i]);
    }
  }
  score.within_nine *= 100.0 / rows;
  score.within_997 *= 100.0 / rows;
  if (kept) *kept = std::move(p);
  return score;
}

void gaps(const Bench& bench, Outcome& o) {
  constexpr const char* kGaps = "Recorded drive, gaps";
  const std::vector<Gap> all{
      {"GNSS for 7 s", 7.0, 0.0}, {"LIDAR for 6 s", 0.0, 6.0}, {"GNSS for 7 s and LIDAR for 6 s of them", 7.0, 6.0}};
  std::vector<double> from_s;
  for (double t_s = 5.0; t_s <= 35.0; t_s += 2.0) from_s.push_back(t_s);
  Table table{"Gaps, each at 16 places of the drive: median, and the worst",
              {{"dropped", false},
               {"largest distance in the gap (m)"},
               {"e' P^-1 e <= 9 (%)"},
               {"inside the 99.73 % ellipsoid (%)"},
               {"distance after two fixes (m)"},
               {"in standard deviations"},
               {"largest step of an angle at a fix (deg)"}},
              {}};
  for (const Gap& gap : all) {
    std::vector<std::vector<double>> columns(6);
    Played shown;
    for (const double t_s : from_s) {
      const bool is_shown = &gap == &all.back() && t_s == 19.0;
      const GapScore s = score_gap(bench, gap, t_s, is_shown ? &shown : nullptr);
      const double values[] = {s.largest_m, s.within_nine, s.within_997, s.recovered_m, s.recovered_sigma, s.step_deg};
      for (std::size_t i = 0; i < columns.size(); ++i) columns[i].push_back(values[i]);
    }
    const auto text = [&](std::size_t i, bool high_is_bad) {
      const auto [low, high] = std::minmax_element(columns[i].begin(), columns[i].end());
      return fmt::format("{:.2f}, {:.2f}", median(columns[i]), high_is_bad ? *high : *low);
    };
    table.rows.push_back(
        {gap.name, text(0, true), text(1, false), text(2, false), text(3, true), text(4, true), text(5, true)});
    const std::string without = fmt::format("without {}", gap.name);
    o.rows.push_back(reported(kGaps, "largest distance in the gap, " + without, "m", columns[0]));
    Row inside = reported(kGaps, "truth inside the 3-sigma ellipsoid of 99.73 %, " + without, "%", {mean(columns[2])},
                          "mean over the places; the issue asks for 99 % of the gap");
    Row nine = reported(kGaps, "e' P^-1 e <= 9, " + without, "%", {mean(columns[1])},
                        "mean over the places; with three numbers this ellipsoid holds 97.1 % of a consistent filter's errors");
    inside.runs = nine.runs = static_cast<int>(from_s.size());
    o.rows.insert(o.rows.end(), {inside, nine});
    o.rows.push_back(reported(kGaps, "distance after two fixes, " + without, "m", columns[3]));
    o.rows.push_back(reported(kGaps, "largest step of an angle at a fix after it, " + without, "deg", columns[5],
                              "the issue asks for 1 deg at most; the noise of this gyro, 0.1 rad/s a sample, makes 1.1 deg on "
                              "each axis in 7 s, and the first fixes after "
                              "the gap put that right at once"));
    if (&gap == &all.back())
      o.figures.push_back(
          axis_errors("Recorded drive, gap", "No fix of any kind for six seconds", {{&shown, 0, "matched"}},
                      "GNSS is dropped from 19 to 26 s (dotted), LIDAR from 19 to 25 s: the intervals open, the truth "
                      "stays inside, and they close with the first fixes.",
                      {19.0, 26.0}));
  }
  o.tables.push_back({kGaps,
                      "Matched tuning, gaps that begin at 5, 7 ... 35 s. Errors within a gap are strongly correlated: a gap is "
                      "inside as a whole or "
                      "outside for a while, so single places scatter.",
                      table});
}

}  // namespace

void reproduce_localisation_recorded(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "Somebody else's drive in CARLA, from a course on state estimation: IMU 200 Hz, GNSS 1 Hz, LIDAR fixes at 9.5 Hz, exact "
      "truth. All numbers "
      "here are ours; the document has no such drive. Those that are to be met are what a plain error-state filter is known to "
      "attain. The "
      "variances are those of the data, as its README states them, and nothing else is tuned.");
  bench.progress(0, 4);
  accuracy(bench, o);
  bench.progress(1, 4);
  wrong_calibration(bench, o);
  bench.progress(2, 4);
  unknown_start(bench, o);
  bench.progress(3, 4);
  gaps(bench, o);
  bench.progress(4, 4);
}

}  // namespace slipstream
