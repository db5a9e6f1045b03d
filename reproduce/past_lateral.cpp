// Past chapter 6: tyre parameters that respond, on a car with nonlinear tyres, load transfer, roll and combined slip, against
// the linear bicycle filter of the document; and the same filters on a recorded race car.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/random.hpp"
#include "reproduce/monte_carlo.hpp"
#include "reproduce/past.hpp"

namespace slipstream {
namespace {

constexpr double kDegrees = 180.0 / kPi;
const std::vector<std::string> kScored{"lateral_speed_mps", "yaw_rate_radps", "front_cornering_prad", "rear_cornering_prad",
                                       "friction"};

// atan2(v_y, v_x) of an estimate, with the true v_x, and the truth's; degrees.
struct Sideslip {
  std::vector<double> estimate, truth;
  double rmse() const { return score_state(truth, estimate).rmse; }
};
Sideslip sideslip_deg(const Played& p, const Track& t) {
  Sideslip s;
  s.estimate = t.of("lateral_speed_mps");
  const std::vector<double> v_x = truth_at_all(p.truth_utime, p.truth_of("forward_speed_mps"), t.utime);
  s.truth = truth_at_all(p.truth_utime, p.truth_of("sideslip_rad"), t.utime);
  for (std::size_t i = 0; i < v_x.size(); ++i) {
    s.estimate[i] = kDegrees * std::atan2(s.estimate[i], v_x[i]);
    s.truth[i] *= kDegrees;
  }
  return s;
}

std::size_t row_after(const Track& t, double t_s) {
  return static_cast<std::size_t>(std::lower_bound(t.t_s.begin(), t.t_s.end(), t_s) - t.t_s.begin());
}

// Distance of a state from its truth at a row, by the truth, in per cent.
double off_percent(const Played& p, const Track& t, const std::string& state, std::size_t row) {
  const double truth = truth_at(p.truth_utime, p.truth_of(state), t.utime[row]);
  return 100.0 * std::abs(t.of(state)[row] / truth - 1.0);
}

// A tuning's initial mean, drawn from its own initial distribution.
void draw_start(Scenario& s, const std::string& tuning) {
  Tuning& t = s.estimator.tunings.at(tuning);
  for (auto& [state, mean] : t.initial_mean)
    mean += std::sqrt(t.initial_variance.at(state)) * RandomStream(s.run.seed, 0, "start." + state).normal();
}

Row barred(Row row, double bar, Aim aim) {
  row.verdict = against_bar(bar, aim, row.ours);
  return row;
}

void consistency_row(const std::string& item, const std::string& what, const std::vector<double>& nees, Outcome& o) {
  const Consistency c = score_consistency(nees, static_cast<int>(kScored.size()));
  Row row =
      reported(item, "NEES " + what + ", EKF", "", {c.mean},
               fmt::format("of v_y, w_z, both cornering coefficients and friction: 5 expected, 95 % band {:.2f} to {:.2f}",
                           c.band.low, c.band.high));
  row.runs = static_cast<int>(nees.size());
  row.verdict = c.within ? "inside the 95 % band" : c.mean < c.band.low ? "below the 95 % band" : "above the 95 % band";
  o.rows.push_back(row);
}

Sketch& parameter_panel(Sketch& s, const Played& p, const std::vector<const Track*>& tracks, const std::string& state,
                        const std::string& label, Band range) {
  two_sigma(s.panel(label, 220).range(range.low, range.high), "EKF, 2 sigma", *tracks.front(), state, "#0072B2");
  s.line("truth", p.truth_t_s, p.truth_of(state), kTruthStyle);
  for (std::size_t k = 0; k < tracks.size(); ++k)
    s.line(tracks[k]->label, tracks[k]->t_s, tracks[k]->of(state), line_of(k, 1.5));
  return s;
}

struct Manoeuvre {
  std::string item, title, scenario;
  double after_bend_s;         // the steering is straight again after the first bend
  Band coefficient, friction;  // axes
};

void manoeuvre(const Bench& bench, const Manoeuvre& m, Outcome& o) {
  std::vector<double> nees_run, nees_end;
  Played first;
  const auto columns = over_seeds(bench, 0, bench.seeds, [&](int seed) {
    Scenario s = bench.scenario(m.scenario, {seed_is(seed)});
    const Scenario linear = bench.scenario(m.scenario + "_linear", {seed_is(seed)});
    Scenario drawn = s;
    draw_start(drawn, "matched");
    Played p = play(s,
                    {{"ekf", "wrong_start", "EKF"},
                     {"ukf", "wrong_start", "UKF"},
                     {"ekf", "matched", "EKF, drawn start", &drawn},
                     {"ekf", "matched", "linear bicycle", &linear},
                     {"ekf", "fixed", "linear bicycle, fixed", &linear}},
                    nullptr, kScored);
    const std::size_t row = row_after(p.tracks[0], m.after_bend_s), last = p.tracks[0].t_s.size() - 1;
    std::vector<double> values;
    for (const std::size_t k : {0U, 2U, 1U}) {
      values.push_back(off_percent(p, p.tracks[k], "front_cornering_prad", row));
      values.push_back(off_percent(p, p.tracks[k], "rear_cornering_prad", row));
      values.push_back(off_percent(p, p.tracks[k], "friction", last));
    }
    for (const Track& t : p.tracks) values.push_back(sideslip_deg(p, t).rmse());
    nees_run.push_back(mean(p.tracks[2].nees));
    nees_end.push_back(p.tracks[2].nees.back());
    if (seed == 1) first = std::move(p);
    return values;
  });
  const char* const who[] = {"EKF from a wrong start", "EKF from drawn starts", "UKF from a wrong start"};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 2; ++i)
      o.rows.push_back(barred(
          reported(m.item,
                   fmt::format("error of the {} cornering stiffness after one bend, {}", i == 0 ? "front" : "rear", who[k]),
                   "%", columns[3 * k + i], "the document's estimates hardly responded"),
          10.0, Aim::kLow));
    o.rows.push_back(reported(m.item, fmt::format("error of the friction at the end, {}", who[k]), "%", columns[3 * k + 2]));
  }
  // Beside the better of the two linear filters.
  const std::vector<double>&matched = columns[12], &fixed = columns[13];
  const std::vector<double>& theirs = median(matched) < median(fixed) ? matched : fixed;
  const char* const names[] = {"EKF from a wrong start", "UKF from a wrong start", "EKF from drawn starts"};
  for (std::size_t k = 0; k < 3; ++k) {
    Row row = judged(m.item, fmt::format("sideslip RMSE, {}", names[k]), "deg", Printed(median(theirs), 0.0), Aim::kLow,
                     columns[9 + k], "the linear filter knows the slopes");
    row.verdict +=
        "; " + against_bar(0.5, Aim::kLow, median(columns[9 + k]) / median(theirs)) + " (a fraction of the linear filter's)";
    row.note = "beside it: the better linear bicycle filter, which starts with the true slopes, on the same readings";
    o.rows.push_back(row);
  }
  o.rows.push_back(reported(m.item, "sideslip RMSE, linear bicycle filter with stiffnesses that walk", "deg", matched));
  o.rows.push_back(reported(m.item, "sideslip RMSE, linear bicycle filter with the true slopes, fixed", "deg", fixed));
  consistency_row(m.item, "along the run, from drawn starts", nees_run, o);
  consistency_row(m.item, "at the end, from drawn starts", nees_end, o);

