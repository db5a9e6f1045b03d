// Real-time iteration against solutions that have nothing in common with it: quadratic programs of small random windows by
// trying every set of active bounds on dense matrices, the Kalman filter, and hand-made conditions of optimality.
//
// SLIPSTREAM_RTI_WINDOWS: how many random windows, if more are wanted than the suite has time for.
#include "estimators/rti.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>

#include "common/random.hpp"
#include "estimators/ekf.hpp"
#include "models/processes/lateral_bicycle.hpp"
#include "models/processes/longitudinal_friction.hpp"
#include "models/processes/point_mass_motion.hpp"
#include "models/processes/wheel_friction.hpp"
#include "tests/estimators/linear_model.hpp"

namespace slipstream::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr RtiSettings kToConvergence{50, 1e-8, 1e-6};

// x' = A x + b u, z = H x with any numbers; its Runge-Kutta step is exp to the fourth order.
struct AnyLinear {
  static constexpr std::string_view kName = "any_linear";
  static constexpr int kStates = 2, kInputs = 1, kOutputs = 2;
  static constexpr std::array<Quantity, 2> kStateNames{{{"x_m", "m"}, {"y_m", "m"}}};
  static constexpr std::array<Quantity, 1> kInputNames{{{"u", "1"}}};
  static constexpr std::array<Quantity, 2> kOutputNames{{{"z_m", "m"}, {"s_m", "m"}}};
  static constexpr bool kInputsOfAnyScalar = true;
  static constexpr std::array<bool, kStates> kLinear{true, true};

  Eigen::Matrix2d a = Eigen::Matrix2d::Zero(), h = Eigen::Matrix2d::Identity();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();

  template <typename T, typename U>
  Vector<T, 2> derivative(const Vector<T, 2>& x, const Vector<U, 1>& u) const {
    return {a(0, 0) * x[0] + a(0, 1) * x[1] + b[0] * u[0], a(1, 0) * x[0] + a(1, 1) * x[1] + b[1] * u[0]};
  }
  template <typename T, typename U>
  Vector<T, 2> output(const Vector<T, 2>& x, const Vector<U, 1>&) const {
    return {h(0, 0) * x[0] + h(0, 1) * x[1], h(1, 0) * x[0] + h(1, 1) * x[1]};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, 2>&) const {
    return T(0.0);
  }
  bool start_from(int output, double z, Vector<double, 2>& x) const {
    x[output] = z;
    return true;
  }
};
static_assert(ProcessModel<AnyLinear> && TakesPackedInputs<AnyLinear>);

struct Sample {
  double dt_s, u;
  std::array<double, 2> z;
  std::uint32_t measured;
};

// Everything that a window is made of, as dense matrices in the test's own words.
struct Drive {
  Belief<AnyLinear> belief;
  std::vector<Sample> samples;
  Eigen::Vector2d weight;  // S, single shooting

  Eigen::Matrix2d f(std::size_t k) const {
    const Eigen::Matrix2d d = belief.model.a * samples[k].dt_s;
    return Eigen::Matrix2d::Identity() + d + d * d / 2.0 + d * d * d / 6.0 + d * d * d * d / 24.0;
  }
  Eigen::Vector2d g(std::size_t k) const {
    const Eigen::Matrix2d d = belief.model.a * samples[k].dt_s;
    return (Eigen::Matrix2d::Identity() + d / 2.0 + d * d / 6.0 + d * d * d / 24.0) * belief.model.b *
           (samples[k].u * samples[k].dt_s);
  }
  Eigen::Vector2d q(std::size_t k) const { return belief.process_variance * samples[k].dt_s; }
  Eigen::Vector2d inverse_r(std::size_t k) const {
    Eigen::Vector2d w = Eigen::Vector2d::Zero();
    for (unsigned i = 0; i < 2; ++i)
      if ((samples[k].measured >> i & 1U) != 0U) w[i] = 1.0 / (belief.noise[i].absolute * belief.noise[i].absolute);
    return w;
  }
  Eigen::Vector2d z(std::size_t k) const { return {samples[k].z[0], samples[k].z[1]}; }
};

// min 1/2 y' A y - b' y subject to low <= C y + c <= high: the best of the feasible among all ways to hold rows at an end.
struct DenseProgram {
  Eigen::MatrixXd a, rows;
  Eigen::VectorXd b, at, low, high;

  std::optional<Eigen::VectorXd> solve() const {
    best_.reset();
    std::vector<int> held;
    try_all(0, held);
    return best_;
  }

