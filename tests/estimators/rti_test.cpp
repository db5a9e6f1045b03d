// Real-time iteration against solutions that have nothing in common with it: quadratic programs of small random windows by
// trying every set of active bounds on dense matrices, the Kalman filter, and hand-made conditions of optimality.
//
// SLIPSTREAM_RTI_WINDOWS: how many random windows, if more are wanted than the suite has time for.
#include "estimators/rti.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

#include "common/random.hpp"
#include "estimators/ekf.hpp"
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
    const double rounding = 1e-10 * (1.0 + x.cwiseAbs().maxCoeff());
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
                                                         const Eigen::Vector2d& arrival, const Eigen::Matrix2d& arrival_information,
                                                         bool noise, bool bound_all) {
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
    d.samples.push_back({k == 0 ? 0.0 : between(0.1, 1.0), random.normal(), {random.normal(), random.normal()},
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
      const double off = std::abs(solver.solution(i)[r] - x) / std::sqrt(p.covariance[static_cast<std::size_t>(3 * r)]);
      tally.apart = std::max(tally.apart, off);
      right = right && off < 1e-6;  // the bar: Ipopt's tolerance, in standard deviations
      tally.active += x == d.belief.lower[r] || x == d.belief.upper[r] ? 1 : 0;
    }
  tally.wrong += right ? 0 : 1;
  if(!right) std::printf("WRONG exact %d size %d kkt %g\n",exact.has_value(),solver.samples(),p.kkt_residual);
}

void step(Estimator& e, const Sample& s) {
  const std::array<double, 1> u{s.u};
  e.step({s.dt_s, u, s.z, s.measured});
}

int windows_wanted(int in_the_suite) {
  const char* const more = std::getenv("SLIPSTREAM_RTI_WINDOWS");
  return more != nullptr ? std::atoi(more) : in_the_suite;
}

// Windows of two and three samples that slide: the arrival cost is the plain Kalman filter's prediction, because the model is
// linear.
TEST(RealTimeIteration, RandomWindowsWithProcessNoiseAreExact) {
  RandomStream random(1000, 0, "windows");
  Tally tally;
  const int wanted = windows_wanted(3000);
  while (tally.windows < wanted) {
    const Drive d = random_drive(random, 6, true);
    const std::size_t window = random.uniform() < 0.8 ? 1 : 2;
    RtiMhe<AnyLinear> mhe(d.belief, static_cast<int>(window));
    mhe.start_given();
    Gaussian<AnyLinear> arrival{d.belief.initial_mean, d.belief.initial_variance.asDiagonal()};
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      const std::size_t first = k > window ? k - window : 0;
      if (first > 0) {
        const Eigen::Matrix2d information = arrival.covariance.inverse() + d.belief.model.h.transpose() *
                                                                               d.inverse_r(first - 1).asDiagonal() *
                                                                               d.belief.model.h;
        const Eigen::Matrix2d after = information.inverse();
        const Eigen::Vector2d mean =
            arrival.mean + after * d.belief.model.h.transpose() * d.inverse_r(first - 1).asDiagonal() *
                               (d.z(first - 1) - d.belief.model.h * arrival.mean);
        arrival.mean = d.f(first) * mean + d.g(first);
        arrival.covariance = d.f(first) * after * d.f(first).transpose();
        arrival.covariance.diagonal() += d.q(first);
      }
      compare(mhe, exact_window(d, first, k, arrival.mean, arrival.covariance.inverse(), true, true), d, tally);
    }
  }
  RecordProperty("apart", std::to_string(tally.apart));
  EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
  EXPECT_EQ(tally.fallbacks, 0);
  EXPECT_EQ(tally.infeasible, 0);
  EXPECT_GT(tally.active, tally.windows / 4);  // bounds do matter here
  std::printf("%d windows: %d wrong, %d fallbacks, %d held components, at most %.1e apart\n", tally.windows, tally.wrong,
              tally.fallbacks, tally.active, tally.apart);
}

// Without process noise the bounds of all samples hang on two numbers: often nothing satisfies them, or some follow from others.
TEST(RealTimeIteration, RandomWindowsWithoutProcessNoiseAreExactOrFallBack) {
  RandomStream random(1001, 0, "windows");
  Tally tally;
  const int wanted = windows_wanted(3000);
  while (tally.windows < wanted) {
    const Drive d = random_drive(random, 4, false);
    RtiMhe<AnyLinear> mhe(d.belief, 8);
    mhe.start_given();
    const Eigen::Matrix2d information = d.belief.initial_variance.cwiseInverse().asDiagonal();
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      compare(mhe, exact_window(d, 0, k, d.belief.initial_mean, information, false, true), d, tally);
    }
  }
  EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
  EXPECT_LT(tally.fallbacks, tally.windows / 100);  // vertices with as many bounds as unknowns
  EXPECT_GT(tally.active, tally.windows / 8);
  EXPECT_GT(tally.infeasible, 0);
  std::printf("%d windows: %d wrong, %d fallbacks, %d infeasible, %d held components, at most %.1e apart\n", tally.windows,
              tally.wrong, tally.fallbacks, tally.infeasible, tally.active, tally.apart);
}

TEST(RealTimeIteration, RandomWindowsOfTheDocumentsFormAreExact) {
  RandomStream random(1002, 0, "windows");
  Tally tally;
  const int wanted = windows_wanted(3000);
  while (tally.windows < wanted) {
    const Drive d = random_drive(random, 6, false);
    const std::size_t window = 3;
    RtiSingleShooting<AnyLinear> mhe(d.belief, static_cast<int>(window), d.weight);
    mhe.start_given();
    Eigen::Vector2d arrival = d.belief.initial_mean, first_state = arrival;
    for (std::size_t k = 0; k < d.samples.size(); ++k) {
      step(mhe, d.samples[k]);
      const std::size_t first = k > window ? k - window : 0;
      if (first > 0) arrival = d.f(first) * first_state + d.g(first);
      const auto exact = exact_window(d, first, k, arrival, d.weight.asDiagonal(), false, false);
      compare(mhe, exact, d, tally);
      first_state = exact->front();
    }
  }
  EXPECT_EQ(tally.wrong, 0) << "of " << tally.windows;
  EXPECT_EQ(tally.fallbacks, 0);
  EXPECT_GT(tally.active, tally.windows / 4);
  std::printf("%d windows: %d wrong, %d fallbacks, %d held components, at most %.1e apart\n", tally.windows, tally.wrong,
              tally.fallbacks, tally.active, tally.apart);
}

}  // namespace
}  // namespace slipstream::test
