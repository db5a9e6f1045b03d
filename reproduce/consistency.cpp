// Is what the estimators claim of their errors true? NEES and NIS where the model is the plant's, and what they are where it is
// not; and what can be observed at all, for every model (document 002, eqs 5.2-5.5).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/random.hpp"
#include "estimators/observability.hpp"
#include "reproduce/monte_carlo.hpp"

namespace slipstream {
namespace {

struct Case {
  std::string title, scenario, tuning;
  std::vector<std::string> overrides, algorithms, nees_states;
  bool matches;        // the model is the plant's
  std::string reason;  // what differs, where it does
};

// With the model right, the filter's start must be wrong by what it claims: its mean is drawn from its own initial distribution
// around the truth.
void draw_start(Scenario& s, const std::string& tuning, const Played& truth) {
  Tuning& t = s.estimator.tunings.at(tuning);
  for (auto& [state, mean] : t.initial_mean) {
    RandomStream random(s.run.seed, 0, "start." + state);
    mean = truth.truth_of(state).front() + std::sqrt(t.initial_variance.at(state)) * random.normal();
  }
}

void add(const std::string& what, const std::string& index, const Case& c, const Consistency& score, int runs, Table& table,
         Outcome& o) {
  Row row =
      reported("Consistency", fmt::format("mean {}, {}", index, what), "", {score.mean},
               fmt::format("expected {:g}, 95 % band {:.3f} to {:.3f}", score.dimension, score.band.low, score.band.high));
  row.runs = runs;
  row.verdict = score.within                  ? "inside the 95 % band"
                : score.mean < score.band.low ? "below the 95 % band"
                                              : "above the 95 % band";
  if (!c.matches) row.verdict += ": the model does not match the plant, because " + c.reason;
  o.rows.push_back(row);
  table.rows.push_back({what, index, fmt::format("{:.4f}", score.mean), fmt::format("{:g}", score.dimension),
                        fmt::format("{:.3f} to {:.3f}", score.band.low, score.band.high),
                        score.within                  ? "inside"
                        : score.mean < score.band.low ? "below"
                                                      : "above",
                        c.matches ? "yes" : "no: " + c.reason});
}

void consistency(const Bench& bench, const Case& c, int& done, int total, Table& table, Outcome& o) {
  std::vector<Follower> followers;
  for (const std::string& a : c.algorithms) followers.push_back({a, c.tuning, ""});
  std::vector<std::vector<double>> nis(followers.size()), nees(followers.size());
  std::vector<std::vector<int>> nis_dimension(followers.size()), nees_dimension(followers.size());
  over_seeds(bench, done, total, [&](int seed) {
    std::vector<std::string> overrides = c.overrides;
    overrides.push_back(seed_is(seed));
    Scenario s = bench.scenario(c.scenario, overrides);
    if (c.matches) draw_start(s, c.tuning, play(s, {}));
    const Played p = play(s, followers, nullptr, c.nees_states);
    for (std::size_t k = 0; k < followers.size(); ++k) {
      const Track& t = p.tracks[k];
      nis[k].insert(nis[k].end(), t.nis.begin(), t.nis.end());
      nis_dimension[k].insert(nis_dimension[k].end(), t.nis_dimension.begin(), t.nis_dimension.end());
      nees[k].push_back(t.nees.back());  // one value a run: the errors within a run are correlated
      nees_dimension[k].push_back(t.nees_dimension.back());
    }
    return std::vector<double>{};
  });
  done += bench.seeds;
  for (std::size_t k = 0; k < followers.size(); ++k) {
    const std::string what = fmt::format("{}, {}", c.title, followers[k].algorithm);
    add(what, "NIS", c, score_consistency(nis[k], nis_dimension[k]), bench.seeds, table, o);
    add(what, "NEES at the end", c, score_consistency(nees[k], nees_dimension[k]), bench.seeds, table, o);
  }
}

void observability(const Bench& bench, Outcome& o) {
  // Eq. 5.5 with the parameters of Table 5.
  Eigen::MatrixXd a(2, 2), c(2, 2);
  a << -0.01 / 3.2e-3, -0.7 * kGravity_mps2 * 0.033 / 3.2e-3, 0.0, 0.0;
  c << 0.0, kGravity_mps2, 1.0, 0.0;
  const Eigen::MatrixXd matrix = observability_matrix(a, c);
  Table eq{
      "Observability matrix of eq. 5.5, states wheel speed and friction", {{"row", false}, {"wheel speed"}, {"friction"}}, {}};
  constexpr const char* kRows[] = {"a_x", "w", "a_x, once through A", "w, once through A"};
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    eq.rows.push_back({kRows[i], fmt::format("{:.4g}", matrix(i, 0)), fmt::format("{:.4g}", matrix(i, 1))});
  o.tables.push_back({"Eq. 5.5", "", eq});
  o.rows.push_back(met("Eq. 5.5", "rank of the observability matrix", "", Printed("2"), numerical_rank(matrix), 0.0, ""));

  Table table{"Along one second of the true drive, seed 1, tuning matched",
              {{"scenario", false},
               {"model", false},
               {"measured", false},
               {"rank", false},
               {"not observable", false},
               {"left of the start's variance", false}},
              {}};
  for (const auto& [name, from_s] : {std::pair{"unimog", 1.0},
                                     {"unimog_pf", 1.0},
                                     {"snow_variable", 1.0},
                                     {"scale_car", 0.1},
                                     {"scale_car_wheel", 0.1},
                                     {"circle", 2.0},
                                     {"lane_change", 4.0},
                                     {"track", 3.0}}) {
    const Scenario s = bench.scenario(name, {});
    const Played p = play(s, {{"ekf", "matched", ""}});
    const Track& t = p.tracks[0];
    std::vector<std::vector<double>> states, inputs;
    std::vector<std::string> input_names;
    std::visit(
        [&](const auto& m) {
          for (const Quantity& q : m.kInputNames) input_names.emplace_back(q.name);
        },
        s.estimator.process);
    double dt_s = t.t_s[1] - t.t_s[0];
    for (std::size_t row = 0; row < t.t_s.size(); ++row) {
      if (t.t_s[row] < from_s || t.t_s[row] > from_s + kObservabilityWindow_s) continue;
      std::vector<double> x, u;
      for (const std::string& state : t.states) x.push_back(truth_at(p.truth_utime, p.truth_of(state), t.utime[row]));
      for (const std::string& input : input_names) u.push_back(truth_at(p.truth_utime, p.truth_of(input), t.utime[row]));
      states.push_back(x);
      inputs.push_back(u);
    }
    const Observability ob = observability_along(s, s.estimator.tunings.at("matched"), states, inputs, dt_s);
    std::string left;
    for (const auto& state : ob.states)
      left += fmt::format("{}{} {:.2g}", left.empty() ? "" : ", ", state.name, state.variance_ratio);
    table.rows.push_back({name, ob.model, fmt::format("{}", fmt::join(ob.outputs, ", ")),
                          fmt::format("{} of {}", ob.rank, ob.states.size()),
                          ob.observable() ? "-" : fmt::format("{}", fmt::join(ob.unobservable(), ", ")), left});
  }
  o.tables.push_back(
      {"Observability",
       "Rank of the measurements' sensitivities to the state at the start of the second (products of the model's exact "
       "Jacobians), and what the "
       "measurements leave of the variance that the tuning starts with: 1 means that they say nothing about a state. "
       "The eq. 5.5 of the document holds for wheel speed and friction; the speed itself is not in it.",
       table});
}

}  // namespace

void reproduce_consistency(const Bench& bench, Outcome& o) {
  o.notes.emplace_back(
      "NIS: the innovations' squares over their claimed covariance, all steps of all runs; a consistent filter's mean is the "
      "number of "
      "measurements. NEES: the errors' squares over the claimed covariance at the end of each run, its mean the number of "
      "states. Where "
      "the model is the plant's, every start is drawn from the distribution that the filter is told. Heading and position of "
      "the lateral model are not observable and left out of its NEES. A particle filter has no matched case here: no plant of "
      "this document has process noise; its agreement with the Kalman filter is in the tests.");
  const std::vector<std::string> lateral{"lateral_speed_mps", "yaw_rate_radps", "front_stiffness_npr", "rear_stiffness_npr"};
  const std::string wanders = "it lets the friction wander, where in truth torque and tyre decide it";
  const std::vector<Case> cases{
      {"light vehicle, constant friction known to be constant",
       "snow_constant",
       "matched",
       {"plant.input_rate_hz=10000", "tuning.matched.process_variance.friction=0",
        "tuning.matched.process_variance.wheel_speed_radps=0"},
       {"ekf", "mhe"},
       {},
       true,
       ""},
      {"scale car on the circle (NEES of v_y, w_z, C_1, C_2)", "circle", "matched", {}, {"ekf", "mhe"}, lateral, true, ""},
      {"scale car on the track (NEES of v_y, w_z, C_1, C_2)", "track", "matched", {}, {"ekf"}, lateral, true, ""},
      {"Unimog, 5 %", "unimog", "matched", {}, {"ekf", "hierarchical_ekf"}, {}, false, wanders},
      {"Unimog, 5 %, wheel speed only", "unimog_pf", "matched", {}, {"pf", "ekf"}, {}, false, wanders},
      {"light vehicle on a friction step", "snow_step", "matched", {}, {"pf", "ekf"}, {}, false, "a jump is not a random walk"},
      {"scale car on the ground", "scale_car", "matched", {}, {"hierarchical_ekf"}, {}, false, wanders},
      {"scale car, richer plant",
       "scale_car_rich",
       "matched",
       {},
       {"hierarchical_ekf"},
       {},
       false,
       "motor lag, load transfer, bias and delay are in the plant only"},
  };
  Table table{"NEES and NIS over the runs",
              {{"case and algorithm", false},
               {"index", false},
               {"mean"},
               {"expected"},
               {"95 % band", false},
               {"mean is", false},
               {"model matches", false}},
              {}};
  int done = 0;
  const int total = bench.seeds * static_cast<int>(cases.size());
  for (const Case& c : cases) consistency(bench, c, done, total, table, o);
  o.tables.push_back({"Consistency", "", table});
  observability(bench, o);
}

}  // namespace slipstream