 private:
  void try_all(Eigen::Index row, std::vector<int>& held) const {
    if (row == rows.rows()) return consider(held);
    try_all(row + 1, held);
    if (static_cast<Eigen::Index>(held.size()) == b.size()) return;
    for (const int side : {-1, 1}) {
      if (!std::isfinite(side < 0 ? low[row] : high[row])) continue;
      held.push_back(side * (static_cast<int>(row) + 1));
      try_all(row + 1, held);
      held.pop_back();
    }
  }
  void consider(const std::vector<int>& held) const {
    const Eigen::Index n = b.size(), m = static_cast<Eigen::Index>(held.size());
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + m, n + m);
    Eigen::VectorXd right(n + m);
    kkt.topLeftCorner(n, n) = a;
    right.head(n) = b;
    for (Eigen::Index i = 0; i < m; ++i) {
      const int signed_row = held[static_cast<std::size_t>(i)];
      const Eigen::Index row = std::abs(signed_row) - 1;
      kkt.row(n + i).head(n) = rows.row(row);
      kkt.col(n + i).head(n) = rows.row(row).transpose();
      right[n + i] = (signed_row < 0 ? low[row] : high[row]) - at[row];
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(kkt);
    if (!lu.isInvertible()) return;
    const Eigen::VectorXd y = lu.solve(right).head(n);
    const Eigen::VectorXd x = rows * y + at;
    const double rounding = 1e-9 * (1.0 + x.cwiseAbs().maxCoeff());
    if ((low - x).maxCoeff() > rounding || (x - high).maxCoeff() > rounding) return;
    const double cost = 0.5 * y.dot(a * y) - b.dot(y);
    if (!best_ || cost < best_cost_) best_ = y, best_cost_ = cost;
  }
  mutable std::optional<Eigen::VectorXd> best_;
  mutable double best_cost_ = 0.0;
};

// All states of samples first ... last by brute force; empty if nothing is within the bounds.
//   with process noise the states are free, without it they follow from the first one
std::optional<std::vector<Eigen::Vector2d>> exact_window(const Drive& d, std::size_t first, std::size_t last,
                                                         const Eigen::Vector2d& arrival,
                                                         const Eigen::Matrix2d& arrival_information, bool noise,
                                                         bool bound_all) {
  const auto count = static_cast<Eigen::Index>(last - first + 1), all = 2 * count;
  // x = T y + t
  Eigen::MatrixXd t_y = Eigen::MatrixXd::Identity(all, noise ? all : 2);
  Eigen::VectorXd t = Eigen::VectorXd::Zero(all);
  if (!noise)
    for (Eigen::Index i = 1; i < count; ++i) {
      const std::size_t k = first + static_cast<std::size_t>(i);
      t_y.middleRows<2>(2 * i) = d.f(k) * t_y.middleRows<2>(2 * i - 2);
      t.segment<2>(2 * i) = d.f(k) * t.segment<2>(2 * i - 2) + d.g(k);
    }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(all, all);  // in x
  Eigen::VectorXd b = Eigen::VectorXd::Zero(all);
  a.topLeftCorner<2, 2>() = arrival_information;
  b.head<2>() = arrival_information * arrival;
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::size_t k = first + static_cast<std::size_t>(i);
    const Eigen::Matrix2d& h = d.belief.model.h;
    a.block<2, 2>(2 * i, 2 * i) += h.transpose() * d.inverse_r(k).asDiagonal() * h;
    b.segment<2>(2 * i) += h.transpose() * d.inverse_r(k).asDiagonal() * d.z(k);
    if (i == 0 || !noise) continue;
    Eigen::MatrixXd way = Eigen::MatrixXd::Zero(2, all);
    way.middleCols<2>(2 * i - 2) = -d.f(k);
    way.middleCols<2>(2 * i).setIdentity();
    const Eigen::Matrix2d information = d.q(k).cwiseInverse().asDiagonal();
    a += way.transpose() * information * way;
    b += way.transpose() * information * d.g(k);
  }
  DenseProgram p;
  p.a = t_y.transpose() * a * t_y;
  p.b = t_y.transpose() * (b - a * t);
  const Eigen::Index bounded = bound_all ? all : 2;
  p.rows = t_y.topRows(bounded);
  p.at = t.head(bounded);
  p.low = d.belief.lower.replicate(bounded / 2, 1);
  p.high = d.belief.upper.replicate(bounded / 2, 1);
  const auto y = p.solve();
  if (!y) return std::nullopt;
  const Eigen::VectorXd x = t_y * *y + t;
  std::vector<Eigen::Vector2d> states;
  for (Eigen::Index i = 0; i < count; ++i) states.emplace_back(x.segment<2>(2 * i));
  return states;
}

