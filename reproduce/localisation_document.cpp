// Document 001, chapter 4: its filter at GNSS rates of 25, 50 and 100 Hz on a drive of 2.2 s like its own (Figs 5-15), and what
// its two printed numbers can and cannot mean.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/readings.hpp"
#include "reproduce/localisation.hpp"

namespace slipstream {
namespace {

struct Rate {
  int hz;
  const char *estimate, *axes, *angles;  // the document's figures
  std::optional<const char*> height_m;   // the largest error that it prints
};
const std::array<Rate, 3> kRates{{{25, "Fig. 7", "Fig. 8", "Fig. 9", "0.80"},
                                  {50, "Fig. 10", "Fig. 11", "Fig. 12", std::nullopt},
                                  {100, "Fig. 13", "Fig. 14", "Fig. 15", "0.20"}}};

// By hand: until the estimate before the next fix, T - dt after the spike's sample, the height runs away by 20 m/s (T - 3/2
// dt).
double by_hand_m(int hz) { return 1e4 * 0.002 * (1.0 / hz - 1.5 * 0.002); }

constexpr const char* kDocument = "document";
constexpr const char* kMatched = "matched";
constexpr const char* kAlone = "without GNSS";

// What one run says of one follower, in this order.
enum Value { kHeight, kEast, kNorth, kDistance, kYaw, kInsideHeight, kInsideAxes, kInsideAngles, kInsideYaw, kValues };

void append(std::vector<double>& values, const Played& p, std::size_t track) {
  values.push_back(largest(p.error(track, "up_m")));
  values.push_back(largest(p.error(track, "east_m")));
  values.push_back(largest(p.error(track, "north_m")));
  values.push_back(distance_rmse_m(p, track));
  values.push_back(kDegPerRad * largest(p.error(track, "yaw_rad")));
  const auto inside = [&](const char* state) { return within_three_sigma_percent(p, track, state); };
  values.push_back(inside("up_m"));
  values.push_back((inside("east_m") + inside("north_m") + inside("up_m")) / 3.0);
  values.push_back((inside("roll_rad") + inside("pitch_rad") + inside("yaw_rad")) / 3.0);
  values.push_back(inside("yaw_rad"));
}

std::vector<std::string> at_rate(int hz, int seed) { return {seed_is(seed), fmt::format("sensor.gnss.rate_hz={}", hz)}; }

void path(const Scenario& s, const Played& p, Outcome& o) {
  const Track& t = p.tracks[0];
  Sketch driven = map_sketch("Fig. 5", "The path driven", range_of({p.truth_of("east_m")}), range_of({p.truth_of("north_m")}),
                             "east (m)", "north (m)");
  driven.line("truth", p.truth_of("east_m"), p.truth_of("north_m"), kTruthStyle);
  o.figures.push_back(
      driven.finish("Ours: the document shows its path in a figure without numbers. The car stands, pulls away to the west and "
                    "turns to the left, "
                    "then to the right, on level ground: there is no height to see, as in the document."));
  const FixSeries fixes = gnss_fixes(s, p);
  Sketch seen = map_sketch("Fig. 6", "The path in the plane and GNSS at 25 Hz", range_of({fixes.axis[0]}),
                           range_of({fixes.axis[1]}), "east (m)", "north (m)");
  seen.line("GNSS", fixes.axis[0], fixes.axis[1], "with points pt 7 ps 0.5 lc rgb \"#9a9a9a\"")
      .line("truth", p.truth_of("east_m"), p.truth_of("north_m"), kTruthStyle)
      .line("estimate, document tuning", t.of("east_m"), t.of("north_m"), line_of(0, 1.6));
  o.figures.push_back(
      seen.finish("Latitude, longitude and height to ECEF to east-north-up. The fixes scatter by 0.5 m, our choice; the "
                  "document's lie on its "
                  "path as far as one can see, so its noise was smaller or none."));
}

void estimates(const Rate& rate, const Scenario& s, const std::vector<Shown>& shown, Outcome& o) {
  const Played& p = *shown[0].played;
  const FixSeries fixes = gnss_fixes(s, p);
  Sketch sketch(rate.estimate, fmt::format("Estimate and truth, GNSS at {} Hz", rate.hz), p.truth_t_s.back());
  for (std::size_t a = 0; a < 3; ++a) {
    sketch.panel(fmt::format("{} (m)", kAxes[a].name), 200)
        .line("GNSS", fixes.t_s, fixes.axis[a], "with points pt 7 ps 0.35 lc rgb \"#9a9a9a\"")
        .line("truth", p.truth_t_s, p.truth_of(kAxes[a].state), kTruthStyle);
    for (std::size_t k = 0; k < shown.size(); ++k) {
      const Track& t = shown[k].played->tracks[shown[k].track];
      sketch.line(shown[k].label, t.t_s, t.of(kAxes[a].state), line_of(k, 1.6));
    }
  }
  o.figures.push_back(
      sketch.finish("Seed 1. On the height the fixes scatter by 1 m, our choice: over two seconds a known start and this IMU "
                    "are worth more than all of them."));
}

void draw(const Rate& rate, const Scenario& s, const std::vector<Shown>& shown, Outcome& o) {
  estimates(rate, s, shown, o);
  o.figures.push_back(
      axis_errors(rate.axes, fmt::format("Errors of the axes, GNSS at {} Hz", rate.hz), shown,
                  "Estimate minus truth, and three standard deviations as the filter states them; seed 1. Above: the "
                  "document's filter, started at the truth without doubt. Below: started wrong by 0.1 m and 0.05 m/s, "
                  "and biases drawn from what the filter believes."));
  o.figures.push_back(
      angle_errors(rate.angles, fmt::format("Errors of the angles, GNSS at {} Hz", rate.hz), shown,
                   "As in the figure before. The yaw crosses 180 degrees twice: the document's error plots break there, "
                   "these are the short way round."));
}

struct AtRate {
  std::vector<std::vector<double>> values;  // by follower and Value
  NeesOverRuns document, matched;
};

AtRate run_rate(const Bench& bench, const Rate& rate, int first, int total, Outcome& o) {
  AtRate result;
  result.values = over_seeds(bench, first, total, [&](int seed) {
    Scenario s = bench.scenario("city_document", at_rate(rate.hz, seed));
    Tuning alone = s.estimator.tunings.at(kDocument);
    alone.strapdown.use_gnss = false;
    s.estimator.tunings[kAlone] = alone;
    const Played known = play(s, {{"es_ekf", kDocument, ""}, {"es_ekf", kAlone, ""}});
    Scenario drawn = s;
    draw_navigation_start(drawn, kMatched);
    const Played believed = play(drawn, {{"es_ekf", kMatched, ""}});
    if (seed == 1) {
      if (rate.hz == 25) path(s, known, o);
      draw(rate, s, {{&known, 0, "document tuning"}, {&believed, 0, "matched, start drawn"}}, o);
    }
    result.document.add(known.tracks[0]);
    result.matched.add(believed.tracks[0]);
    std::vector<double> values;
    append(values, known, 0);
    append(values, believed, 0);
    append(values, known, 1);
    return values;
  });
  return result;
}

void judge(const Rate& rate, const AtRate& at, Table& table, Outcome& o) {
  const char* const who[] = {"document tuning", "matched, start drawn", "document tuning without GNSS"};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto value = [&](Value v) { return at.values[k * kValues + v]; };
    const std::string of = fmt::format("{} Hz, {}", rate.hz, who[k]);
    const std::string note =
        k == 2 ? "dead reckoning alone: on this drive the fixes add next to nothing"
               : "theirs is one run on a drive and with noise that are not printed; the issue's bar at 25 Hz is 0.20 m";
    if (rate.height_m && k < 2)
      o.rows.push_back(
          judged(rate.axes, "largest height error, " + of, "m", Printed(*rate.height_m), Aim::kLow, value(kHeight), "", note));
    else
      o.rows.push_back(reported(rate.axes, "largest height error, " + of, "m", value(kHeight), k == 2 ? note : ""));
    o.rows.push_back(reported(rate.axes, "3D RMSE, " + of, "m", value(kDistance)));
    table.rows.push_back({fmt::format("{} Hz", rate.hz), who[k], fmt::format("{:.3f}", median(value(kHeight))),
                          fmt::format("{:.3f}", median(value(kEast))), fmt::format("{:.3f}", median(value(kNorth))),
                          fmt::format("{:.4f}", median(value(kDistance))), fmt::format("{:.3f}", median(value(kYaw))),
                          fmt::format("{:.1f}", mean(value(kInsideAxes))), fmt::format("{:.1f}", mean(value(kInsideAngles)))});
    if (k == 2) continue;
    Row axes =
        reported(rate.axes, "samples within 3 sigma, three axes, " + of, "%", {mean(value(kInsideAxes))},
                 "99.7 % of a consistent filter's; the document says \"in general within the interval\", with a peak outside "
                 "it on the height at 25 Hz");
    Row angles = reported(rate.angles, "samples within 3 sigma, three angles, " + of, "%", {mean(value(kInsideAngles))});
    Row yaw = reported(rate.angles, "samples within 3 sigma, yaw, " + of, "%", {mean(value(kInsideYaw))},
                       "the document's yaw leaves its interval because its plots do not wrap");
    axes.runs = angles.runs = yaw.runs = static_cast<int>(value(kHeight).size());
    o.rows.insert(o.rows.end(), {axes, angles, yaw});
    o.rows.push_back(reported(rate.angles, "largest yaw error, " + of, "deg", value(kYaw)));
  }
  o.rows.push_back(at.document.at_the_end(rate.axes, fmt::format("{} Hz, {}", rate.hz, who[0])));
  o.rows.push_back(at.matched.at_the_end(rate.axes, fmt::format("{} Hz, {}", rate.hz, who[1])));
}

// One sample of the vertical specific force is 10000 m/s^2 too large, just after a fix; sensors without noise, as CARLA's are,
// and a filter that believes its fixes.
void spike(const Bench& bench, Outcome& o) {
  Table table{"A spike of the accelerometer and the largest height error (m)",
              {{"GNSS", false}, {"by hand"}, {"largest height error"}, {"the document"}},
              {}};
  std::vector<Played> played;
  for (const Rate& rate : kRates) {
    std::vector<std::string> overrides = at_rate(rate.hz, 1);
    for (const char* o_ : {"sensor.imu.noise_mps2=0", "sensor.imu.noise_radps=0", "sensor.gnss.noise_m=[1e-6,1e-6,1e-6]",
                           "tuning.document.noise=\"given\"", "tuning.document.accelerometer_mps2=100.0",
                           "tuning.document.gyro_radps=0.01", "tuning.document.gnss_m=[0.001,0.001,0.001]"})
      overrides.emplace_back(o_);
    const Scenario s = bench.scenario("city_document", overrides);
    bool done = false;
    const Tamper spiky = [&](Reading& r) {
      if (done || r.quantity != kImu || seconds(r.header.utime) < 0.2 - 1e-9) return true;
      std::array<double, 6> value{};
      std::copy(r.value.begin(), r.value.end(), value.begin());
      value[2] += 1e4;
      r.value = Values(std::span<const double>(value));
      done = true;
      return true;
    };
    played.push_back(play(s, {{"es_ekf", kDocument, ""}}, nullptr, {}, spiky));
    const double height = largest(played.back().error(0, "up_m"));
    table.rows.push_back({fmt::format("{} Hz", rate.hz), fmt::format("{:.2f}", by_hand_m(rate.hz)),
                          fmt::format("{:.2f}", height), rate.height_m ? *rate.height_m : "-"});
    o.rows.push_back(reported("A spike", fmt::format("largest height error after a spike of 10000 m/s^2, {} Hz", rate.hz), "m",
                              {height}, "its size is chosen: it shows that a spike suffices, not that it was so"));
  }
  Sketch sketch("A spike, height", "A spike of the accelerometer, GNSS at 25, 50 and 100 Hz", 1.0, {0.2});
  for (std::size_t i = 0; i < played.size(); ++i)
    sketch.panel(fmt::format("up, {} Hz (m)", kRates[i].hz), 150)
        .range(-0.9, 0.9)
        .line("height error", played[i].tracks[0].t_s, played[i].error(0, "up_m"), line_of(0, 1.6));
  o.figures.push_back(
      sketch.finish("One sample at 0.2 s. Every fix puts the height right again; in between it runs away with the speed that "
                    "the spike has left."));
  o.tables.push_back({"A spike",
                      "Nothing in the noise of such sensors explains 0.80 m two seconds after a known start: the row without "
                      "GNSS has millimetres. The "
                      "document says itself that CARLA's accelerations were 10000 times too large as the car began to move and "
                      "near the end. One such sample "
                      "of 2 ms is 20 m/s of speed that is not there, and a filter that believes its fixes loses 20 m/s until "
                      "the next one: about the two "
                      "numbers that it prints, in about the ratio of the rates, and with a peak outside the 3-sigma interval "
                      "as in its Fig. 8. A plausible "
                      "reading, not a proof: the size of the spike and the noise that the filter believes are ours. In the "
                      "city, below, the same filter "
                      "comes to 0.6 m at 25 Hz for another reason: it knows no biases.",
                      table});
}

}  // namespace

