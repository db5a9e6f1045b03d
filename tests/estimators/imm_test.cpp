// The bank of models: exact where there is nothing but the regime, which friction is available on a road that changes, and what
// cannot be known.
#include "estimators/imm.hpp"

#include <gtest/gtest.h>

#include "common/random.hpp"
#include "io/scenario_reader.hpp"
#include "models/parts/surface_evidence.hpp"
#include "tests/support/in_process.hpp"

namespace slipstream::test {
namespace {

// One of three levels, measured with noise: a hidden Markov chain, whose filter is exact.
struct Levels {
  static constexpr std::string_view kName = "levels";
  static constexpr int kStates = 1, kInputs = 1, kOutputs = 1;
  static constexpr std::array<Quantity, 1> kStateNames{{{"level", "1"}}}, kInputNames{{{"u", "1"}}}, kOutputNames{{{"z", "1"}}};
  static constexpr std::array<bool, 1> kLinear{true};
  static constexpr int kRegimeState = 0;
  static constexpr std::array<Quantity, 3> kRegimeNames{{{"p_1", "1"}, {"p_2", "1"}, {"p_5", "1"}}};
  static constexpr double kRegimeVariance = 0.25;
  static constexpr std::array<double, 3> kValue{1.0, 2.0, 5.0};
  static double regime_value(std::size_t i) { return kValue[i]; }
  double regime_rate_hz = 0.7;
  template <typename T>
  Vector<T, 1> derivative(const Vector<T, 1>&, const Vector<double, 1>&) const {
    return Vector<T, 1>(T(0.0));
  }
  template <typename T>
  Vector<T, 1> output(const Vector<T, 1>& x, const Vector<double, 1>&) const {
    return x;
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, 1>&) const {
    return T(0.0);
  }
  bool start_from(int, double, Vector<double, 1>&) const { return false; }
};
static_assert(SwitchingModel<Levels>);

// The forward recursion of a hidden Markov model, worked out here: p ~ (Pi' p) o N(z; level, sigma^2).
TEST(Imm, IsTheForwardFilterOfAHiddenMarkovChain) {
  constexpr double kSigma = 1.3, kDt = 0.5;
  Belief<Levels> belief;
  belief.noise[0] = {0.0, kSigma};
  belief.initial_variance[0] = 1.0;
  Imm<Levels> imm(belief);
  imm.start_given();
  std::array<double, 3> p{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};
  RandomStream random(1, 0, "imm test");
  const double stay = std::exp(-0.7 * kDt), leave = (1.0 - stay) / 2.0;
  for (int k = 0; k < 40; ++k) {
    const double z = (k < 20 ? 2.0 : 5.0) + 3.0 * (random.uniform() - 0.5), u = 0.0, dt = k == 0 ? 0.0 : kDt;
    imm.step({dt, {&u, 1}, {&z, 1}, 1U});
    std::array<double, 3> next{};
    double sum = 0.0;
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) next[j] += (k == 0 ? (i == j ? 1.0 : 0.0) : i == j ? stay : leave) * p[i];
      const double off = (z - Levels::kValue[j]) / kSigma;
      sum += next[j] *= std::exp(-0.5 * off * off);
    }
    double mean = 0.0, square = 0.0;
    const Posterior out = imm.posterior();
    ASSERT_EQ(out.mean.size(), 4U);
    for (std::size_t j = 0; j < 3; ++j) {
      p[j] = next[j] / sum;
      EXPECT_NEAR(out.mean[1 + j], p[j], 1e-12) << k;  // rounding of 40 products
      mean += p[j] * Levels::kValue[j];
      square += p[j] * Levels::kValue[j] * Levels::kValue[j];
    }
    EXPECT_NEAR(out.mean[0], mean, 1e-11);
    EXPECT_NEAR(out.covariance[0], square - mean * mean + 0.25, 1e-10);  // and what is left open of a level
    // Cov(level, "it is 5") = p (5 - mean); Var("it is 5") = p (1 - p).
    EXPECT_NEAR(out.covariance[3], p[2] * (5.0 - mean), 1e-11);
    EXPECT_NEAR(out.covariance[15], p[2] * (1.0 - p[2]), 1e-12);
    EXPECT_EQ(out.status, EstimateStatus::kValid);
  }
}

// A measurement that the third level cannot give: sqrt(3 - level) is not a number there.
struct RootedLevels : Levels {
  template <typename T>
  Vector<T, 1> output(const Vector<T, 1>& x, const Vector<double, 1>&) const {
    using std::sqrt;
    return Vector<T, 1>(sqrt(T(3.0) - x[0]));
  }
};

