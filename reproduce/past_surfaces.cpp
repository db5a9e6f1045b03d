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

// Of a run, in the order of the table.
struct Judged {
  double delay_s = 0.0, wrong = 0.0, covered = 0.0, named = 0.0, sigma = 0.0;
};

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
  double excited_s = -1.0;
  bool seen = false;
  const auto close = [&] {
    if (excited_s >= 0.0 && !seen) to.delay_s = kNever_s;
  };
  for (std::size_t k = 1; k < t.t_s.size(); ++k) {
    if (d[k] != d[k - 1]) {
      close();
      excited_s = -1.0, seen = false;
    }
    if (excited_s < 0.0 && e[k] >= kSufficientEvidence) excited_s = t.t_s[k];
    const Said s = said(t, k, d[k]);
    const bool right = s.surface == static_cast<int>(surface_of(d[k]));
    if (s.surface >= 0) to.named += 1.0;
    if (right && excited_s >= 0.0 && !seen) seen = true, to.delay_s = std::max(to.delay_s, t.t_s[k] - excited_s);
    if (s.surface >= 0 && !right && excited_s >= 0.0 && t.t_s[k] > excited_s + kAllowed_s) to.wrong += 1.0;
    to.covered += s.covers ? 1.0 : 0.0;
    to.sigma += t.sigma_of("available_friction")[k];
  }
  close();
  const double n = static_cast<double>(t.t_s.size() - 1);
  to.wrong /= n, to.covered /= n, to.named /= n, to.sigma /= n;
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
               {"wrong, of the time (%)"},
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
        const Judged j = judge(p, f);
        for (const double v : {j.delay_s, 100.0 * j.wrong, 100.0 * j.covered, 100.0 * j.named, j.sigma}) values.push_back(v);
      }
      if (seed == 1) first = std::move(p);
      return values;
    });
    done += bench.seeds;
    for (std::size_t f = 0; f < kFollowers.size(); ++f) {
      const auto column = [&](std::size_t i) -> const std::vector<double>& { return columns[5 * f + i]; };
      const double delay_s = *std::max_element(column(0).begin(), column(0).end());
      table.rows.push_back({gentle ? "gentle" : "hard", kFollowers[f].label,
                            gentle          ? "-"
                            : delay_s > 9.0 ? "never, in some run"
                                            : fmt::format("{:.2f}", delay_s),
                            fmt::format("{:.2f}", mean(column(1))), fmt::format("{:.1f}", mean(column(2))),
                            fmt::format("{:.1f}", mean(column(3))), fmt::format("{:.3f}", mean(column(4)))});
    }
    const double delay_s = *std::max_element(columns[0].begin(), columns[0].end());
    if (!gentle) {
      o.rows.push_back(
          reported(kItem, "hard: right surface named after sufficient evidence, bank of models", "s", columns[0],
                   fmt::format("of all runs and surfaces {:.2f} s at most; ", delay_s) + against_bar(0.3, Aim::kLow, delay_s)));
      o.rows.push_back(reported(kItem, "hard: a wrong surface named, bank of models", "%", columns[1],
                                against_bar(1.0, Aim::kLow, mean(columns[1]))));
    }
    o.rows.push_back(reported(kItem,
                              std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, bank of models", "%",
                              columns[2], against_bar(95.0, Aim::kHigh, mean(columns[2]))));
    o.rows.push_back(reported(kItem,
                              std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, single filter", "%",
                              columns[7], "one Gaussian cannot be at two surfaces at once"));
    o.rows.push_back(reported(
        kItem, std::string(gentle ? "gentle" : "hard") + ": 95 % interval of D contains it, particles", "%", columns[12],
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