  const std::vector<const Track*> ours{&first.tracks[0], &first.tracks[1]};
  Sketch tyres(m.item + ", tyres", m.title + ": what becomes known of the tyres", first.truth_t_s.back());
  parameter_panel(tyres, first, ours, "front_cornering_prad", "front (1/rad)", m.coefficient);
  parameter_panel(tyres, first, ours, "rear_cornering_prad", "rear (1/rad)", m.coefficient);
  parameter_panel(tyres, first, ours, "friction", "friction", m.friction);
  o.figures.push_back(tyres.finish(
      "Cornering coefficients (slope of an axle's force by its load) and friction, from a first guess that is too high. The "
      "slopes are seen with the "
      "first bend; friction only where the tyres yield, and until then its band stays as wide as it was believed. Seed 1."));
  Sketch slip(m.item + ", sideslip", m.title + ": sideslip", first.truth_t_s.back());
  slip.panel("sideslip (deg)", 320);
  for (const std::size_t k : {0U, 3U, 4U})
    slip.line(first.tracks[k].label, first.tracks[k].t_s, sideslip_deg(first, first.tracks[k]).estimate, line_of(k, 1.4));
  const Sideslip truth = sideslip_deg(first, first.tracks[0]);
  slip.line("truth", first.tracks[0].t_s, truth.truth, kTruthStyle);
  slip.panel("friction used", 160).range(0.0, 1.0).line("truth", first.truth_t_s, first.truth_of("friction_used"), kTruthStyle);
  o.figures.push_back(
      slip.finish("The linear filter takes a yielding tyre for a soft one, or for one that slips less than it does. Seed 1."));
}

