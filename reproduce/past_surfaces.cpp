// Past document 002: how much friction a road has, on Table 1's surfaces that change under way, and when that can be known.
#include <fmt/format.h>

#include <algorithm>

#include "models/parts/surface_evidence.hpp"
#include "monitor/text.hpp"
#include "reproduce/monte_carlo.hpp"
#include "reproduce/past.hpp"

namespace slipstream {
namespace {

constexpr const char* kItem = "Available friction";
constexpr double kNoise = 0.05;  // of the wheel speed in both scenarios
constexpr int kSamples = 10;     // 0.1 s of them

// The algorithms that are compared, on the same drives.
const std::vector<Follower> kFollowers{{"imm", "matched", "bank of models (imm)"},
                                       {"ekf", "matched", "single filter (ekf)"},
                                       {"rbpf", "matched", "particles (rbpf)"}};

std::size_t surface_of(double d) {
  for (std::size_t i = 0; i < kSurfaces.size(); ++i)
    if (kSurfaces[i].tyre.d == d) return i;
  return 0;
}

// What an estimate says of the road.
struct Said {
  int surface = -1;  // named; -1: none
  bool covers = false;
};

// A bank of models names the surface whose probability is 0.9 or more; its 95 % interval leaves at most 2.5 % of the
// probability beyond each end. Others name the nearest when their sigma is below half of the least distance of two, 0.09; their
// interval is 1.96 sigma wide.
Said said(const Track& t, std::size_t k, double truth) {
  Said to;
  if (std::find(t.states.begin(), t.states.end(), "probability_dry") != t.states.end()) {
    double below = 0.0, above = 0.0;
    for (std::size_t j = 0; j < kSurfaces.size(); ++j) {
      const double p = t.of("probability_" + std::string(kSurfaces[j].name))[k], d = kSurfaces[j].tyre.d;
      if (p >= 0.9) to.surface = static_cast<int>(j);
      below += d <= truth ? p : 0.0, above += d >= truth ? p : 0.0;
    }
    to.covers = below > 0.025 && above > 0.025;
    return to;
  }
  const double d = t.of("available_friction")[k], sigma = t.sigma_of("available_friction")[k];
  to.covers = std::abs(d - truth) <= 1.96 * sigma;
  if (!(sigma < 0.09)) return to;
  const auto away = [&](std::size_t j) { return std::abs(kSurfaces[j].tyre.d - d); };
  to.surface = 0;
  for (std::size_t j = 1; j < kSurfaces.size(); ++j)
    if (away(j) < away(static_cast<std::size_t>(to.surface))) to.surface = static_cast<int>(j);
  return to;
}

// Of a run. Wrong: another surface is named.
struct Judged {
  double delay_s = 0.0;        // from sufficient evidence to the right name, the longest
  double wrong = 0.0;          // fraction of all time
  double wrong_excited = 0.0;  // fraction of the time from sufficient evidence to the next change; NaN: there is none
  double wrong_settled = 0.0;  // the same without its first 0.3 s
  double covered = 0.0, named = 0.0, sigma = 0.0;
  double excited = 0.0;  // surfaces that showed sufficient evidence