Drive random_drive(RandomStream& random, int samples, bool noise) {
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  const auto size = [&] { return std::pow(10.0, between(-2.0, 2.0)); };
  Drive d;
  Belief<AnyLinear>& b = d.belief;
  for (int r = 0; r < 2; ++r) {
    for (int c = 0; c < 2; ++c) b.model.a(r, c) = between(-1.0, 1.0), b.model.h(r, c) = between(-1.0, 1.0);
    b.model.b[r] = between(-1.0, 1.0);
    b.initial_mean[r] = random.normal();
    b.initial_variance[r] = size();
    b.process_variance[r] = noise ? size() : 0.0;
    b.noise[static_cast<std::size_t>(r)] = {0.0, std::sqrt(size())};
    const double middle = 0.5 * random.normal(), width = between(0.05, 1.5);
    if (random.uniform() < 0.8) b.lower[r] = middle - width;
    if (random.uniform() < 0.8) b.upper[r] = middle + width;
    d.weight[r] = size();
  }
  for (int k = 0; k < samples; ++k)
    d.samples.push_back({k == 0 ? 0.0 : between(0.1, 1.0),
                         random.normal(),
                         {random.normal(), random.normal()},
                         static_cast<std::uint32_t>(4.0 * random.uniform())});
  return d;
}

struct Tally {
  int windows = 0, wrong = 0, fallbacks = 0, infeasible = 0, active = 0;
  double apart = 0.0;  // in standard deviations
};

template <typename Solver>
void compare(const Solver& solver, const std::optional<std::vector<Eigen::Vector2d>>& exact, const Drive& d, Tally& tally) {
  ++tally.windows;
  tally.infeasible += exact ? 0 : 1;
  const Posterior p = solver.posterior();
  if (p.status != EstimateStatus::kValid) {
    tally.fallbacks += exact ? 1 : 0;
    return;
  }
  bool right = exact.has_value();
  for (int i = 0; right && i < solver.samples(); ++i)
    for (int r = 0; r < 2; ++r) {
      const double x = (*exact)[static_cast<std::size_t>(i)][r];
      // Rounding grows with the way to where bounds that nearly contradict each other meet, a thousand deviations off at times.
      const double size = std::sqrt(p.covariance[static_cast<std::size_t>(3 * r)]) + 1e-3 * std::abs(x);
      const double off = std::abs(solver.solution(i)[r] - x) / size;
      tally.apart = std::max(tally.apart, off);
      right = right && off < 1e-6;  // the bar: Ipopt's tolerance, in standard deviations
      tally.active += x == d.belief.lower[r] || x == d.belief.upper[r] ? 1 : 0;
    }
  tally.wrong += right ? 0 : 1;
}

void step(Estimator& e, const Sample& s) {
  const std::array<double, 1> u{s.u};
  e.step({s.dt_s, u, s.z, s.measured});
}

int windows_wanted(int in_the_suite) {
  const char* const more = std::getenv("SLIPSTREAM_RTI_WINDOWS");
  return more != nullptr ? std::atoi(more) : in_the_suite;
}

// Both iterated to convergence and with the settings that are shipped: a linear model's window is one quadratic program, and
// one step solves it. Printed of each: how far from the exact solution.
struct Tallies {
  Tally converged, shipped;

  void print(const char* what) const {
    for (const Tally* t : {&converged, &shipped})
      std::printf("%s, %s: %d windows, %d wrong, %d fallbacks, %d infeasible, %d held components, at most %.1e apart\n", what,
                  t == &shipped ? "as shipped" : "converged", t->windows, t->wrong, t->fallbacks, t->infeasible, t->active,
                  t->apart);
  }
};

