// Past document 002, chapter 7: friction of the Unimog when the estimator knows that torque drives it, on the level, up an
// unknown hill, with an unknown load, braking.
#include <fmt/format.h>

#include <algorithm>

#include "monitor/text.hpp"
#include "reproduce/monte_carlo.hpp"
#include "reproduce/past.hpp"

namespace slipstream {
namespace {

constexpr const char* kTorque = "Torque and friction";
constexpr const char* kHill = "Hill and load";
constexpr double kStartFriction = 0.114;  // from 0.1 s to 0.5 s, in third gear

// What a run says of the friction at the places where the document's estimators err.
struct Transients {
  double at_steps = 0.0;  // largest |error| over its own sigma within 5 samples of a step of the torque
  double start = 0.0;     // largest |error| from 0.1 s to 0.5 s
};

Transients transients(const Played& p, std::size_t k) {
  constexpr double kStep_nm = 100.0;  // from sample to sample; within a gear some 10 N m
  const std::vector<double> error = p.error(k, "friction"), &sigma = p.tracks[k].sigma_of("friction"), &t = p.tracks[k].t_s;
  const std::vector<double> torque = truth_at_all(p.truth_utime, p.truth_of("drive_torque_nm"), p.tracks[k].utime);
  Transients to;
  for (std::size_t i = 0; i < error.size(); ++i) {
    if (t[i] > 0.095 && t[i] < 0.505) to.start = std::max(to.start, std::abs(error[i]));
    for (std::size_t j = i > 5 ? i - 4 : 2; j <= i; ++j)
      if (std::abs(torque[j] - torque[j - 1]) > kStep_nm) to.at_steps = std::max(to.at_steps, std::abs(error[i]) / sigma[i]);
  }
  return to;
}

struct Columns {
  std::vector<double> r2, steps, start, nees;
};

// What the estimator is told, and whether it listens.
struct Told {
  double torque_scale = 1.0;
  bool sensors = true;  // false: it believes their noise to be ten thousand times what they measure
};

// Over the bench's seeds; the first run goes to `first`.
Columns over_runs(const Bench& bench, const std::string& scenario, const Follower& follower, Played& first, int& done,
                  int total, const Told& told = {}) {
  constexpr double kDeaf = 1e4;
  const auto scaled = [&](Reading& r) {
    if (r.quantity == "drive_torque_nm") r.value = r.value.scalar() * told.torque_scale;
    return true;
  };
  const auto columns = over_seeds(bench, done, total, [&](int seed) {
    const Scenario played = bench.scenario(scenario, {seed_is(seed)});
    Scenario believed = played;
    if (!told.sensors)
      for (SensorConfig& s : believed.sensors) s.noise = {kDeaf, 0.0};
    Follower listening = follower;
    listening.belief = &believed;
    Played p = play(played, {listening}, nullptr, {}, scaled);
    const Transients seen = transients(p, 0);
    std::vector<double> values{p.score(0, "friction").r2, seen.at_steps, seen.start,
                               consistency_ratio(p.tracks[0].nees, p.tracks[0].nees_dimension)};
    if (seed == 1) first = std::move(p);
    return values;
  });
  done += bench.seeds;
  return {columns[0], columns[1], columns[2], columns[3]};
}

std::vector<std::string> cells(const std::string& what, const std::string& estimator, const Columns& c) {
  return {what,
          estimator,
          fmt::format("{:.5f}", median(c.r2)),
          fmt::format("{:.2f}", *std::max_element(c.steps.begin(), c.steps.end())),
          fmt::format("{:.4f}", *std::max_element(c.start.begin(), c.start.end())),
          fmt::format("{:.2f}", median(c.nees))};
}

const std::vector<Table::Column> kColumns{{"case", false},
                                          {"model", false},
                                          {"R2 friction, median"},
                                          {"error at torque steps, in its own sigma, largest of all runs"},
                                          {"error from 0.1 to 0.5 s, largest of all runs"},
                                          {"mean NEES / dimension, median"}};

constexpr const char* kNees =
    "below 1 is cautious: a gear change falls between two samples, nobody knows where, and sigma must cover a friction that "
    "has "
    "not settled at the sample";

// R2 of friction at 5 % noise with the torque told right and the sensors believed.
struct ToldRight {
  double follows = 0.0, wanders = 0.0;
};

// What the sensors add to the torque, and what becomes of an estimate that is told a wrong one.
void add_wrong_torque(const Bench& bench, const ToldRight& right, int& done, int total, Table& table, Outcome& o) {
  struct Case {
    bool follows;
    Told told;
    const char *what, *note;
  };
  for (const Case& c :
       {Case{true, {1.0, false}, "torque alone", "the same filter, deaf to its sensors"},
        Case{true, {1.05, false}, "torque alone, told 5 % too much", "deaf and told wrong"},
        Case{true,
             {1.05, true},
             "torque told 5 % too much",
             "its process noise knows of no such error: the model holds friction near what the torque demands"},
        Case{false, {1.05, true}, "torque told 5 % too much", "friction that wanders goes by the accelerometer"}}) {
    const char* const model = c.follows ? "torque_friction" : "longitudinal_friction";
    Played first;
    const Columns columns =
        over_runs(bench, c.follows ? "unimog_torque" : "unimog", {"ekf", "matched", ""}, first, done, total, c.told);
    table.rows.push_back(cells(fmt::format("5 % noise, {}", c.what), fmt::format("EKF, {}", model), columns));
    o.rows.push_back(
        reported(kTorque, fmt::format("R2 friction, EKF, {}, 5 % noise, {}", model, c.what), "", columns.r2,
                 fmt::format("{}; believing its sensors and told right it attains {:.5f}; mean NEES / 3 is {:.1f}, "
                             "above 1 it is surer than it may be",
                             c.note, c.follows ? right.follows : right.wanders, median(columns.nees))));
  }
}

}  // namespace

void reproduce_unimog_torque(const Bench& bench, Outcome& o) {
  Table table{"Friction that follows the torque beside friction that wanders", kColumns, {}};
  int done = 0;
  const int total = (6 + 4) * bench.seeds;
  ToldRight right;
  struct Case {
    const char *wandering, *torque, *printed_ekf, *printed_mhe;
    int percent;
    double bar;
  };
  for (const Case& c : {Case{"unimog", "unimog_torque", "0.9639", "0.9712", 5, 0.998},
                        Case{"unimog_10", "unimog_torque_10", "0.8590", "0.9452", 10, 0.995}}) {
    Played wandering, torque, sigma_points;
    const Columns before = over_runs(bench, c.wandering, {"ekf", "matched", "friction wanders"}, wandering, done, total);
    const Columns ours = over_runs(bench, c.torque, {"ekf", "matched", "friction follows torque"}, torque, done, total);
    const Columns ukf = over_runs(bench, c.torque, {"ukf", "matched", ""}, sigma_points, done, total);
    const std::string noise = fmt::format("{} % noise", c.percent);
    table.rows.push_back(cells(noise, "EKF, longitudinal_friction", before));
    table.rows.push_back(cells(noise, "EKF, torque_friction", ours));
    table.rows.push_back(cells(noise, "UKF, torque_friction", ukf));
    o.rows.push_back(judged(kTorque, "R2 friction, EKF, " + noise, "", Printed(c.printed_ekf), Aim::kHigh, ours.r2, "",
                            "document: Table 16, EKF; " + against_bar(c.bar, Aim::kHigh, median(ours.r2)) +
                                fmt::format("; with a wandering friction we attain {:.4f}", median(before.r2))));
    o.rows.push_back(
        judged(kTorque, "R2 friction, UKF, " + noise, "", Printed(c.printed_mhe), Aim::kHigh, ukf.r2, "",
               "document: Table 16, its better estimator, the MHE; " + against_bar(c.bar, Aim::kHigh, median(ukf.r2))));
    const double worst = *std::max_element(ours.steps.begin(), ours.steps.end());
    o.rows.push_back(reported(
        kTorque, "largest error at a gear change, in its own sigma, EKF, " + noise, "", ours.steps,
        "the document notes peaks there. Of all runs " + fmt::format("{:.2f}; ", worst) + against_bar(3.0, Aim::kLow, worst)));
    const double latest = *std::max_element(ours.start.begin(), ours.start.end());
    o.rows.push_back(reported(
        kTorque, "largest error of friction from 0.1 to 0.5 s, EKF, " + noise, "", ours.start,
        fmt::format("the transient of the start; the friction is {:g}, of which 5 % are allowed. Of all runs {:.4f}; {}; "
                    "with a wandering one {:.4f}",
                    kStartFriction, latest, against_bar(0.05 * kStartFriction, Aim::kLow, latest), median(before.start))));
    o.rows.push_back(reported(kTorque, "mean NEES / 3, EKF, " + noise, "", ours.nees, kNees));
    if (c.percent == 5) right = {median(ours.r2), median(before.r2)};
    if (c.percent == 10) {
      Sketch s(kTorque, "Friction of the Unimog, 10 % noise", 10.0, changes_s(torque.truth_t_s, torque.truth_of("gear")));
      s.panel("friction (-)", 300).line("truth", torque.truth_t_s, torque.truth_of("friction"), kTruthStyle);
      s.line("friction wanders", wandering.tracks[0].t_s, wandering.tracks[0].of("friction"), line_of(0, 1.5));
      s.line("friction follows torque", torque.tracks[0].t_s, torque.tracks[0].of("friction"), line_of(1, 1.5))
          .range(-0.02, 0.22);
      s.panel("|error| (-)", 220).log_y();
      const auto floored = [](std::vector<double> e) {
        for (double& x : e) x = std::max(std::abs(x), 1e-6);
        return e;
      };
      s.line("friction wanders", wandering.tracks[0].t_s, floored(wandering.error(0, "friction")), line_of(0, 1.4));
      s.line("friction follows torque", torque.tracks[0].t_s, floored(torque.error(0, "friction")), line_of(1, 1.4));
      std::vector<double> three = torque.tracks[0].sigma_of("friction");
      for (double& x : three) x *= 3.0;
      s.line("3 sigma of the latter", torque.tracks[0].t_s, three, "with lines lc rgb \"#000000\" lw 1.2 dt (6,4)");
      o.figures.push_back(
          s.finish("Seed 1; dotted lines: gear changes. An estimator that knows the torque needs no time to follow them, and "
                   "its first estimate after the start is right. Both know the same torque and the same sensors."));
    }
  }
  add_wrong_torque(bench, right, done, total, table, o);
  o.tables.push_back(
      {kTorque,
       "Both models are told the torque at the wheel, mass and rolling resistance; the one knows what torque does "
       "to a rolling wheel (models/parts/rolling_wheel.hpp), the other lets friction wander.",
       table});
}

void reproduce_unimog_grade(const Bench& bench, Outcome& o) {
  Table table{"Grade and mass unknown", kColumns, {}};
  int done = 0;
  const int total = 2 * bench.seeds;
  Played hill, load;
  const Columns up = over_runs(bench, "unimog_grade", {"ekf", "matched", "EKF"}, hill, done, total);
  const Columns loaded = over_runs(bench, "unimog_load", {"ekf", "matched", "EKF"}, load, done, total);
  table.rows.push_back(cells("5 % hill, mass known", "EKF, torque_friction_load", up));
  table.rows.push_back(cells("5 % hill, 600 kg more than believed, braking", "EKF, torque_friction_load", loaded));
  constexpr const char* kLevel = "document: Table 16, EKF, on the level with everything known; ";
  o.rows.push_back(judged(kHill, "R2 friction, unknown hill of 5 %, 5 % noise", "", Printed("0.9639"), Aim::kHigh, up.r2, "",
                          kLevel + against_bar(0.99, Aim::kHigh, median(up.r2))));
  o.rows.push_back(judged(kHill, "R2 friction, unknown hill and load, braking, 5 % noise", "", Printed("0.9639"), Aim::kHigh,
                          loaded.r2, "",
                          std::string(kLevel) + "braking widens the range of the friction, which makes R2 easier"));
  for (const auto& [name, c] : {std::pair<const char*, const Columns&>{"hill", up}, {"hill and load", loaded}}) {
    const double worst = *std::max_element(c.steps.begin(), c.steps.end());
    o.rows.push_back(reported(kHill, fmt::format("largest error at a step of the torque, in its own sigma, {}", name), "",
                              c.steps, fmt::format("of all runs {:.2f}; ", worst) + against_bar(3.0, Aim::kLow, worst)));
    o.rows.push_back(reported(kHill, fmt::format("mean NEES / 5, {}", name), "", c.nees,
                              "the grade's error lasts for seconds: a run has few independent ones"));
  }
  o.rows.push_back(reported(kHill, "mass at the end of the run, seed 1", "kg", {load.tracks[0].of("mass_kg").back()},
                            fmt::format("truth 2600, believed at first 2000 +- 500; its own sigma at the end {:.1f}",
                                        load.tracks[0].sigma_of("mass_kg").back())));
  Sketch s(kHill, "Unknown hill, unknown load, braking; 5 % noise", 10.0, changes_s(load.truth_t_s, load.truth_of("gear")));
  const Track& t = load.tracks[0];
  const auto with_truth = [&](const std::string& state, const std::string& label, int height) {
    s.panel(label, height).line("truth", load.truth_t_s, load.truth_of(state), kTruthStyle);
    two_sigma(s, "two sigma", t, state, "#1f77b4");
    s.line("EKF", t.t_s, t.of(state), line_of(0, 1.5));
  };
  with_truth("friction", "friction (-)", 260);
  with_truth("grade", "grade (-)", 220);
  with_truth("mass_kg", "mass (kg)", 220);
  s.range(1500.0, 3000.0);
  o.figures.push_back(
      s.finish("Seed 1. The accelerometer shows the friction whatever the mass, the torque that it takes shows the mass within "
               "tenths of a second, and the wheel speed against the accelerometer shows the hill, seconds later."));
  o.tables.push_back({kHill, "The accelerometer feels the slope it stands on: it measures v' + g sin a.", table});
}

}  // namespace slipstream
