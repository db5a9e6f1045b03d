// Section 7.1: the particle filter on the Unimog, from the wheel speed alone (Figs 41-50).
#include <fmt/format.h>

#include <algorithm>

#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

// Over the seeds, at each value of a swept parameter: RMSE of both states and the time of a run.
struct Sweep {
  std::vector<double> x;
  struct Curve {
    std::vector<double> median, low, high;
    void add(const std::vector<double>& values) {
      median.push_back(slipstream::median(values));
      low.push_back(percentile(values, 0.05));
      high.push_back(percentile(values, 0.95));
    }
  } friction, wheel_speed, time_s;
};

std::vector<double> scores(const Played& p) {
  return {p.score(0, "friction").rmse, p.score(0, "wheel_speed_radps").rmse, total_s(p.tracks[0])};
}

template <typename Change>
Sweep sweep(const Bench& bench, const std::vector<double>& x, const Change& change, int& done, int total) {
  Sweep s;
  s.x = x;
  for (const double value : x) {
    const auto columns = over_seeds(bench, done, total, [&](int seed) {
      Scenario scenario = bench.scenario("unimog_pf", {seed_is(seed)});
      change(scenario.estimator.tunings.at("document"), value);
      return scores(play(scenario, {{"pf", "document", ""}}));
    });
    done += bench.seeds;
    s.friction.add(columns[0]);
    s.wheel_speed.add(columns[1]);
    s.time_s.add(columns[2]);
  }
  return s;
}

Picture swept(const std::string& item, const std::string& title, const std::string& x_label, const std::string& y_label,
              const Sweep& s, const Sweep::Curve& c, double chosen, const std::string& caption) {
  return Sketch(item, title, x_label, {0.0, 1.03 * s.x.back()})
      .panel(y_label, 320)
      .log_y()
      .band("5 to 95 % of the runs", s.x, c.low, c.high, "#0072B2")
      .line("median", s.x, c.median, dots_of(0))
      .line("choice of the document", {chosen, chosen},
            {*std::min_element(c.low.begin(), c.low.end()), *std::max_element(c.high.begin(), c.high.end())},
            "with lines lc rgb \"#999999\" lw 1.4 dt (8,4)")
      .finish(caption);
}

}  // namespace