// Windows of two and three samples that slide: the arrival cost is the plain Kalman filter's prediction, because the model is
// linear.
TEST(RealTimeIteration, RandomWindowsWithProcessNoiseAreExact) {
  RandomStream random(1000, 0, "windows");
  Tallies tallies;
  const int wanted = windows_wanted(3000);
  while (tallies.converged.windows < wanted) {
    const Drive d = random_drive(random, 6, true);
    const std::size_t window = random.uniform() < 0.8 ? 1 : 2;
    RtiMhe<AnyLinear> mhe(d.belief, static_cast<int>(window), kToConvergence), shipped(d.belief, static_cast<int>(window));
    mhe.start_given();
    shipped.start_given();
    Gaussian<AnyLinear> arrival{d.belief.initial_mean, d.belief.initial_variance.asDiagonal()};
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      step(shipped, d.samples[k]);
      const std::size_t first = k > window ? k - window : 0;
      if (first > 0) {
        const Eigen::Matrix2d information = arrival.covariance.inverse() + d.belief.model.h.transpose() *
                                                                               d.inverse_r(first - 1).asDiagonal() *
                                                                               d.belief.model.h;
        const Eigen::Matrix2d after = information.inverse();
        const Eigen::Vector2d mean = arrival.mean + after * d.belief.model.h.transpose() * d.inverse_r(first - 1).asDiagonal() *
                                                        (d.z(first - 1) - d.belief.model.h * arrival.mean);
        arrival.mean = d.f(first) * mean + d.g(first);
        arrival.covariance = d.f(first) * after * d.f(first).transpose();
        arrival.covariance.diagonal() += d.q(first);
      }
      const auto exact = exact_window(d, first, k, arrival.mean, arrival.covariance.inverse(), true, true);
      compare(mhe, exact, d, tallies.converged);
      compare(shipped, exact, d, tallies.shipped);
    }
  }
  tallies.print("with process noise");
  for (const Tally& tally : {tallies.converged, tallies.shipped}) {
    EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
    EXPECT_EQ(tally.fallbacks, 0);
    EXPECT_EQ(tally.infeasible, 0);
    EXPECT_GT(tally.active, tally.windows / 4);  // bounds do matter here
  }
}

// Without process noise the bounds of all samples hang on two numbers: often nothing satisfies them, or some follow from
// others.
TEST(RealTimeIteration, RandomWindowsWithoutProcessNoiseAreExactOrFallBack) {
  RandomStream random(1001, 0, "windows");
  Tallies tallies;
  const int wanted = windows_wanted(3000);
  while (tallies.converged.windows < wanted) {
    const Drive d = random_drive(random, 4, false);
    RtiMhe<AnyLinear> mhe(d.belief, 8, kToConvergence), shipped(d.belief, 8);
    mhe.start_given();
    shipped.start_given();
    const Eigen::Matrix2d information = d.belief.initial_variance.cwiseInverse().asDiagonal();
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      step(shipped, d.samples[k]);
      const auto exact = exact_window(d, 0, k, d.belief.initial_mean, information, false, true);
      compare(mhe, exact, d, tallies.converged);
      compare(shipped, exact, d, tallies.shipped);
    }
  }
  tallies.print("without process noise");
  for (const Tally& tally : {tallies.converged, tallies.shipped}) {
    EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
    EXPECT_LT(tally.fallbacks, tally.windows / 100);  // vertices with as many bounds as unknowns
    EXPECT_GT(tally.active, tally.windows / 8);
    EXPECT_GT(tally.infeasible, 0);
  }
}

TEST(RealTimeIteration, RandomWindowsOfTheDocumentsFormAreExact) {
  RandomStream random(1002, 0, "windows");
  Tallies tallies;
  const int wanted = windows_wanted(3000);
  while (tallies.converged.windows < wanted) {
    const Drive d = random_drive(random, 6, false);
    const std::size_t window = 3;
    RtiSingleShooting<AnyLinear> mhe(d.belief, static_cast<int>(window), d.weight, kToConvergence);
    RtiSingleShooting<AnyLinear> shipped(d.belief, static_cast<int>(window), d.weight);
    mhe.start_given();
    shipped.start_given();
    Eigen::Vector2d arrival = d.belief.initial_mean, first_state = arrival;
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      step(shipped, d.samples[k]);
      const std::size_t first = k > window ? k - window : 0;
      if (first > 0) arrival = d.f(first) * first_state + d.g(first);
      const auto exact = exact_window(d, first, k, arrival, d.weight.asDiagonal(), false, false);
      compare(mhe, exact, d, tallies.converged);
      compare(shipped, exact, d, tallies.shipped);
      first_state = exact->front();
    }
  }
  tallies.print("document's form");
  for (const Tally& tally : {tallies.converged, tallies.shipped}) {
    EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
    EXPECT_EQ(tally.fallbacks, 0);
    EXPECT_GT(tally.active, tally.windows / 4);
  }
}

