// Chapter 6: lateral dynamics of the scale car in three manoeuvres (Figs 26-35, Tables 10-12).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "models/vehicles/bicycle.hpp"
#include "monitor/text.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

constexpr const char* kOutputs[] = {"a_y_mps2", "yaw_rate_radps"};
const std::vector<Follower> kFollowers{{"ekf", "document", "EKF"},
                                       {"mhe", "document", "MHE"},
                                       {"ekf", "matched", "EKF matched"},
                                       {"mhe", "matched", "MHE matched"}};
constexpr std::size_t kDrawn[] = {0, 1, 2};

// What a perfect estimate gets when it is scored against measurements: 1 - SS(noise) / SS(measurements).
double limit_r2(const Played& p, const std::string& output) {
  const Series& z = p.measured.at(output);
  std::vector<Utime> at;
  for (const double t : z.t_s) at.push_back(utime_of(t));
  return score_state(z.value, truth_at_all(p.truth_utime, p.truth_of(output), at)).r2;
}

// Distance from the true position at the end.
double end_error_m(const Played& p, std::size_t k) { return std::hypot(p.error(k, "x_m").back(), p.error(k, "y_m").back()); }

Picture output_figure(const std::string& item, const std::string& title, const std::string& label, const Played& p,
                      std::size_t output) {
  Sketch s(item, title, p.truth_t_s.back());
  const Series& z = p.measured.at(kOutputs[output]);
  const Band range = range_of({z.value});
  s.panel(label, 320).range(range.low, range.high).line("measured", z.t_s, z.value, kMeasuredStyle);
  for (const std::size_t k : kDrawn) s.line(p.tracks[k].label, p.tracks[k].t_s, p.tracks[k].output[output], line_of(k, 1.4));
  s.line("truth", p.truth_t_s, p.truth_of(kOutputs[output]), "with lines lc rgb \"#000000\" lw 1.2 dt (3,3)");
  return s.finish(
      "Estimates are h(x^) after the update. With the document's P = Q = R the EKF's lie on the measurements, noise included. "
      "Seed 1.");
}

Picture trajectory(const std::string& item, const std::string& title, const Played& p, const std::string& caption) {
  std::vector<std::vector<double>> xs{p.truth_of("x_m")}, ys{p.truth_of("y_m")};
  for (const std::size_t k : kDrawn) xs.push_back(p.tracks[k].of("x_m")), ys.push_back(p.tracks[k].of("y_m"));
  Sketch s = map_sketch(item, title, range_of(xs), range_of(ys), "X (m)", "Y (m)");
  s.line("truth", xs[0], ys[0], kTruthStyle);
  for (std::size_t i = 0; i < std::size(kDrawn); ++i)
    s.line(p.tracks[kDrawn[i]].label, xs[i + 1], ys[i + 1], line_of(kDrawn[i], 1.4));
  return s.finish(caption + " Curves that cannot be told apart coincide. World frame, one scale for both axes. Seed 1.");
}

struct Scored {
  Played first;
  std::vector<std::vector<double>> columns;
  std::vector<double> of(std::size_t follower, std::size_t value) const { return columns[2 + kValues * follower + value]; }
  static constexpr std::size_t kValues = 8;  // R2 measured (2), R2 truth (2), end error, C1, C2, mean step in ms
};

Scored run(const Bench& bench, const std::string& scenario) {
  Scored s;
  s.columns = over_seeds(bench, 0, bench.seeds, [&](int seed) {
    Played p = play(bench.scenario(scenario, {seed_is(seed)}), kFollowers);
    std::vector<double> values{limit_r2(p, kOutputs[0]), limit_r2(p, kOutputs[1])};
    for (std::size_t k = 0; k < kFollowers.size(); ++k) {
      for (const char* output : kOutputs) values.push_back(p.score_measured(k, output).r2);
      for (const char* output : kOutputs) values.push_back(p.score_output(k, output).r2);
      values.push_back(end_error_m(p, k));
      values.push_back(p.tracks[k].of("front_stiffness_npr").back());
      values.push_back(p.tracks[k].of("rear_stiffness_npr").back());
      values.push_back(1e-3 * mean(p.tracks[k].step_time_us));
    }
    if (seed == 1) s.first = std::move(p);
    return values;
  });
  return s;
}