void reproduce_unimog_particles(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "A random-walk step of s is read as uniform within ±s, a variance of s²/3; the other reading, a standard deviation, has "
      "a row of its own.");
  const std::vector<double> counts{1, 2, 3, 5, 7, 10, 15, 20, 30, 40, 50, 60, 75, 100, 125, 150};
  std::vector<double> steps;
  for (int i = 1; i <= 20; ++i) steps.push_back(0.001 * i);
  const int total = static_cast<int>(counts.size() + steps.size() + 2) * bench.seeds;
  int done = 0;
  const Sweep by_count = sweep(
      bench, counts, [](Tuning& t, double n) { t.pf_particles = static_cast<int>(n); }, done, total);
  const Sweep by_step = sweep(
      bench, steps, [](Tuning& t, double s) { t.process_variance["friction"] = s * s / 3.0; }, done, total);

  o.figures.push_back(swept("Fig. 42", "Computing time by particles", "particles", "time of the run (s)", by_count,
                            by_count.time_s, 50.0, "Proportional to the number of particles, above a constant part."));
  o.figures.push_back(swept("Fig. 43", "RMSE of the friction by particles", "particles", "RMSE friction (-)", by_count,
                            by_count.friction, 50.0,
                            "Few particles are lucky or not, so the spread matters as much as the median; "
                            "beyond some 50 there is nothing to gain."));
  o.figures.push_back(swept("Fig. 44", "RMSE of the wheel speed by particles", "particles", "RMSE wheel speed (rad/s)",
                            by_count, by_count.wheel_speed, 50.0, "As Fig. 43."));
  o.figures.push_back(swept("Fig. 45", "RMSE of the friction by random-walk step", "random-walk step (-)", "RMSE friction (-)",
                            by_step, by_step.friction, 0.006,
                            "Too small a step cannot follow the gear changes, too large a one follows the noise. A step of s "
                            "is read as uniform within ±s."));
  o.figures.push_back(swept("Fig. 46", "RMSE of the wheel speed by random-walk step", "random-walk step (-)",
                            "RMSE wheel speed (rad/s)", by_step, by_step.wheel_speed, 0.006,
                            "The wheel speed prefers a larger step than the friction, as in the document."));

  const Played p = play(bench.scenario("unimog_pf", {}), {{"pf", "document", "particle filter"}, {"pf", "matched", "matched"}});
  const std::vector<double> shifts = changes_s(p.truth_t_s, p.truth_of("gear"));
  const Series& z = p.measured.at("wheel_speed_radps");
  o.figures.push_back(
      Sketch("Fig. 41", "Measured wheel speed", 10.0)
          .panel("wheel speed (rad/s)", 320)
          .line("measured", z.t_s, z.value, kMeasuredStyle)
          .line("truth", p.truth_t_s, p.truth_of("wheel_speed_radps"), kTruthStyle)
          .finish("5 % of the value: the document does not print its noise here; it is that of its section 7.2."));
  const Track& t = p.tracks[0];
  const std::size_t mu = t.index("friction");
  o.figures.push_back(Sketch("Fig. 47", "Friction, 50 particles", 10.0, shifts)
                          .panel("friction (-)", 340)
                          .range(0.0, 0.3)
                          .band("99 % interval", t.t_s, t.interval_low[mu], t.interval_high[mu], "#D55E00")
                          .line("truth", p.truth_t_s, p.truth_of("friction"), kTruthStyle)
                          .line("particle filter", t.t_s, t.of("friction"), line_of(0, 1.5))
                          .line("1000 particles, matched", p.tracks[1].t_s, p.tracks[1].of("friction"), line_of(2, 1.2))
                          .finish("Steps within ±0.006, first guess 0.2. Dotted lines: gear changes. Seed 1."));
  o.figures.push_back(Sketch("Fig. 48", "Wheel speed, 50 particles", 10.0, shifts)
                          .panel("wheel speed (rad/s)", 340)
                          .line("measured", z.t_s, z.value, kMeasuredStyle)
                          .line("truth", p.truth_t_s, p.truth_of("wheel_speed_radps"), kTruthStyle)
                          .line("particle filter", t.t_s, t.of("wheel_speed_radps"), line_of(0, 1.5))
                          .finish("From the wheel speed alone; the torque is known."));
  for (const auto& [item, state, label] : {std::tuple{"Fig. 49", "friction", "|error| friction (-)"},
                                           {"Fig. 50", "wheel_speed_radps", "|error| wheel speed (rad/s)"}})
    o.figures.push_back(
        Sketch(item, std::string("Absolute error of the ") + (state == std::string("friction") ? "friction" : "wheel speed"),
               10.0, shifts)
            .panel(label, 320)
            .line("particle filter", t.t_s, absolute(p.error(0, state)), line_of(0, 1.4))
            .line("1000 particles, matched", p.tracks[1].t_s, absolute(p.error(1, state)), line_of(2, 1.2))
            .finish("Seed 1; dotted lines: gear changes."));

  const auto columns = over_seeds(bench, done, total, [&](int seed) {
    Scenario scenario = bench.scenario("unimog_pf", {seed_is(seed)});
    Tuning& deviation = scenario.estimator.tunings["deviation"] = scenario.estimator.tunings.at("document");
    deviation.process_variance["friction"] = 0.006 * 0.006;
    const Played r = play(scenario, {{"pf", "document", ""}, {"pf", "matched", ""}, {"pf", "deviation", ""}});
    std::vector<double> values = scores(r);
    values.push_back(r.score(1, "friction").rmse);
    values.push_back(r.score(1, "wheel_speed_radps").rmse);
    values.push_back(r.score(2, "friction").rmse);
    return values;
  });
  bench.progress(total, total);
  const std::string unknown = "the document prints neither the noise of the wheel speed nor the filter's start";
  o.rows.push_back(
      judged("Fig. 49", "RMSE friction, 50 particles, step 0.006", "", Printed("0.01"), Aim::kLow, columns[0], unknown));
  o.rows.push_back(judged("Fig. 50", "RMSE wheel speed, 50 particles, step 0.006", "rad/s", Printed("0.51"), Aim::kLow,
                          columns[1], unknown));
  o.rows.push_back(
      judged("Fig. 47", "computing time of the run", "s", Printed("0.153"), Aim::kLow, columns[2], kOurStepTakesLonger));
  o.rows.push_back(reported("Fig. 49", "RMSE friction, 1000 particles, matched", "", columns[3]));
  o.rows.push_back(reported("Fig. 50", "RMSE wheel speed, 1000 particles, matched", "rad/s", columns[4]));
  o.rows.push_back(judged("Fig. 49", "RMSE friction, 50 particles, a standard deviation of 0.006", "", Printed("0.01"),
                          Aim::kLow, columns[5], unknown));
  const auto worst = [](const Sweep& s, const std::vector<double>& c, double from, double to) {
    double w = 0.0;
    for (std::size_t i = 0; i < s.x.size(); ++i)
      if (s.x[i] >= from - 1e-9 && s.x[i] <= to + 1e-9) w = std::max(w, c[i]);
    return w;
  };
  o.rows.push_back(judged("Fig. 45", "largest RMSE friction for steps of 0.003 to 0.007 (medians)", "", Printed("0.011"),
                          Aim::kLow, {worst(by_step, by_step.friction.median, 0.003, 0.007)}, unknown));
  o.rows.push_back(judged("Fig. 46", "largest RMSE wheel speed for steps of 0.006 to 0.013 (medians)", "rad/s", Printed("0.51"),
                          Aim::kLow, {worst(by_step, by_step.wheel_speed.median, 0.006, 0.013)}, unknown));
}

}  // namespace slipstream