TEST(RealTimeIteration, WithoutBoundsOnALinearModelItIsTheKalmanFilter) {
  Belief<LinearModel> b;  // takes no packs of inputs
  b.noise = {{{0.0, 0.2}, {0.0, 0.5}}};
  b.process_variance = {0.01, 0.1};
  b.initial_mean = {1.0, -1.0};
  b.initial_variance = {2.0, 3.0};
  RtiMhe<LinearModel> mhe(b, 5);
  Ekf<LinearModel> filter(b);
  mhe.start_given();
  filter.start_given();
  RandomStream random(1003, 0, "drive");
  for (int k = 0; k < 40; ++k) {
    const Sample s{k == 0 ? 0.0 : 0.1, random.normal(), {random.normal(), random.normal()}, static_cast<std::uint32_t>(k % 4)};
    step(mhe, s);
    step(filter, s);
    const Posterior p = mhe.posterior(), expected = filter.posterior();
    ASSERT_EQ(p.status, EstimateStatus::kValid);
    EXPECT_LT(p.kkt_residual, 1e-10);  // rounding: a quadratic program is solved in one step
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(p.mean[i], expected.mean[i], 1e-10);  // the ladder's bar for linear models
      EXPECT_NEAR(p.innovation[i], expected.innovation[i], 1e-10);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(p.covariance[i], expected.covariance[i], 1e-10);
      EXPECT_NEAR(p.innovation_covariance[i], expected.innovation_covariance[i], 1e-10);
    }
  }
}

// Six unknowns, every start of the active set drawn at random: the sides that a wrong last step would have left behind.
TEST(RealTimeIteration, TheActiveSetFindsTheSolutionFromAnyStart) {
  constexpr int n = 6;
  RandomStream random(1004, 0, "box");
  int held = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Eigen::MatrixXd root(n, n);
    for (double& x : root.reshaped()) x = random.normal();
    BoxProgram<n> box;
    box.curvature = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
    for (int k = 0; k < n; ++k) {
      box.slope[k] = 3.0 * random.normal();
      box.low[k] = -0.5 * random.uniform();
      box.high[k] = 0.5 * random.uniform();
    }
    box.scale.setOnes();
    DenseProgram dense;
    dense.a = box.curvature;
    dense.b = box.slope;
    dense.rows = Eigen::MatrixXd::Identity(n, n);
    dense.at = Eigen::VectorXd::Zero(n);
    dense.low = box.low;
    dense.high = box.high;
    const Eigen::VectorXd exact = *dense.solve();
    for (int start = 0; start < 20; ++start) {
      ActiveSet set(n);
      for (int k = 0; k < n; ++k) set.side(k) = static_cast<Side>(static_cast<int>(3.0 * random.uniform()) - 1);
      ASSERT_TRUE(set.solve(box, n));
      for (int k = 0; k < n; ++k) {
        EXPECT_NEAR(box.value(k), exact[k], 1e-9);  // rounding times a condition number of some thousands
        held += set.side(k) == Side::kFree ? 0 : 1;
      }
    }
  }
  EXPECT_GT(held, 1200);  // a sixth of all: there was something to find
}

TEST(RealTimeIteration, AProgramThatIsNotConvexIsRefused) {
  BoxProgram<2> box;
  box.curvature << 1.0, 1.0, 1.0, 1.0;  // singular: x_0 + x_1 is all that it knows
  box.slope << 1.0, 0.0;
  box.low.setConstant(-kInfinity);
  box.high.setConstant(kInfinity);
  box.scale.setOnes();
  ActiveSet set(2);
  EXPECT_FALSE(set.solve(box, 2));
}

Belief<WheelFriction> unimog_belief() {
  Belief<WheelFriction> b;
  b.noise = {{{0.05, 0.0}, {0.05, 0.0}}};
  b.process_variance = {1e-3, 5e-4};
  b.initial_mean = {0.5, 0.0};
  b.initial_variance = {1e-2, 0.04};
  b.lower = {-1.0, -1.2};
  b.upper = {400.0, 1.2};
  return b;
}

EstimateStatus wheel_step(Estimator& e, bool first, double w, double a, std::uint32_t measured = 3U) {
  const std::array<double, 1> u{1700.0};
  const std::array<double, 2> z{w, a};
  e.step({first ? 0.0 : 0.01, u, z, measured});
  return e.posterior().status;
}