  static constexpr std::size_t kValues = 8;
  // Per cent for fractions; in this order the columns below.
  std::vector<double> values() const {
    return {delay_s, 100.0 * wrong, 100.0 * wrong_excited, 100.0 * wrong_settled, 100.0 * covered, 100.0 * named,
            sigma,   excited};
  }
};
enum Value : std::size_t { kDelay, kWrong, kWrongExcited, kWrongSettled, kCovered, kName, kSigma, kExcited };

std::vector<double> evidence(const Played& p) {
  const std::vector<double>&d = p.truth_of("available_friction"), &slip = p.truth_of("slip"), &mu = p.truth_of("friction");
  std::vector<double> e;
  for (std::size_t k = 0; k < d.size(); ++k) e.push_back(surface_evidence(surface_of(d[k]), slip[k], mu[k], kNoise, kSamples));
  return e;
}

Judged judge(const Played& p, std::size_t follower) {
  constexpr double kAllowed_s = 0.3, kNever_s = 9.99;
  const Track& t = p.tracks[follower];
  const std::vector<double> d = truth_at_all(p.truth_utime, p.truth_of("available_friction"), t.utime),
                            e = truth_at_all(p.truth_utime, evidence(p), t.utime);
  Judged to;
  double excited_s = -1.0, excited = 0.0, settled = 0.0;
  bool seen = false;
  const auto close = [&] {
    if (excited_s < 0.0) return;
    to.excited += 1.0;
    if (!seen) to.delay_s = kNever_s;
  };
  for (std::size_t k = 1; k < t.t_s.size(); ++k) {
    if (d[k] != d[k - 1]) {
      close();
      excited_s = -1.0, seen = false;
    }
    if (excited_s < 0.0 && e[k] >= kSufficientEvidence) excited_s = t.t_s[k];
    const Said s = said(t, k, d[k]);
    const bool right = s.surface == static_cast<int>(surface_of(d[k]));
    const double is_excited = excited_s >= 0.0 ? 1.0 : 0.0;
    const double is_settled = excited_s >= 0.0 && t.t_s[k] > excited_s + kAllowed_s ? 1.0 : 0.0;
    excited += is_excited, settled += is_settled;
    if (s.surface >= 0) to.named += 1.0;
    if (right && excited_s >= 0.0 && !seen) seen = true, to.delay_s = std::max(to.delay_s, t.t_s[k] - excited_s);
    if (s.surface >= 0 && !right) to.wrong += 1.0, to.wrong_excited += is_excited, to.wrong_settled += is_settled;
    to.covered += s.covers ? 1.0 : 0.0;
    to.sigma += t.sigma_of("available_friction")[k];
  }
  close();
  const double n = static_cast<double>(t.t_s.size() - 1);
  to.wrong /= n, to.covered /= n, to.named /= n, to.sigma /= n;
  to.wrong_excited /= excited, to.wrong_settled /= settled;
  return to;
}

void draw(const Played& p, double end_s, const std::string& title, const std::string& caption, Outcome& o) {
  Sketch s(kItem + (end_s > 6.0 ? std::string(", gentle") : ""), title, end_s,
           changes_s(p.truth_t_s, p.truth_of("available_friction")));
  s.panel("friction (-)", 240).line("available, truth", p.truth_t_s, p.truth_of("available_friction"), kTruthStyle);
  s.line("used, truth", p.truth_t_s, p.truth_of("friction"), "with lines lc rgb \"#7f7f7f\" lw 1.2");
  two_sigma(s, "two sigma", p.tracks[0], "available_friction", "#1f77b4");
  s.line(p.tracks[0].label, p.tracks[0].t_s, p.tracks[0].of("available_friction"), line_of(0, 1.6));
  s.line(p.tracks[1].label, p.tracks[1].t_s, p.tracks[1].of("available_friction"), line_of(1, 1.2)).range(-0.1, 1.4);
  s.panel("probability (-)", 200);
  for (std::size_t j = 0; j < kSurfaces.size(); ++j)
    s.line(std::string(kSurfaces[j].name), p.tracks[0].t_s, p.tracks[0].of("probability_" + std::string(kSurfaces[j].name)),
           line_of(j, 1.6));
  s.range(-0.05, 1.05);
  std::vector<double> e = evidence(p);
  for (double& x : e) x = std::clamp(x, 1e-6, 1e5);
  s.panel("evidence E (-)", 160).log_y().line("evidence in 0.1 s", p.truth_t_s, e, "with lines lc rgb \"#000000\" lw 1.2");
  s.level("sufficient", kSufficientEvidence, "with lines lc rgb \"#000000\" lw 1.2 dt (6,4)");
  o.figures.push_back(s.finish(caption));
}

}  // namespace

void reproduce_available_friction(const Bench& bench, Outcome& o) {
  Table table{"Which estimator knows the road",
              {{"drive", false},
               {"estimator", false},
               {"right after, at most (s)"},
               {"wrong, of all time (%)"},
               {"wrong, of the excited time (%)"},
               {"95 % interval contains D (%)"},
               {"named, of the time (%)"},
               {"mean sigma of D"}},
              {}};
  int done = 0;
  const int total = 2 * bench.seeds;
  for (const char* name : {"surfaces", "surfaces_gentle"}) {
    const bool gentle = std::string(name) != "surfaces";
    Played first;
    const auto columns = over_seeds(bench, done, total, [&](int seed) {
      Played p = play(bench.scenario(name, {seed_is(seed)}), kFollowers);
      std::vector<double> values;
      for (std::size_t f = 0; f < kFollowers.size(); ++f) {
        for (const double v : judge(p, f).values()) values.push_back(v);
      }
      if (seed == 1) first = std::move(p);
      return values;
    });
    done += bench.seeds;
    const auto column = [&](Value v, std::size_t f = 0) -> const std::vector<double>& {
      return columns[Judged::kValues * f + v];
    };
    const auto longest_s = [&](std::size_t f) { return *std::max_element(column(kDelay, f).begin(), column(kDelay, f).end()); };
    for (std::size_t f = 0; f < kFollowers.size(); ++f)
      table.rows.push_back({gentle ? "gentle" : "hard", kFollowers[f].label,
                            gentle               ? "-"
                            : longest_s(f) > 9.0 ? "never, in some run"
                                                 : fmt::format("{:.2f}", longest_s(f)),
                            fmt::format("{:.2f}", mean(column(kWrong, f))),
                            gentle ? "-" : fmt::format("{:.2f}", mean(column(kWrongExcited, f))),
                            fmt::format("{:.1f}", mean(column(kCovered, f))), fmt::format("{:.1f}", mean(column(kName, f))),
                            fmt::format("{:.3f}", mean(column(kSigma, f)))});
    const double shown = bench.seeds * mean(column(kExcited));
    if (!gentle) {
      const double all = static_cast<double>(kSurfaces.size()) * bench.seeds;
      o.rows.push_back(reported(kItem, "hard: surfaces with sufficient evidence, of a run", "", column(kExcited),
                                fmt::format("{:.0f} of {:.0f} in all runs: what follows judges {}", shown, all,
                                            shown == all ? "every one" : "these only")));
      o.rows.push_back(reported(kItem, "hard: right surface named after sufficient evidence, bank of models", "s",
                                column(kDelay),
                                fmt::format("of all runs and surfaces {:.2f} s at most; ", longest_s(0)) +
                                    against_bar(0.3, Aim::kLow, longest_s(0))));
      // The mean over the runs is the fraction of all their time: they are equally long.
      const auto wrong = [&](const char* of, Value v, const std::string& definition) {
        o.rows.push_back(reported(kItem, fmt::format("hard: a wrong surface named, {}, bank of models", of), "%", column(v),
                                  fmt::format("{}; mean of the runs {:.2f} %, largest {:.2f} %; ", definition, mean(column(v)),
                                              *std::max_element(column(v).begin(), column(v).end())) +
                                      against_bar(1.0, Aim::kLow, mean(column(v)))));
      };
      wrong("of all time", kWrong,
            "any wrong name (probability 0.9 or more) at any time: mostly the old name between a change of the surface and the "
            "evidence of the new one");
      wrong("of the excited time", kWrongExcited, "any wrong name from sufficient evidence to the next change");
      wrong("of the excited time after 0.3 s", kWrongSettled, "the same without the 0.3 s that naming may take");
    } else {
      o.rows.push_back(reported(kItem, "gentle: surfaces with sufficient evidence, of a run", "", column(kExcited),
                                fmt::format("{:.0f} in all runs: nobody could know", shown)));
      o.rows.push_back(reported(
          kItem, "gentle: a wrong surface named, of all time, bank of models", "%", column(kWrong),
          fmt::format("without evidence a name is a guess at 9 to 1, and the old one stays after a change; mean of the runs "
                      "{:.2f} %, of the {:.1f} % of time that any is named",
                      mean(column(kWrong)), mean(column(kName)))));
    }
    o.rows.push_back(reported(kItem,
                              std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, bank of models", "%",
                              column(kCovered), against_bar(95.0, Aim::kHigh, mean(column(kCovered)))));
    o.rows.push_back(reported(kItem,
                              std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, single filter", "%",
                              column(kCovered, 1), "one Gaussian cannot be at two surfaces at once"));
    o.rows.push_back(reported(
        kItem, std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, particles", "%",
        column(kCovered, 2),
        "draws the stiff wheel and the vehicle's speed, and keeps D in a Kalman filter: few draws fit the accelerometer"));
    draw(first, gentle ? 10.0 : 6.0,
         gentle ? "Gentle driving: what cannot be known" : "Dry, wet, snow, ice under hard acceleration",
         gentle ? "Seed 1; dotted lines: the road changes. At 5 to 9 % of the weight dry and wet road differ by half a per "
                  "mille of slip: both stay "
                  "open, and the interval says so. Evidence is far below what names a surface."
                : "Seed 1; dotted lines: the road changes. When the torque is more than the new surface has, the wheel spins, "
                  "and its surface is "
                  "known within a few samples; afterwards it is believed, with the doubt that it may change every ten seconds.",
         o);
  }
  o.tables.push_back({kItem,
                      fmt::format("Evidence is sufficient from E = {:g} on: the expected log-likelihood ratio of 0.1 s of "
                                  "wheel speed to the nearest other surface "
                                  "(models/parts/surface_evidence.hpp). The bank of models earns its place; the others stay as "
                                  "they are, algorithms for models in general.",
                                  kSufficientEvidence),
                      table});
}

}  // namespace slipstream