// Tables 11 and 12.
void score_table(const std::string& item, const Scored& s, const std::map<std::string, std::array<const char*, 2>>& printed,
                 Outcome& o) {
  Table table{"R2 against the measurements, as the document scores, and against the truth; in brackets the document's; medians",
              {{"estimator", false},
               {"tuning", false},
               {"a_y, measured"},
               {"w_z, measured"},
               {"a_y, truth"},
               {"w_z, truth"},
               {"end error (m)"},
               {"mean step (ms)"}},
              {}};
  for (std::size_t k = 0; k < kFollowers.size(); ++k) {
    const Follower& f = kFollowers[k];
    const std::string who = f.algorithm == "ekf" ? "EKF" : "MHE";
    std::vector<std::string> cells{who, f.tuning};
    for (std::size_t i = 0; i < 2; ++i) {
      const char* const published = printed.at(f.algorithm)[i];
      o.rows.push_back(judged(
          item, fmt::format("R2 {} against the measurements, {}, {} tuning", readable_name(kOutputs[i]), who, f.tuning), "",
          Printed(published), Aim::kHigh, s.of(k, i),
          fmt::format("the truth itself only gets {:.4f}: with this noise, more means to copy the noise", median(s.columns[i])),
          "plant and noise are ours"));
      cells.push_back(fmt::format("{:.4f} ({})", median(s.of(k, i)), published));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      o.rows.push_back(
          reported(item, fmt::format("R2 {} against the truth, {}, {} tuning", readable_name(kOutputs[i]), who, f.tuning), "",
                   s.of(k, 2 + i)));
      cells.push_back(fmt::format("{:.4f}", median(s.of(k, 2 + i))));
    }
    o.rows.push_back(reported(item, fmt::format("position error at the end, {}, {} tuning", who, f.tuning), "m", s.of(k, 4)));
    cells.push_back(fmt::format("{:.3f}", median(s.of(k, 4))));
    cells.push_back(fmt::format("{:.3f}", median(s.of(k, 7))));
    table.rows.push_back(cells);
  }
  for (std::size_t i = 0; i < 2; ++i)
    o.rows.push_back(reported(item,
                              fmt::format("R2 {} against the measurements, of the truth itself", readable_name(kOutputs[i])),
                              "", s.columns[i], "what lies above copies noise"));
  o.tables.push_back({item,
                      "The document had no truth. An estimator that copies the measurements scores 1 in its columns; the "
                      "columns beside them tell "
                      "how near it is to what the car did. The true stiffnesses are the first guess and the start is known: "
                      "millimetres at the end "
                      "are what a right model gives, not what to expect of a car.",
                      table});
}

}  // namespace

void reproduce_circle(const Bench& bench, Outcome& o) {
  const Scored s = run(bench, "circle");
  o.figures.push_back(output_figure("Fig. 26", "Lateral acceleration on the circle", "a_y (m/s²)", s.first, 0));
  o.figures.push_back(output_figure("Fig. 27", "Yaw rate on the circle", "w_z (rad/s)", s.first, 1));
  o.figures.push_back(trajectory(
      "Fig. 28", "Path on the circle", s.first,
      "Three laps. Heading and position are not observable, they are counted on from the start; with the right model all "
      "estimates "
      "stay with the truth. The laps of the document's estimates were not concentric, which it puts down to understeer and a "
      "larger steering angle in the model."));
  score_table("Table 11", s, {{"ekf", {"0.9999", "0.9949"}}, {"mhe", {"0.9470", "0.9825"}}}, o);
  const Scenario scenario = bench.scenario("circle", {});
  const SingleTrack& t = std::get<Bicycle>(scenario.plant.vehicle).track;
  add_parameters(o, "Table 10", "Parameters of the bicycle model", "",
                 {{"mass", "2.8", t.mass_kg, "kg"},
                  {"wheel radius", "0.033", t.wheel_radius_m, "m"},
                  {"front axle a1", "0.134", t.front_axle_m, "m"},
                  {"rear axle a2", "0.122", t.rear_axle_m, "m"},
                  {"yaw inertia", "0.2", t.yaw_inertia_kgm2, "kg m²"}});
}