TEST(RealTimeIteration, DataBeyondAllNumbersAreNotPublishedAsValid) {
  for (const double bad : {1e200, 1e308, kInfinity, -kInfinity, kNan})
    for (const bool single : {false, true})
      for (const int output : {0, 1}) {
        const std::unique_ptr<Estimator> e =
            single ? std::unique_ptr<Estimator>(
                         std::make_unique<RtiSingleShooting<WheelFriction>>(unimog_belief(), 4, Eigen::Vector2d(1e4, 1e5)))
                   : std::make_unique<RtiMhe<WheelFriction>>(unimog_belief(), 4);
        e->start_given();
        EXPECT_EQ(wheel_step(*e, true, 0.5, 1.2), EstimateStatus::kValid);
        EXPECT_EQ(wheel_step(*e, false, 0.5, 1.2), EstimateStatus::kValid);
        const EstimateStatus status = wheel_step(*e, false, output == 0 ? bad : 0.5, output == 1 ? bad : 1.2);
        // A finite one, however large, may have a solution like any other.
        EXPECT_TRUE(status != EstimateStatus::kValid || (std::isfinite(bad) && std::isfinite(e->posterior().mean[0]))) << bad;
        // What was not measured is not read.
        e->start_given();
        EXPECT_EQ(wheel_step(*e, true, output == 0 ? bad : 0.5, output == 1 ? bad : 1.2, output == 0 ? 2U : 1U),
                  EstimateStatus::kValid);
        EXPECT_EQ(wheel_step(*e, false, 0.5, 1.2), EstimateStatus::kValid);
      }
}

// Nothing measured: the prediction, with the filter's growing covariance; without a weight on the arrival there is no solution.
TEST(RealTimeIteration, AWindowThatIsNotObservable) {
  RtiMhe<WheelFriction> mhe(unimog_belief(), 4);
  RtiSingleShooting<WheelFriction> blind(unimog_belief(), 4, Eigen::Vector2d::Zero());
  Ekf<WheelFriction> filter(unimog_belief());
  for (Estimator* e : std::initializer_list<Estimator*>{&mhe, &blind, &filter}) e->start_given();
  for (int k = 0; k < 12; ++k) {
    EXPECT_EQ(wheel_step(mhe, k == 0, kNan, kNan, 0U), EstimateStatus::kValid);
    EXPECT_EQ(wheel_step(blind, k == 0, kNan, kNan, 0U), EstimateStatus::kFallback);
    wheel_step(filter, k == 0, kNan, kNan, 0U);
    EXPECT_TRUE(std::isnan(blind.posterior().kkt_residual));
    for (const Estimator* e : {static_cast<const Estimator*>(&mhe), static_cast<const Estimator*>(&blind)})
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(e->posterior().mean[i], filter.posterior().mean[i], 1e-12);  // rounding
        EXPECT_NEAR(e->posterior().covariance[3 * i], filter.posterior().covariance[3 * i], 1e-12);
      }
  }
}

// A bound that holds the friction makes a program solvable that nothing else does: one wheel speed cannot tell the wheel's
// speed at the window's start from the friction since. There is no covariance then, so it may not pass for valid, whatever
// way rounding sends the friction's force; with a weight on the wheel's start, both and their covariance are known.
TEST(RealTimeIteration, ABoundIsNoKnowledge) {
  const double gain = 0.01 * 2000.0 * 9.81 * 0.52 / 11.5;  // rad/s that a sample's friction takes: dt m g r/J
  for (const double weight : {0.0, 1e4})
    for (int trial = 0; trial < 20; ++trial) {
      Belief<WheelFriction> b = unimog_belief();
      b.noise = {{{0.0, 1e-2}, {0.0, 1e-4}}};  // V = 1e4, 1e8
      b.upper[1] = 0.1;
      RtiSingleShooting<WheelFriction> mhe(b, 1, Eigen::Vector2d(weight, 0.0));
      mhe.start_given();
      for (const bool first : {true, false}) EXPECT_EQ(wheel_step(mhe, first, 0.5, 1.5), EstimateStatus::kValid);
      EXPECT_EQ(mhe.posterior().mean[1], 0.1);
      wheel_step(mhe, false, kNan, kNan, 0U);
      const EstimateStatus status = wheel_step(mhe, false, 0.5 + 0.01 * trial, kNan, 1U);
      const Posterior p = mhe.posterior();
      if (weight == 0.0) {
        EXPECT_EQ(status, EstimateStatus::kFallback) << trial;
        EXPECT_TRUE(std::isnan(p.kkt_residual)) << trial;
      } else {
        EXPECT_EQ(status, EstimateStatus::kValid) << trial;
        EXPECT_EQ(p.mean[1], 0.1) << trial;
        // z = w_0 - gain mu: the variances of z and of w_0, 1/V and 1/S; to the digits of a well-conditioned 2 x 2 system.
        EXPECT_NEAR(p.covariance[3] * gain * gain, 2e-4, 1e-12);
      }
    }
}