// The forward recursion again, with the likelihood 0 of the level that has none.
TEST(Imm, LeavesOutARegimeWhoseUpdateIsNotFinite) {
  constexpr double kSigma = 0.8, kDt = 0.5;
  Belief<RootedLevels> belief;
  belief.noise[0] = {0.0, kSigma};
  belief.initial_variance[0] = 1.0;
  Imm<RootedLevels> imm(belief);
  imm.start_given();
  std::array<double, 3> p{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};
  const double stay = std::exp(-0.7 * kDt), leave = (1.0 - stay) / 2.0, u = 0.0;
  for (int k = 0; k < 20; ++k) {
    const double z = k % 3 == 0 ? 1.6 : 0.9, dt = k == 0 ? 0.0 : kDt;
    imm.step({dt, {&u, 1}, {&z, 1}, 1U});
    std::array<double, 3> next{};
    for (std::size_t j = 0; j < 2; ++j) {
      for (std::size_t i = 0; i < 3; ++i) next[j] += (k == 0 ? (i == j ? 1.0 : 0.0) : i == j ? stay : leave) * p[i];
      const double off = (z - std::sqrt(3.0 - Levels::kValue[j])) / kSigma;
      next[j] *= std::exp(-0.5 * off * off);
    }
    const Posterior out = imm.posterior();
    EXPECT_EQ(out.status, EstimateStatus::kFallback) << k;
    for (std::size_t j = 0; j < 3; ++j) {
      p[j] = next[j] / (next[0] + next[1]);
      EXPECT_NEAR(out.mean[1 + j], p[j], 1e-12) << k;  // rounding of 20 products; the least probability is 1e-30
    }
    EXPECT_NEAR(out.mean[0], p[0] * 1.0 + p[1] * 2.0, 1e-12);
    for (const double c : out.covariance) EXPECT_TRUE(std::isfinite(c)) << k;
    EXPECT_TRUE(std::isfinite(out.innovation[0]) && out.innovation_covariance[0] > 0.0) << k;
  }
}

// A wheel speed whose square is beyond the range of numbers has no likelihood: the step is one without a measurement.
TEST(Imm, KeepsThePredictionWhereNoRegimeHasALikelihood) {
  const Scenario scenario = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/surfaces.toml").scenario;
  const std::unique_ptr<Estimator> imm = make_estimator("imm", scenario, "matched");
  const std::unique_ptr<Estimator> unmeasured = make_estimator("imm", scenario, "matched");
  imm->start_given(), unmeasured->start_given();
  const double torque_nm = 2000.0;
  for (int k = 0; k < 30; ++k) {
    const bool absurd = k >= 10 && k < 13;
    const std::array<double, 2> z{absurd ? 1e200 : 10.0 + 0.03 * k, 1.5};
    const double dt_s = k == 0 ? 0.0 : 0.01;
    imm->step({dt_s, {&torque_nm, 1}, z, 3U});
    unmeasured->step({dt_s, {&torque_nm, 1}, z, absurd ? 0U : 3U});
    const Posterior p = imm->posterior(), q = unmeasured->posterior();
    EXPECT_EQ(p.status, absurd ? EstimateStatus::kFallback : EstimateStatus::kValid) << k;
    EXPECT_EQ(q.status, EstimateStatus::kValid) << k;
    for (std::size_t i = 0; i < p.mean.size(); ++i) EXPECT_NEAR(p.mean[i], q.mean[i], 1e-9) << k;  // rounding of the weights
  }
}

TEST(Imm, RefusesAModelWithoutRegimes) {
  const Scenario unimog = load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/unimog.toml").scenario;
  try {
    make_estimator("imm", unimog, "matched");
    FAIL() << "not refused";
  } catch (const Refusal& refusal) {
    EXPECT_STREQ(refusal.what(), "imm: works on model tyre_friction only; the scenario's is longitudinal_friction");
  }
}

// --- Available friction ---------------------------------------------------------------------------------------------------

std::size_t surface_of(double d) {
  for (std::size_t i = 0; i < kSurfaces.size(); ++i)
    if (kSurfaces[i].tyre.d == d) return i;
  throw Refusal("no surface has this peak");
}

struct Naming {
  double worst_delay_s = 0.0;  // from sufficient excitation to the right name, of all surfaces and runs
  double worst_after_s = 0.0;  // from a change of the surface to the right name
  double wrong = 0.0;          // fraction of all time that another surface is named
  double wrong_excited = 0.0;  // fraction of the time from sufficient excitation to the next change that one is
  double wrong_settled = 0.0;  // the same without its first 0.3 s
  double covered = 0.0;        // fraction of time that the 95 % interval of D contains it
  double named = 0.0;          // fraction of time that any surface is
  double sigma = 0.0;          // mean
  int excited = 0;             // surfaces that were
  int not_named = 0;           // of these, never named right
};