// Gentle steering tells the slopes, but not the friction.
void unexcited(const Bench& bench, Outcome& o) {
  std::vector<double> nees_end;
  Played first;
  const auto columns = over_seeds(bench, 0, bench.seeds, [&](int seed) {
    Scenario s = bench.scenario("slalom_gentle", {seed_is(seed)});
    draw_start(s, "matched");
    Played p = play(s, {{"ekf", "matched", "EKF"}}, nullptr, kScored);
    const Track& t = p.tracks[0];
    nees_end.push_back(t.nees.back());
    const std::size_t row = row_after(t, 2.1);
    const Tuning& tuning = s.estimator.tunings.at("matched");
    const double start = std::sqrt(tuning.initial_variance.at("friction"));
    std::vector<double> values{t.sigma_of("friction").back() / start,
                               std::abs(t.of("friction").back() - tuning.initial_mean.at("friction")) / start,
                               off_percent(p, t, "front_cornering_prad", row), off_percent(p, t, "rear_cornering_prad", row)};
    if (seed == 1) first = std::move(p);
    return values;
  });
  o.rows.push_back(reported("Slalom", "gentle steering: deviation of the friction at the end, of the start's", "", columns[0],
                            "1: nothing was learnt, and the filter says so"));
  o.rows.push_back(reported("Slalom", "gentle steering: how far the friction has moved, in deviations of the start", "",
                            columns[1], "0: it does not drift"));
  for (std::size_t i = 0; i < 2; ++i)
    o.rows.push_back(barred(reported("Slalom",
                                     fmt::format("gentle steering: error of the {} cornering stiffness after one bend, EKF",
                                                 i == 0 ? "front" : "rear"),
                                     "%", columns[2 + i]),
                            10.0, Aim::kLow));
  consistency_row("Slalom", "at the end, gentle steering, drawn starts", nees_end, o);
  Sketch s("Slalom, gentle", "A fifth of the steering: friction that cannot be known", first.truth_t_s.back());
  const std::vector<const Track*> ours{&first.tracks[0]};
  parameter_panel(s, first, ours, "front_cornering_prad", "front (1/rad)", {0.0, 25.0});
  parameter_panel(s, first, ours, "friction", "friction", {0.4, 1.4});
  o.figures.push_back(s.finish("1.3 m/s²: the tyres slip by 0.4 degrees and do not yield. Seed 1."));
}

}  // namespace

void reproduce_lateral_track(const Bench& bench, Outcome& o) {
  manoeuvre(bench, {"Lateral track", "Standard track", "track_tyres", 2.0, {2.0, 12.0}, {0.3, 1.3}}, o);
}

void reproduce_slalom(const Bench& bench, Outcome& o) {
  manoeuvre(bench, {"Slalom", "Slalom", "slalom", 2.1, {5.0, 25.0}, {0.5, 1.5}}, o);
  unexcited(bench, o);
}

void reproduce_race_car(const Bench& bench, Outcome& o) {
  constexpr const char* kItem = "Race car";
  const Scenario s = bench.scenario("race_car", {}), linear = bench.scenario("race_car_linear", {});
  const RecordedStreams streams = bench.streams(s, "revs_250lm_a");
  const Played p = play(s,
                        {{"ekf", "matched", "EKF, nonlinear tyres"},
                         {"ukf", "matched", "UKF, nonlinear tyres"},
                         {"ekf", "adaptive", "EKF, tyres left to it"},
                         {"ekf", "fixed", "linear, fitted to 60 s", &linear},
                         {"ekf", "readme", "linear, fitted to all", &linear},
                         {"ekf", "repository", "linear, repository", &linear}},
                        &streams);
  const std::string note =
      "0.46 is what a linear single-track Kalman filter attains with stiffnesses that fit this drive, as the README beside the "
      "data says; ours were "
      "chosen on the first 60 s of 275 s";
  for (const Track& t : p.tracks) {
    const Sideslip b = sideslip_deg(p, t);
    Row row =
        judged(kItem, "sideslip RMSE, " + t.label, "deg", Printed("0.46"), Aim::kLow, {b.rmse()}, "see the scenario", note);
    row.verdict = against_bar(0.46, Aim::kLow, b.rmse());
    o.rows.push_back(row);
    const std::size_t from = row_after(t, 60.0);
    const auto later = [&](const std::vector<double>& v) {
      return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(from), v.end());
    };
    o.rows.push_back(reported(kItem, "sideslip RMSE after the first 60 s, " + t.label, "deg",
                              {Sideslip{later(b.estimate), later(b.truth)}.rmse()}));
  }
  const Sideslip b = sideslip_deg(p, p.tracks[0]);
  o.rows.push_back(reported(kItem, "sideslip RMSE, answer zero", "deg",
                            {Sideslip{std::vector<double>(b.truth.size(), 0.0), b.truth}.rmse()}, "the README says 1.43"));
  Sketch slip("Race car, sideslip", "Sideslip of a race car at the limit", p.tracks[0].t_s.back(), {60.0});
  slip.panel("sideslip (deg)", 360).line("GNSS and INS", p.tracks[0].t_s, b.truth, kMeasuredStyle);
  for (const std::size_t k : {0U, 3U})
    slip.line(p.tracks[k].label, p.tracks[k].t_s, sideslip_deg(p, p.tracks[k]).estimate, line_of(k, 1.2));
  o.figures.push_back(
      slip.finish("A Ferrari 250 LM, Targa Sixty-Six 2014. Everything was chosen on what is left of the mark at 60 s."));
}

}  // namespace slipstream