void reproduce_localisation(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "A car on level ground for 2.2 s, IMU at 500 Hz, 1100 samples, 50 to 220 fixes. The document prints neither the drive "
      "nor any noise. "
      "Ours: 0.1 m/s^2 and 0.01 rad/s a sample of the IMU, 0.5, 0.5 and 1 m a fix, and both filters know them. \"Document "
      "tuning\": eqs "
      "3.1-3.27, nine error states, no gate, the start known to the bit. \"Matched\": 15 error states, a start that is wrong "
      "by what it "
      "believes (0.1 m, 0.05 m/s, 0.3 to 0.6 deg) and biases that it does not know.");
  o.notes.emplace_back(
      "What such a drive can show is little. From a known start the IMU alone is exact to millimetres of height after 2.2 s, "
      "so the height "
      "stays far below 0.20 m at any GNSS rate, and without GNSS: that the bar is met here says nothing about the filter. With "
      "a start in "
      "doubt the largest height error is mostly that of the start, and the document's trend, more fixes are better, shows in "
      "the 3D RMSE. The "
      "minute of city driving below is the drive that needs its fixes.");
  Table table{"Medians over the runs; within 3 sigma: means",
              {{"GNSS", false},
               {"filter", false},
               {"largest error up (m)"},
               {"east (m)"},
               {"north (m)"},
               {"3D RMSE (m)"},
               {"largest yaw error (deg)"},
               {"axes within 3 sigma (%)"},
               {"angles within 3 sigma (%)"}},
              {}};
  std::vector<AtRate> all;
  const int total = 3 * bench.seeds;
  for (const Rate& rate : kRates) {
    all.push_back(run_rate(bench, rate, static_cast<int>(all.size()) * bench.seeds, total, o));
    judge(rate, all.back(), table, o);
  }
  o.tables.push_back({"Rates", "", table});
  o.figures.push_back(
      nees_figure("NEES", "NEES over the runs",
                  {{"document, 25 Hz", &all[0].document},
                   {"document, 50 Hz", &all[1].document},
                   {"document, 100 Hz", &all[2].document},
                   {"matched, 25 Hz", &all[0].matched},
                   {"matched, 50 Hz", &all[1].matched},
                   {"matched, 100 Hz", &all[2].matched}},
                  "Mean over the runs of the squared errors over their claimed covariance, at every instant: 9 states of the "
                  "document's filter, 15 of the matched one. A consistent filter's lies in the band at 95 % of the instants; "
                  "neighbouring instants have the same errors."));
  spike(bench, o);
}

}  // namespace slipstream
