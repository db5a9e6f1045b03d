// The programs of the moving-horizon estimator: derivatives against Ipopt's finite differences, and the window of the Unimog
// model against a Gauss-Newton solution written apart.
#include <gtest/gtest.h>

#include "common/random.hpp"
#include "estimators/mhe.hpp"

namespace slipstream::test {
namespace {

using Model = LongitudinalFriction;

Belief<Model> unimog_belief() {
  Belief<Model> b;
  b.noise = {{{0.05, 0.01}, {0.05, 0.01}}};
  b.process_variance = {1e-3, 1e-6, 5e-4};
  b.initial_mean = {9.0, 4.6, 0.1};
  b.initial_variance = {0.05, 0.01, 0.01};
  return b;
}

std::vector<WindowSample<Model>> window_samples(int count) {
  const Belief<Model> b = unimog_belief();
  RandomStream random(3, 0, "window");
  std::vector<WindowSample<Model>> samples;
  for (int i = 0; i < count; ++i) {
    WindowSample<Model> s;
    s.dt_s = i == 0 ? 0.0 : 0.01 + 0.004 * (i % 3);  // irregular on purpose
    s.u[0] = 1700.0 - 5.0 * i;
    s.z = {9.0 + 0.02 * i + 0.3 * random.normal(), 1.2 + 0.06 * random.normal()};
    s.measured = i % 4 == 2 ? 1U : 3U;
    s.weight = {1.0 / (0.45 * 0.45), i % 4 == 2 ? 0.0 : 1.0 / (0.06 * 0.06)};
    s.process_sigma = b.process_covariance(s.dt_s).cwiseSqrt();
    samples.push_back(s);
  }
  return samples;
}

MultipleShooting<Model> multiple(const Belief<Model>& belief, const std::vector<WindowSample<Model>>& samples) {
  MultipleShooting<Model> p;
  p.belief = &belief;
  p.samples = &samples;
  p.arrival = {belief.initial_mean, belief.initial_variance.asDiagonal()};
  p.arrival.covariance(0, 2) = p.arrival.covariance(2, 0) = 0.005;
  p.scale = {0.1, 0.05, 0.02};
  p.reference.assign(samples.size(), belief.initial_mean);
  p.prepare();
  return p;
}

TEST(MheWindow, DerivativesAgreeWithFiniteDifferences) {
  const Belief<Model> belief = unimog_belief();
  const auto samples = window_samples(6);
  RandomStream random(4, 0, "point");
  {
    MultipleShooting<Model> p = multiple(belief, samples);
    std::vector<double> y(static_cast<std::size_t>(p.variables()));
    for (double& v : y) v = random.normal();
    EXPECT_EQ(IpoptSolver::check_derivatives(p, y), 0);
  }
  {
    SingleShooting<Model> p;
    p.belief = &belief;
    p.samples = &samples;
    p.arrival = belief.initial_mean;
    p.arrival_weight = {1.0, 2.0, 3.0};
    p.scale = {0.3, 0.2, 0.1};
    const std::vector<double> y{0.5, -0.4, 0.8};
    EXPECT_EQ(IpoptSolver::check_derivatives(p, y), 0);
  }
}

TEST(MheWindow, TheDerivativeCheckerSeesAMistake) {
  class Wrong final : public NonlinearProgram {  // f = y^3, whose gradient is 3 y^2, not 2 y^2
   public:
    int variables() const override { return 1; }
    int constraints() const override { return 0; }
    void bounds(std::span<double> lower, std::span<double> upper) const override {
      lower[0] = -10.0;
      upper[0] = 10.0;
    }
    void jacobian_structure(std::vector<Triplet>&) const override {}
    void hessian_structure(std::vector<Triplet>& e) const override { e.push_back({0, 0}); }
    double objective(std::span<const double> y) override { return y[0] * y[0] * y[0]; }
    void gradient(std::span<const double> y, std::span<double> g) override { g[0] = 2.0 * y[0] * y[0]; }
    void constraint_values(std::span<const double>, std::span<double>) override {}
    void jacobian_values(std::span<const double>, std::span<double>) override {}
    void hessian_values(std::span<const double> y, double sigma, std::span<const double>, std::span<double> v) override {
      v[0] = sigma * 6.0 * y[0];
    }
  } wrong;
  EXPECT_GT(IpoptSolver::check_derivatives(wrong, std::vector<double>{2.0}), 0);
}

// Gauss-Newton on the dense residual vector in the states alone, with the noise eliminated: no solver, no scaling and no dual
// number in common with the code under test (Jacobians by hand: the model's right-hand side is short).
Eigen::VectorXd gauss_newton(const Belief<Model>& b, const Gaussian<Model>& arrival,
                             const std::vector<WindowSample<Model>>& samples) {
  const int n = static_cast<int>(samples.size());
  const QuarterCar& q = b.model.wheel.quarter;
  const double drag = 0.5 * q.air_density_kgpm3 * q.drag_coefficient * q.frontal_area_m2 / q.mass_kg;
  const double grip = q.mass_kg * 9.81 * q.wheel_radius_m / q.wheel_inertia_kgm2;
  const auto f = [&](const Eigen::Vector3d& x, double torque) {
    return Eigen::Vector3d(torque / q.wheel_inertia_kgm2 - grip * (x[2] + q.rolling_resistance),
                           9.81 * x[2] - drag * x[1] * x[1], 0.0);
  };
  const auto flow = [&](const Eigen::Vector3d& x, double torque, double dt) {
    const Eigen::Vector3d k1 = f(x, torque), k2 = f(x + 0.5 * dt * k1, torque), k3 = f(x + 0.5 * dt * k2, torque),
                          k4 = f(x + dt * k3, torque);
    return Eigen::Vector3d(x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4));
  };
  const Eigen::Matrix3d arrival_root = arrival.covariance.llt().matrixL();
  const auto residuals = [&](const Eigen::VectorXd& x) {
    std::vector<double> r;
    const Eigen::Vector3d first =
        arrival_root.triangularView<Eigen::Lower>().solve(Eigen::Vector3d(x.head<3>()) - arrival.mean);
    r.insert(r.end(), {first[0], first[1], first[2]});
    for (int i = 0; i < n; ++i) {
      const auto& s = samples[static_cast<std::size_t>(i)];
      const Eigen::Vector3d xi = x.segment<3>(3 * i);
      r.push_back(std::sqrt(s.weight[0]) * (s.z[0] - xi[0]));
      r.push_back(std::sqrt(s.weight[1]) * (s.z[1] - (9.81 * xi[2] - drag * xi[1] * xi[1])));
      if (i == 0) continue;
      const Eigen::Vector3d w =
          (xi - flow(x.segment<3>(3 * i - 3), s.u[0], s.dt_s)).cwiseQuotient(Eigen::Vector3d(s.process_sigma));
      r.insert(r.end(), {w[0], w[1], w[2]});
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(r.data(), static_cast<Eigen::Index>(r.size())));
  };
  Eigen::VectorXd x = b.initial_mean.replicate(n, 1);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Eigen::VectorXd r = residuals(x);
    Eigen::MatrixXd j(r.size(), x.size());
    for (Eigen::Index c = 0; c < x.size(); ++c) {
      const double h = 1e-4;  // the residuals are quadratic in x: central differences are exact up to rounding
      Eigen::VectorXd up = x, down = x;
      up[c] += h;
      down[c] -= h;
      j.col(c) = (residuals(up) - residuals(down)) / (2.0 * h);
    }
    x -= j.colPivHouseholderQr().solve(r);
  }
  return x;
}