// A program was solved, but its residual is more than is let pass: what is published instead has none.
TEST(RealTimeIteration, AFallbackHasNoResidual) {
  const RtiSettings nothing_passes{3, 1e-2, -1.0};
  RtiMhe<WheelFriction> mhe(unimog_belief(), 4, nothing_passes);
  RtiSingleShooting<WheelFriction> single(unimog_belief(), 4, Eigen::Vector2d(1e4, 1e5), nothing_passes);
  for (Estimator* e : std::initializer_list<Estimator*>{&mhe, &single}) {
    e->start_given();
    for (int k = 0; k < 8; ++k) {
      EXPECT_EQ(wheel_step(*e, k == 0, 0.5, 1.2), EstimateStatus::kFallback);
      EXPECT_TRUE(std::isnan(e->posterior().kkt_residual));
    }
  }
}

// The drag grows with the square of the speed, in the way and in the output: not linear. The cost as the document's reader
// would write it, in the states alone; its slope by differences must vanish where no bound holds and push outwards where one
// does.
TEST(RealTimeIteration, ConditionsOfOptimalityHoldAsRecomputed) {
  Belief<LongitudinalFriction> b;
  b.noise = {{{0.0, 0.4}, {0.0, 0.06}}};
  b.process_variance = {1e-2, 1e-3, 5e-4};
  b.initial_mean = {20.0, 10.4, 0.1};
  b.initial_variance = {0.05, 0.01, 0.01};
  b.upper[2] = 0.11;
  constexpr int kSteps = 12;
  RtiMhe<LongitudinalFriction> mhe(b, kSteps, kToConvergence);
  mhe.start_given();
  RandomStream random(1005, 0, "drive");
  std::vector<Sample> samples;
  for (int k = 0; k < kSteps; ++k) {
    samples.push_back(
        {k == 0 ? 0.0 : 0.01 + 0.004 * (k % 3), 1800.0 - 5.0 * k, {20.0 + 0.4 * random.normal(), 1.3}, k % 4 == 2 ? 1U : 3U});
    const Sample& s = samples.back();
    const std::array<double, 1> u{s.u};
    mhe.step({s.dt_s, u, s.z, s.measured});
  }
  ASSERT_EQ(mhe.posterior().status, EstimateStatus::kValid);
  EXPECT_LE(mhe.posterior().kkt_residual, 1e-8);
  const auto cost = [&](const std::vector<Eigen::Vector3d>& x) {
    double sum = 0.0;
    for (int r = 0; r < 3; ++r) sum += 0.5 * std::pow(x[0][r] - b.initial_mean[r], 2) / b.initial_variance[r];
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Sample& s = samples[k];
      const Eigen::Vector2d h(x[k][0], 9.81 * x[k][2] - 0.5 * 1.2 * 0.6 * 5.6 / 2000.0 * x[k][1] * x[k][1]);
      for (unsigned i = 0; i < 2; ++i)
        if ((s.measured >> i & 1U) != 0U) sum += 0.5 * std::pow((s.z[i] - h[i]) / b.noise[i].absolute, 2);
      if (k == 0) continue;
      const Eigen::Vector3d way = x[k] - transition(b.model, x[k - 1], Vector<double, 1>(s.u), s.dt_s);
      for (int r = 0; r < 3; ++r) sum += 0.5 * way[r] * way[r] / (b.process_variance[r] * s.dt_s);
    }
    return sum;
  };
  std::vector<Eigen::Vector3d> x;
  for (int i = 0; i < kSteps; ++i) x.emplace_back(mhe.solution(i));
  int held = 0;
  for (std::size_t k = 0; k < kSteps; ++k)
    for (int r = 0; r < 3; ++r) {
      const double sigma = std::sqrt(mhe.posterior().covariance[static_cast<std::size_t>(4 * r)]), step = 1e-3 * sigma;
      std::vector<Eigen::Vector3d> up = x, down = x;
      up[k][r] += step;
      down[k][r] -= step;
      const double slope = (cost(up) - cost(down)) / (2e-3);  // for a move of one standard deviation
      if (x[k][r] == b.upper[r]) {
        ++held;
        EXPECT_LE(slope, 1e-6);
      } else {
        EXPECT_NEAR(slope, 0.0, 1e-6) << k << " " << r;  // differences of a cost near 1e2 with steps of 1e-3: 1e-11 by rounding
        EXPECT_LE(x[k][r], b.upper[r]);
      }
    }
  EXPECT_GT(held, 2);
}