// A surface is named when its probability is 0.9 or more. The 95 % interval: the values of D with at most 2.5 % of the
// probability beyond.
Naming naming(const Scenario& given, int seeds) {
  constexpr double kNamed = 0.9, kTail = 0.025, kAllowed_s = 0.3, kStep_s = 0.01;
  Scenario scenario = given;
  Naming to;
  double total = 0.0, excited = 0.0, settled = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    scenario.run.seed = static_cast<std::uint64_t>(seed);
    const Played p = play(scenario, "imm", "matched");
    const std::vector<double> d = p.truth_of("available_friction"), slip = p.truth_of("slip"), mu = p.truth_of("friction");
    double changed_s = 0.0, excited_s = -1.0;
    bool seen = false;
    const auto close = [&] { to.excited += excited_s >= 0.0 ? 1 : 0, to.not_named += excited_s >= 0.0 && !seen ? 1 : 0; };
    for (std::size_t k = 1; k < p.estimates.size(); ++k) {
      const double t = kStep_s * static_cast<double>(k);
      const std::size_t truth = surface_of(d[k]);
      if (d[k] != d[k - 1]) {
        close();
        changed_s = t, excited_s = -1.0, seen = false;
      }
      if (excited_s < 0.0 && surface_evidence(truth, slip[k], mu[k], 0.05, 10) >= kSufficientEvidence) excited_s = t;
      const bool is_excited = excited_s >= 0.0, is_settled = is_excited && t > excited_s + kAllowed_s;
      const std::vector<double>& mean = p.estimates[k].mean;
      double below = 0.0, above = 0.0;
      for (std::size_t j = 0; j < kSurfaces.size(); ++j) {
        if (kSurfaces[j].tyre.d <= d[k]) below += mean[3 + j];
        if (kSurfaces[j].tyre.d >= d[k]) above += mean[3 + j];
        if (mean[3 + j] < kNamed) continue;
        to.named += 1.0;
        if (j == truth && is_excited && !seen) {
          seen = true;
          to.worst_delay_s = std::max(to.worst_delay_s, t - excited_s);
          to.worst_after_s = std::max(to.worst_after_s, t - changed_s);
        }
        if (j == truth) continue;
        to.wrong += 1.0;
        to.wrong_excited += is_excited ? 1.0 : 0.0;
        to.wrong_settled += is_settled ? 1.0 : 0.0;
      }
      to.covered += below > kTail && above > kTail ? 1.0 : 0.0;
      to.sigma += std::sqrt(p.estimates[k].covariance[2 * mean.size() + 2]);
      total += 1.0, excited += is_excited ? 1.0 : 0.0, settled += is_settled ? 1.0 : 0.0;
    }
    close();
    EXPECT_EQ(p.fallbacks(), 0U);
  }
  to.wrong /= total, to.wrong_excited /= std::max(excited, 1.0), to.wrong_settled /= std::max(settled, 1.0);
  to.covered /= total, to.named /= total, to.sigma /= total;
  std::printf(
      "%s: right %.2f s after evidence and %.2f s after a change at most, wrong %.4f of all time, %.4f of excited, %.4f "
      "of settled, excited %d (%.3f of time), never %d, covered %.4f, named %.3f, sigma of D %.3f\n",
      given.name.c_str(), to.worst_delay_s, to.worst_after_s, to.wrong, to.wrong_excited, to.wrong_settled, to.excited,
      excited / total, to.not_named, to.covered, to.named, to.sigma);
  return to;
}

Scenario shipped_scenario(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml", overrides).scenario;
}

// The bars: named within 0.3 s of sufficient excitation, wrong less than 1 % of the time; every surface of every run counts,
// and every wrong name: of the whole drive (the old name stays until the new surface has shown itself), and of its excited
// part.
TEST(AvailableFriction, IsKnownWhenTheWheelShowsIt) {
  constexpr int kSeeds = 20;
  const Naming n = naming(shipped_scenario("surfaces"), kSeeds);
  EXPECT_EQ(n.excited, 4 * kSeeds);
  EXPECT_EQ(n.not_named, 0);
  EXPECT_LE(n.worst_delay_s, 0.3);
  EXPECT_LT(n.wrong, 0.01);
  EXPECT_LT(n.wrong_excited, 0.01);
  EXPECT_EQ(n.wrong_settled, 0.0);
  EXPECT_GE(n.covered, 0.95);
}

// The bar: the 95 % interval contains the truth at least 95 % of the time. On dry road and wet the two stay open: half of their
// distance, 0.09, is the least sigma of who does not know. Nothing shows the surface, so a name is a guess at 9 to 1 and may be
// wrong one time in ten.
TEST(AvailableFriction, StaysOpenWhenTheWheelShowsNothing) {
  const Naming changing = naming(shipped_scenario("surfaces_gentle"), 20);
  EXPECT_EQ(changing.excited, 0);
  EXPECT_GE(changing.covered, 0.95);
  EXPECT_LE(changing.wrong, 0.1 * changing.named);
  for (const char* surface : {"dry", "wet", "snow", "ice"}) {
    const Naming n = naming(shipped_scenario("surfaces_gentle", {std::string("vehicle.surface=") + surface,
                                                                 "vehicle.surface_time_s=[]", "vehicle.surfaces=[]"}),
                            5);
    EXPECT_GE(n.covered, 0.95) << surface;
    if (std::string_view(surface) == "dry") {
      EXPECT_GE(n.sigma, 0.09);
      EXPECT_LE(n.named, 0.1);
    }
  }
}

}  // namespace
}  // namespace slipstream::test