TEST(MheWindow, IpoptFindsTheExactSolutionOfTheWindow) {
  const Belief<Model> belief = unimog_belief();
  for (const int samples_in_window : {2, 5, 21}) {
    const auto samples = window_samples(samples_in_window);
    MultipleShooting<Model> p = multiple(belief, samples);
    std::vector<double> y(static_cast<std::size_t>(p.variables()), 0.0);
    IpoptSolver solver;
    ASSERT_TRUE(solver.solve(p, y).converged);
    const Eigen::VectorXd exact = gauss_newton(belief, p.arrival, samples);
    for (int i = 0; i < samples_in_window; ++i)
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(p.state(y, i)[k], exact[3 * i + k], 1e-6) << samples_in_window;  // the bar
    // And once more, warm, from somewhere else.
    std::fill(y.begin(), y.end(), 0.3);
    ASSERT_TRUE(solver.solve(p, y).converged);
    const Eigen::VectorXd last = exact.tail(3);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(p.state(y, samples_in_window - 1)[k], last[k], 1e-6);
  }
}

// The whole estimator in sequence, warm, with the bounds that the scenario ships (inactive here), on windows that never slide:
// every estimate is the exact solution of all samples so far.
TEST(MheWindow, EveryWarmStartedStepIsExactWithTheShippedBounds) {
  constexpr int kSteps = 25;
  Belief<Model> belief = unimog_belief();
  belief.noise = {{{0.0, 0.45}, {0.0, 0.06}}};  // absolute: the weights are known without a prediction
  belief.lower = {-1.0, -1.0, -1.2};
  belief.upper = {400.0, 100.0, 1.2};
  std::vector<WindowSample<Model>> samples = window_samples(kSteps);
  Gaussian<Model> arrival{belief.initial_mean, belief.initial_variance.asDiagonal()};
  Mhe<Model> mhe(belief, kSteps);
  mhe.start_given();
  for (int k = 0; k < kSteps; ++k) {
    const auto& s = samples[static_cast<std::size_t>(k)];
    const std::array<double, 1> u{s.u[0]};
    const std::array<double, 2> z{s.z[0], s.z[1]};
    mhe.step({s.dt_s, u, z, s.measured});
    ASSERT_EQ(mhe.posterior().status, EstimateStatus::kValid);
    const std::vector<WindowSample<Model>> so_far(samples.begin(), samples.begin() + k + 1);
    const Eigen::VectorXd exact = gauss_newton(belief, arrival, so_far);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(mhe.posterior().mean[static_cast<std::size_t>(i)], exact[3 * k + i], 1e-6) << k;  // the bar
  }
}

TEST(MheWindow, AMeasurementBeyondAllNumbersIsNotPublishedAsValid) {
  Mhe<Model> mhe(unimog_belief(), 4);
  mhe.start_given();
  const std::array<double, 1> u{1700.0};
  const auto step = [&](double wheel, double a) {
    const std::array<double, 2> z{wheel, a};
    mhe.step({0.01, u, z, 3U});
    return mhe.posterior().status;
  };
  EXPECT_EQ(step(9.0, 1.2), EstimateStatus::kValid);
  EXPECT_NE(step(9.0, 1e200), EstimateStatus::kValid);  // its square overflows
}

}  // namespace
}  // namespace slipstream::test
