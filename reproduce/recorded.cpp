// Recorded drives of a real 1:10 car (f1tenth_friction) through the estimators of chapters 5 and 6, as far as the recordings
// reach.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "monitor/text.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

void longitudinal(const Bench& bench, Outcome& o) {
  const Scenario s = bench.scenario("f1tenth_ds5a", {});
  const RecordedStreams streams = bench.streams(s, "f1tenth_friction/ds5a");
  const std::vector<Follower> followers{{"ekf", "matched", "EKF"},
                                        {"mhe", "matched", "MHE"},
                                        {"hierarchical_ekf", "matched", "hierarchical EKF"},
                                        {"hierarchical_mhe", "matched", "hierarchical MHE"}};
  const Played p = play(s, followers, &streams);
  const double end_s = p.tracks[0].t_s.back();
  Sketch speed("Drive ds5a, speed", "Speed of a real 1:10 car", end_s);
  speed.panel("speed (m/s)", 340).line("LIDAR pose", p.truth_t_s, p.truth_of("speed_mps"), kMeasuredStyle);
  for (const std::size_t k : {0U, 2U})
    speed.line(p.tracks[k].label, p.tracks[k].t_s, p.tracks[k].of("speed_mps"), line_of(k, 1.4));
  speed.panel("friction (-)", 220).range(-0.8, 0.8);
  for (const std::size_t k : {0U, 2U})
    speed.line(p.tracks[k].label, p.tracks[k].t_s, p.tracks[k].of("friction"), line_of(k, 1.4));
  o.figures.push_back(speed.finish(
      "Drive ds5a of FrictionMaps: wheel speed from the motor, torque from its current, acceleration from the IMU. "
      "The friction coefficient is what the model needs to explain them; nobody knows its truth."));
  const std::string tuned =
      "the scenario's tuning was chosen on this very drive: it shows that a real log works, not how good the estimators are";
  for (std::size_t k = 0; k < followers.size(); ++k) {
    const std::string who = p.tracks[k].label;
    const StateScore v = p.score(k, "speed_mps");
    o.rows.push_back(reported("Drive ds5a", "R2 speed against the LIDAR pose, " + who, "", {v.r2}, tuned));
    o.rows.push_back(reported("Drive ds5a", "RMSE speed against the LIDAR pose, " + who, "m/s", {v.rmse}));
    o.rows.push_back(reported("Drive ds5a", "R2 wheel speed against the measurements, " + who, "",
                              {p.score_measured(k, "wheel_speed_radps").r2}, tuned));
    o.rows.push_back(reported("Drive ds5a", "R2 a_x against the measurements, " + who, "", {p.score_measured(k, "a_x_mps2").r2},
                              "Table 8 has 0.9866 and 0.9731 for another car, drive and sensors"));
  }
}

void lateral(const Bench& bench, Outcome& o) {
  const Scenario s = bench.scenario("f1tenth_ds3", {});
  const RecordedStreams streams = bench.streams(s, "f1tenth_friction/ds3");
  const Played p = play(s, {{"ekf", "matched", "EKF"}}, &streams);
  const Track& t = p.tracks[0];
  std::vector<double> x, y;
  for (const RecordedStream& r : streams.truth) {
    if (r.quantity == "x_m") x = r.value;
    if (r.quantity == "y_m") y = r.value;
  }
  Sketch map = map_sketch("Drive ds3, path", "Path of a real 1:10 car, dead reckoning over two minutes",
                          range_of({x, t.of("x_m")}), range_of({y, t.of("y_m")}), "X (m)", "Y (m)");
  map.line("LIDAR pose", x, y, "with points pt 7 ps 0.2 lc rgb \"#9a9a9a\"")
      .line("EKF", t.of("x_m"), t.of("y_m"), line_of(0, 1.4));
  o.figures.push_back(map.finish(
      "Drive ds3: wheel speed, steering command, yaw rate and lateral acceleration through the bicycle model. Position and "
      "heading are counted on from the start; nothing corrects them, so the drift is that of wheel speed and gyroscope."));
  Sketch c("Drive ds3, stiffness", "Cornering stiffnesses of a real 1:10 car", t.t_s.back());
  for (const auto& [state, label] :
       {std::pair{"front_stiffness_npr", "front (N/rad)"}, {"rear_stiffness_npr", "rear (N/rad)"}}) {
    two_sigma(c.panel(label, 220), "2 sigma", t, state, "#0072B2").line("EKF", t.t_s, t.of(state), line_of(0, 1.5));
  }
  o.figures.push_back(c.finish("Nobody knows the truth; the repository of the data states 150 N/rad per axle."));
  for (const char* output : {"a_y_mps2", "yaw_rate_radps"})
    o.rows.push_back(reported("Drive ds3", fmt::format("R2 {} against the measurements, EKF", readable_name(output)), "",
                              {p.score_measured(0, output).r2}));
  const std::vector<double> ex = p.error(0, "x_m"), ey = p.error(0, "y_m");
  std::vector<double> distance;
  for (std::size_t i = 0; i < ex.size(); ++i)
    if (std::isfinite(ex[i]) && std::isfinite(ey[i])) distance.push_back(std::hypot(ex[i], ey[i]));
  o.rows.push_back(reported("Drive ds3", "distance from the LIDAR pose, median", "m", {percentile(distance, 0.5)},
                            "dead reckoning over 160 m of path"));
  o.rows.push_back(reported("Drive ds3", "distance from the LIDAR pose, at the end", "m", {distance.back()},
                            "the wheel speed is 5 % short of the path, the steering lags, and nothing corrects the position"));
}

}  // namespace

void reproduce_recorded(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "The document's own recordings are not public. These are of another car (FrictionMaps, MIT licence); ds3 has no motor "
      "current, "
      "so there is no torque for the longitudinal model, and it goes through the bicycle model of chapter 6.");
  bench.progress(0, 2);
  longitudinal(bench, o);
  bench.progress(1, 2);
  lateral(bench, o);
  bench.progress(2, 2);
}

}  // namespace slipstream
