// The recursion of the bound against Kalman covariances and closed forms, and every sentence that says why there is none.
#include "monitor/bound.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "models/scenario.hpp"
#include "monitor/bound_recursion.hpp"
#include "tests/estimators/linear_model.hpp"

namespace slipstream {
namespace {

using test::LinearModel;

// A truth that stands still, sampled at a rate until the end.
class Still {
 public:
  Still(double rate_hz, double end_s, std::map<std::string, double> at) {
    Schedule schedule(rate_hz);
    for (; seconds(schedule.next()) < end_s + 1e-9; schedule.pass()) utime.push_back(schedule.next());
    for (const auto& [name, value] : at) column[name] = std::vector<double>(utime.size(), value);
  }
  TrueRun run() const {
    return {utime, [this](const std::string& name) {
              const auto found = column.find(name);
              return found == column.end() ? nullptr : &found->second;
            }};
  }
  std::vector<Utime> utime;
  std::map<std::string, std::vector<double>> column;
};

// x' = 0, z = x: a random walk once it is pushed.
struct Walk {
  static constexpr std::string_view kName = "walk";
  static constexpr int kStates = 1, kInputs = 1, kOutputs = 1;
  static constexpr std::array<Quantity, 1> kStateNames{{{"x", "1"}}}, kInputNames{{{"u", "1"}}}, kOutputNames{{{"x", "1"}}};
  static constexpr std::array<bool, 1> kLinear{true};
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
    return 0.0;
  }
  bool start_from(int, double z, Vector<double, 1>& x) const {
    x[0] = z;
    return true;
  }
};
static_assert(ProcessModel<Walk>);

template <typename T>
Vector<double, 1> one(T value) {
  return Vector<double, 1>(static_cast<double>(value));
}

// p' = v, v' = -c v with two sensors and a push, all at rates of their own: the covariance of the Kalman filter of it, from its
// textbook equations with the exact transition (e^(-c dt)) and plain numbers.
TEST(Bound, OfALinearModelIsTheKalmanCovariance) {
  constexpr double kC = 0.5, kQp = 0.01, kQv = 0.04, kRp = 0.25, kRv = 0.09;
  const Still truth(100.0, 3.0, {{"p_m", 1.0}, {"v_mps", -2.0}, {"u_mps2", 0.3}});
  BoundProblem<LinearModel> problem;
  problem.model.c = kC;
  problem.start_variance = {4.0, 1.0};
  problem.push_variance = {kQp, kQv};
  problem.push_rate_hz = 10.0;
  problem.sensors = {{0, {0.0, std::sqrt(kRp)}, 20.0}, {1, {0.0, std::sqrt(kRv)}, 50.0}};
  const Bound bound = trajectory_bound(problem, truth.run());
  const auto& series = std::get<BoundSeries>(bound);
  EXPECT_EQ(series.utime, truth.utime);

  double pp = 4.0, pv = 0.0, vv = 1.0;
  const double e = std::exp(-kC * 0.01), g = (1.0 - e) / kC;  // F = [1 g; 0 e]
  for (int k = 0; k <= 300; ++k) {
    if (k > 0) {
      const double pp_next = pp + 2.0 * g * pv + g * g * vv, pv_next = e * (pv + g * vv);
      pp = pp_next;
      pv = pv_next;
      vv = e * e * vv;
    }
    if (k > 0 && k % 10 == 0) {
      pp += kQp;
      vv += kQv;
    }
    if (k % 5 == 0) {
      const double s = pp + kRp;
      vv -= pv * pv / s;
      pv -= pp * pv / s;
      pp -= pp * pp / s;
    }
    if (k % 2 == 0) {
      const double s = vv + kRv;
      pp -= pv * pv / s;
      pv -= pv * vv / s;
      vv -= vv * vv / s;
    }
    const auto row = static_cast<std::size_t>(k);
    // Rounding, and Runge-Kutta's share of e^(-c dt): (c dt)^5/120 = 3e-14 a step, forgotten as fast as it is measured.
    ASSERT_NEAR(series.of("p_m")->at(row), pp, 1e-12 * pp) << k;
    ASSERT_NEAR(series.of("v_mps")->at(row), vv, 1e-12 * vv) << k;
  }
  EXPECT_EQ(series.of("u_mps2"), nullptr);
}

// P^2 + q P - q r = 0.
TEST(Bound, OfARandomWalkComesToItsClosedForm) {
  const double q = 0.3, r = 2.0;
  BoundProblem<Walk> problem;
  problem.start_variance = one(7.0);
  problem.push_variance = one(q);
  problem.push_rate_hz = 10.0;
  problem.sensors = {{0, {0.0, std::sqrt(r)}, 10.0}};
  const Bound bound = trajectory_bound(problem, Still(10.0, 20.0, {{"x", 3.0}, {"u", 0.0}}).run());
  EXPECT_NEAR(std::get<BoundSeries>(bound).variance[0].back(), (-q + std::sqrt(q * q + 4.0 * q * r)) / 2.0, 1e-14);  // rounding
}

// The speed is known exactly and stays so; what is left of the position is a random walk.
TEST(Bound, HoldsWhereProcessNoiseAndStartAreSingular) {
  const double q = 0.2, r = 1.5;
  BoundProblem<LinearModel> problem;
  problem.push_variance = {q, 0.0};
  problem.push_rate_hz = 10.0;
  problem.sensors = {{0, {0.0, std::sqrt(r)}, 10.0}, {1, {0.0, 0.1}, 10.0}};
  const Bound bound = trajectory_bound(problem, Still(10.0, 5.0, {{"p_m", 0.0}, {"v_mps", 1.0}, {"u_mps2", 0.0}}).run());
  const auto& series = std::get<BoundSeries>(bound);
  double P = 0.0;
  for (std::size_t k = 0; k < series.utime.size(); ++k) {
    if (k > 0) P = 1.0 / (1.0 / (P + q) + 1.0 / r);
    EXPECT_NEAR(series.variance[0][k], P, 1e-14);  // rounding of numbers below 1
    EXPECT_EQ(series.variance[1][k], 0.0);
  }
}

// Fisher information int (d ln p/dx)^2 p dz of z ~ N(x, rho^2 x^2 + sigma^2), by Simpson's rule and central differences.
double numerical_information(double x, double rho, double sigma) {
  const auto log_density = [&](double z, double at) {
    const double R = rho * rho * at * at + sigma * sigma;
    return -0.5 * std::log(2.0 * kPi * R) - 0.5 * (z - at) * (z - at) / R;
  };
  const double spread = std::sqrt(rho * rho * x * x + sigma * sigma), step = 1e-5 * spread;
  const int cells = 4000;
  const double width = 24.0 * spread / cells;
  double sum = 0.0;
  for (int i = 0; i <= cells; ++i) {
    const double z = x - 12.0 * spread + i * width;
    const double score = (log_density(z, x + step) - log_density(z, x - step)) / (2.0 * step);
    sum += (i == 0 || i == cells ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * score * score * std::exp(log_density(z, x));
  }
  return sum * width / 3.0;
}

TEST(Bound, ARelativeNoiseInformsByItsVarianceToo) {
  for (const NoiseLaw& noise : {NoiseLaw{0.5, 0.0}, NoiseLaw{0.3, 0.4}, NoiseLaw{0.0, 1.0}}) {
    const double x = -2.0, start = 0.7;
    BoundProblem<Walk> problem;
    problem.start_variance = one(start);
    problem.sensors = {{0, noise, 10.0}};
    const Bound bound = trajectory_bound(problem, Still(10.0, 0.0, {{"x", x}, {"u", 0.0}}).run());
    const double expected = 1.0 / (1.0 / start + numerical_information(x, noise.relative, noise.absolute));
    EXPECT_NEAR(std::get<BoundSeries>(bound).variance[0].front(), expected, 1e-7 * expected);  // of the differences
  }
}

TEST(Bound, NeedsTheTruthWhereSomethingHappens) {
  BoundProblem<Walk> problem;
  problem.sensors = {{0, {0.1, 0.0}, 10.0}};
  problem.push_rate_hz = 5.0;
  const auto why = [&](const Still& truth) { return std::get<std::string>(trajectory_bound(problem, truth.run())); };
  Still gap(10.0, 1.0, {{"x", 1.0}, {"u", 0.0}});
  gap.utime.erase(gap.utime.begin() + 3);
  for (auto& [name, column] : gap.column) column.pop_back();
  EXPECT_EQ(why(gap), "the truth at 0.3 s, where it is needed, was not seen");
  Still late(10.0, 1.0, {{"x", 1.0}, {"u", 0.0}});
  late.utime.erase(late.utime.begin());
  for (auto& [name, column] : late.column) column.pop_back();
  EXPECT_EQ(why(late), "the truth at 0 s, where it is needed, was not seen");
  Still hole(10.0, 1.0, {{"x", 1.0}, {"u", 0.0}});
  hole.column["u"][2] = std::nan("");
  EXPECT_EQ(why(hole), "the truth at 0.2 s is not known");
  EXPECT_EQ(why(Still(10.0, 1.0, {{"x", 1.0}})), "the run has no truth of u");
  EXPECT_EQ(why(Still(10.0, 1.0, {{"x", 0.0}, {"u", 0.0}})), "x is measured without noise at 0 s");
  EXPECT_TRUE(
      std::get<BoundSeries>(trajectory_bound(problem, Still(10.0, -1.0, {{"x", 1.0}, {"u", 0.0}}).run())).utime.empty());
}

Scenario point_mass() {
  Scenario s;
  s.plant.vehicle = PointMass();
  s.plant.truth_rate_hz = 40.0;
  s.plant.process_noise_rate_hz = 40.0;
  s.plant.process_noise = {{"east_m", 0.1}, {"north_m", 0.1}};
  s.sensors = {{"east_position", "east_m", 40.0, {0.0, 1.0}}, {"forward_speed", "forward_speed_mps", 20.0, {0.05, 0.0}}};
  s.estimator.process = PointMassMotion();
  return s;
}

template <typename Change>
std::string why_not(const Change& change) {
  Scenario s = point_mass();
  change(s);
  const std::string reason = why_no_bound(s).value_or("there is one");
  const std::vector<Utime> never;
  const Bound bound = posterior_bound(s, {never, [](const std::string&) { return nullptr; }});
  EXPECT_EQ(std::get<std::string>(bound), reason);
  return reason;
}

TEST(Bound, SaysWhyThereIsNone) {
  EXPECT_EQ(why_no_bound(point_mass()), std::nullopt);
  EXPECT_EQ(why_not([](Scenario& s) { s.recorded.emplace(); }),
            "the drive is recorded: what disturbed it and how its sensors err is not known");
  EXPECT_EQ(why_not([](Scenario& s) { s.estimator.strapdown.emplace(); }),
            "the inputs of a strapdown model are an IMU's noisy readings, and the bound needs true ones");
  EXPECT_EQ(why_not([](Scenario& s) {
              s.plant.vehicle = Unimog();
              s.estimator.process = LongitudinalFriction();
            }),
            "the model 'longitudinal_friction' is not what the plant 'unimog' does, whose own equations the bound needs");
  EXPECT_EQ(why_not([](Scenario& s) { s.plant.vehicle = SuspendedWheel(); }),
            "the model 'point_mass_motion' is not what the plant 'suspended_wheel' does, whose own equations the bound needs");
  EXPECT_EQ(why_not([](Scenario& s) {
              s.plant.vehicle = Bicycle();
              s.estimator.process = LateralBicycle();
            }),
            "the plant 'bicycle' holds front_stiffness_npr and rear_stiffness_npr fixed, which the model 'lateral_bicycle' has "
            "among its states");
  EXPECT_EQ(why_not([](Scenario& s) { std::get<PointMassMotion>(s.estimator.process).car.mass_kg = 1300.0; }),
            "mass_kg is 1300 in estimator.model and 1250 in the plant, whose own equations the bound needs");
  const std::string deterministic =
      "the plant has no process noise: once its start is known so is its state, and the least error is or becomes zero";
  EXPECT_EQ(why_not([](Scenario& s) { s.plant.process_noise.clear(); }), deterministic);
  EXPECT_EQ(why_not([](Scenario& s) { s.plant.process_noise = {{"east_m", 0.0}}; }), deterministic);
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[0].errors.scale = 1.02; }),
            "[sensor.east_position] has a scale of 1.02, and the bound is for sensors that err by their noise only");
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[0].errors.bias = -0.5; }),
            "[sensor.east_position] has a bias of -0.5, and the bound is for sensors that err by their noise only");
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[1].errors.quantum = 0.1; }),
            "[sensor.forward_speed] has a quantum of 0.1, and the bound is for sensors that err by their noise only");
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[1].errors.delay_s = 0.05; }),
            "[sensor.forward_speed] has a delay of 0.05 s, and the bound is for sensors that err by their noise only");
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[1].noise = {}; }), "[sensor.forward_speed] has no noise");
  EXPECT_EQ(why_not([](Scenario& s) { s.sensors[0].rate_hz = 50.0; }),
            "[sensor.east_position] measures at 50 Hz and truth_rate_hz is 40, but the bound needs the truth at all of these "
            "instants");
  EXPECT_EQ(why_not([](Scenario& s) { s.plant.process_noise_rate_hz = 80.0; }),
            "the plant is pushed at 80 Hz and truth_rate_hz is 40, but the bound needs the truth at all of these instants");
}

}  // namespace
}  // namespace slipstream