// Packs of samples give what each sample gives by itself, and the same bits whatever the processor's registers.
template <typename M>
void expect_same_linearisation(const M& model, const Vector<double, M::kStates>& near, const Vector<double, M::kStates>& spread,
                               const Vector<double, M::kInputs>& input) {
  using At = WindowLayout<M>;
  constexpr int n = M::kStates, kSamples = 21;
  typename At::Rows rows(kSamples);
  RandomStream random(1006, 0, "points");
  for (int i = 0; i < kSamples; ++i) {
    rows.push();
    for (int r = 0; r < n; ++r) rows(At::x + r, i) = near[r] + spread[r] * random.normal();
    for (int r = 0; r < M::kInputs; ++r) rows(At::u + r, i) = input[r] * random.normal();
    rows(At::dt, i) = i == 11 ? 0.5 : 0.01 + 1e-3 * i;  // one that may need more than one Runge-Kutta step
  }
  WindowLinearisation<M> line(kSamples);
  std::vector<double> first;
  for (const int width : {2, 4, 8}) {
    const int before = std::exchange(widest_detail::at_most, width);
    line.evaluate(model, rows);
    widest_detail::at_most = before;
    std::vector<double> all;
    for (int i = 0; i < kSamples; ++i) {
      Vector<double, n> x, to;
      Vector<double, M::kInputs> u, u_next;
      Matrix<double, n> f;
      for (int r = 0; r < n; ++r) x[r] = rows(At::x + r, i);
      for (int r = 0; r < M::kInputs; ++r) u[r] = rows(At::u + r, i);
      if (i + 1 < kSamples) {
        for (int r = 0; r < M::kInputs; ++r) u_next[r] = rows(At::u + r, i + 1);
        transition_and_jacobian(model, x, u_next, rows(At::dt, i + 1), to, f);
        for (int r = 0; r < n; ++r) {
          const double size = 1.0 + std::abs(to[r]);
          EXPECT_NEAR(line.reach(i, r), to[r], 1e-12 * size) << M::kName << i;  // rounding: other sines
          for (int c = 0; c < n; ++c) EXPECT_NEAR(line.f(i, r, c), f(r, c), 1e-12 * (1.0 + std::abs(f(r, c)))) << M::kName << i;
          all.push_back(line.reach(i, r));
        }
      }
      Vector<double, M::kOutputs> z;
      Matrix<double, M::kOutputs, n> h;
      value_and_jacobian<M::kOutputs>([&](const auto& s) { return model.output(s, u); }, x, z, h);
      for (int k = 0; k < M::kOutputs; ++k) {
        EXPECT_NEAR(line.output(i, k), z[k], 1e-12 * (1.0 + std::abs(z[k])));
        for (int c = 0; c < n; ++c) EXPECT_NEAR(line.h(i, k, c), h(k, c), 1e-12 * (1.0 + std::abs(h(k, c))));
        all.push_back(line.output(i, k));
      }
    }
    if (first.empty()) first = all;
    EXPECT_EQ(all, first) << width;
  }
}

TEST(RealTimeIteration, SeveralSamplesAtOnceAreLinearisedAsOne) {
  WheelFriction wheel;
  wheel.wheel.quarter.viscous_friction_nms = 5.0;
  expect_same_linearisation(wheel, {0.05, 0.1}, {0.1, 0.1}, Vector<double, 1>(1000.0));  // across standstill
  LongitudinalFriction longitudinal{wheel.wheel};
  longitudinal.rolling_rate_hz = 0.3;
  expect_same_linearisation(longitudinal, {0.0, 0.0, 0.1}, {1.0, 3.0, 0.1}, Vector<double, 1>(1000.0));
  Vector<double, 7> near, spread;
  near << 0.0, 0.3, 1.0, 2.0, 3.0, 18.0, 20.0;
  spread << 0.1, 0.3, 2.0, 1.0, 1.0, 1.0, 1.0;
  expect_same_linearisation(LateralBicycle{}, near, spread, {0.1, 40.0});
  expect_same_linearisation(PointMassMotion{}, {0.0, 0.0, 15.0, 1.0}, {10.0, 10.0, 3.0, 1.0}, {1.0, 0.1});  // one by one
}

}  // namespace
}  // namespace slipstream::test