void reproduce_lane_change(const Bench& bench, Outcome& o) {
  const Scored s = run(bench, "lane_change");
  const Played& p = s.first;
  o.figures.push_back(output_figure("Fig. 29", "Lateral acceleration in the lane change", "a_y (m/s²)", p, 0));
  o.figures.push_back(output_figure("Fig. 30", "Yaw rate in the lane change", "w_z (rad/s)", p, 1));
  // 4.4 m by 0.06 m: not in one scale.
  Sketch path("Fig. 31", "Path in the lane change", "X (m)", {0.0, 4.6});
  path.panel("Y (m)", 320).line("truth", p.truth_of("x_m"), p.truth_of("y_m"), kTruthStyle);
  for (const std::size_t k : kDrawn)
    path.line(p.tracks[k].label, p.tracks[k].of("x_m"), p.tracks[k].of("y_m"), line_of(k, 1.4));
  path.range(-0.03, 0.12);
  o.figures.push_back(path.finish("World frame; the axes have different scales. Seed 1."));
  Sketch stiffness("Fig. 32", "Cornering stiffnesses in the lane change", p.truth_t_s.back());
  for (const auto& [state, label] :
       {std::pair{"front_stiffness_npr", "front (N/rad)"}, {"rear_stiffness_npr", "rear (N/rad)"}}) {
    two_sigma(stiffness.panel(label, 240).range(0.0, 12.0), "EKF matched, 2 sigma", p.tracks[2], state, "#009E73");
    stiffness.line("truth", p.truth_t_s, p.truth_of(state), kTruthStyle);
    for (const std::size_t k : kDrawn)
      stiffness.line(p.tracks[k].label, p.tracks[k].t_s, p.tracks[k].of(state), line_of(k, 1.5));
  }
  o.figures.push_back(stiffness.finish(
      "The true values are 5 and 6, the first guess 4. The MHE with the document's weights stays at the guess, as the document "
      "reports: S and V leave it nothing to learn from. The matched EKF finds them as soon as the tyres slip, "
      "and says before that it does not know."));
  for (std::size_t k = 0; k < kFollowers.size(); ++k) {
    const std::string who =
        fmt::format("{}, {} tuning", kFollowers[k].algorithm == "ekf" ? "EKF" : "MHE", kFollowers[k].tuning);
    o.rows.push_back(reported("Fig. 31", "position error at the end, " + who, "m", s.of(k, 4)));
    o.rows.push_back(reported("Fig. 32", "front stiffness at the end, " + who, "N/rad", s.of(k, 5), "truth 5, first guess 4"));
    o.rows.push_back(reported("Fig. 32", "rear stiffness at the end, " + who, "N/rad", s.of(k, 6), "truth 6, first guess 4"));
  }
}

void reproduce_track(const Bench& bench, Outcome& o) {
  const Scored s = run(bench, "track");
  o.figures.push_back(output_figure("Fig. 33", "Lateral acceleration on the standard track", "a_y (m/s²)", s.first, 0));
  o.figures.push_back(output_figure("Fig. 34", "Yaw rate on the standard track", "w_z (rad/s)", s.first, 1));
  o.figures.push_back(trajectory("Fig. 35", "Path on the standard track", s.first,
                                 "One lap that starts in a curve and ends on a straight, inside 4.8 m by 2.8 m."));
  score_table("Table 12", s, {{"ekf", {"0.9914", "0.9990"}}, {"mhe", {"0.9571", "0.9964"}}}, o);
}

}  // namespace slipstream
