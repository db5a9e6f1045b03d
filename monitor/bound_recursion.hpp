// The recursion of the posterior Cramer-Rao bound for one process model (bound.hpp says what it bounds), in covariance form, so
// that process noise and start may be exactly known in some directions:
//
//   P-_k+1 = F P_k F' + Q                                                     F = df/dx at the true state, with the true inputs
//   P^-1   = (P-)^-1 + sum_i (h_i h_i'/R_i + r_i r_i'/(2 R_i^2)),   h_i = dh_i/dx,   r_i = dR_i/dx
//
// f is the flow over an interval, Q what pushes the state at some instants. The second term is the information of a variance
// that depends on the state (Kay 1993, Fundamentals of Statistical Signal Processing I, section 3.9): with a relative noise
// R = rho^2 h^2 + sigma^2 (models/sensors/noise.hpp), so r = 2 rho^2 h dh/dx. An information c c'/s is taken in as a
// measurement of c'x with the variance s: K = P c/(c'P c + s), P = (1 - K c') P (1 - K c')' + s K K'.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "common/jacobian.hpp"
#include "common/schedule.hpp"
#include "models/sensors/noise.hpp"
#include "models/transition.hpp"
#include "monitor/bound.hpp"

namespace slipstream {

template <int n>
class BoundRecursion {
 public:
  explicit BoundRecursion(const Vector<double, n>& start_variance) : P_(start_variance.asDiagonal()) {}

  void advance(const Matrix<double, n>& F) {
    const Matrix<double, n> P = F * P_ * F.transpose();
    P_ = 0.5 * (P + P.transpose());
  }
  void push(const Vector<double, n>& variance) { P_.diagonal() += variance; }

  // R > 0.
  void measure(const Vector<double, n>& h, double R, const Vector<double, n>& r) {
    take_in(h, R);
    if (!r.isZero(0.0)) take_in(r, 2.0 * R * R);
  }

  const Matrix<double, n>& covariance() const { return P_; }

 private:
  void take_in(const Vector<double, n>& c, double s) {
    const Vector<double, n> Pc = P_ * c;
    const Vector<double, n> K = Pc / (c.dot(Pc) + s);
    const Matrix<double, n> A = Matrix<double, n>::Identity() - K * c.transpose();
    P_ = A * P_ * A.transpose() + s * K * K.transpose();
  }

  Matrix<double, n> P_;
};

// What disturbs the state and what is measured of it, as the plant does it.
template <ProcessModel M>
struct BoundProblem {
  struct Sensor {
    int output = 0;  // of the model
    NoiseLaw noise;
    double rate_hz = 0.0;
  };
  M model;
  Vector<double, M::kStates> start_variance = Vector<double, M::kStates>::Zero();
  Vector<double, M::kStates> push_variance = Vector<double, M::kStates>::Zero();
  double push_rate_hz = 0.0;  // at 1/rate, 2/rate, ..., before anything is measured there; 0: never
  std::vector<Sensor> sensors;
};

namespace bound_detail {

// The run's truth as the model's states and inputs.
template <ProcessModel M>
class Trajectory {
 public:
  // A sentence if something is missing, else empty.
  std::string read(const TrueRun& run) {
    std::string missing;
    for (const Quantity& q : M::kStateNames) add(run, std::string(q.name), states_, missing);
    for (const Quantity& q : M::kInputNames) add(run, std::string(q.name), inputs_, missing);
    return missing;
  }
  Vector<double, M::kStates> state(std::size_t k) const {
    Vector<double, M::kStates> x;
    for (int i = 0; i < M::kStates; ++i) x[i] = (*states_[static_cast<std::size_t>(i)])[k];
    return x;
  }
  Vector<double, M::kInputs> input(std::size_t k) const {
    Vector<double, M::kInputs> u;
    for (int i = 0; i < M::kInputs; ++i) u[i] = (*inputs_[static_cast<std::size_t>(i)])[k];
    return u;
  }

 private:
  using Columns = std::vector<const std::vector<double>*>;
  static void add(const TrueRun& run, const std::string& name, Columns& columns, std::string& missing) {
    columns.push_back(run.column(name));
    const bool is_there = columns.back() && columns.back()->size() == run.utime.size();
    if (!is_there && missing.empty()) missing = fmt::format("the run has no truth of {}", name);
  }
  Columns states_, inputs_;
};

}  // namespace bound_detail

// The bound at every sample of the truth, after what is measured there. The truth must be there at every instant at which
// something is pushed or measured; between two samples the inputs are the mean of theirs.
template <ProcessModel M>
Bound trajectory_bound(const BoundProblem<M>& problem, const TrueRun& run) {
  constexpr int n = M::kStates;
  bound_detail::Trajectory<M> truth;
  if (const std::string missing = truth.read(run); !missing.empty()) return missing;

  BoundSeries series;
  for (const Quantity& q : M::kStateNames) series.states.emplace_back(q.name);
  series.variance.resize(n);
  std::vector<Schedule> measuring;
  for (const auto& sensor : problem.sensors) measuring.emplace_back(sensor.rate_hz);
  Schedule pushing(problem.push_rate_hz > 0.0 ? problem.push_rate_hz : 1.0);
  pushing.pass();
  const bool is_pushed = problem.push_rate_hz > 0.0;

  BoundRecursion<n> recursion(problem.start_variance);
  Vector<double, n> x = Vector<double, n>::Zero();
  Vector<double, M::kInputs> u = Vector<double, M::kInputs>::Zero();
  for (std::size_t k = 0; k < run.utime.size(); ++k) {
    const Utime now = run.utime[k];
    Utime due = is_pushed ? pushing.next() : now;
    for (const Schedule& s : measuring) due = std::min(due, s.next());
    if (k == 0) due = std::min(due, Utime{0});  // where the start is known
    if (due < now) return fmt::format("the truth at {:g} s, where it is needed, was not seen", seconds(due));
    const Vector<double, n> here = truth.state(k);
    const Vector<double, M::kInputs> u_here = truth.input(k);
    if (!here.allFinite() || !u_here.allFinite()) return fmt::format("the truth at {:g} s is not known", seconds(now));

    if (k > 0) {
      Vector<double, n> to;
      Matrix<double, n> F;
      transition_and_jacobian(problem.model, x, Vector<double, M::kInputs>(0.5 * (u + u_here)), seconds(now - run.utime[k - 1]),
                              to, F);
      recursion.advance(F);
    }
    if (is_pushed && pushing.next() == now) {
      pushing.pass();
      recursion.push(problem.push_variance);
    }
    x = here;
    u = u_here;
    Vector<double, M::kOutputs> h;
    Matrix<double, M::kOutputs, n> H;
    value_and_jacobian<M::kOutputs>([&](const auto& s) { return problem.model.output(s, u); }, x, h, H);
    for (std::size_t i = 0; i < measuring.size(); ++i) {
      if (measuring[i].next() != now) continue;
      measuring[i].pass();
      const auto& [output, noise, rate_hz] = problem.sensors[i];
      const double R = noise.variance(h[output]);
      if (!(R > 0.0))
        return fmt::format("{} is measured without noise at {:g} s", M::kOutputNames[static_cast<std::size_t>(output)].name,
                           seconds(now));
      const Vector<double, n> h_x = H.row(output).transpose();
      recursion.measure(h_x, R, 2.0 * noise.relative * noise.relative * h[output] * h_x);
    }
    if (!recursion.covariance().allFinite()) return fmt::format("it is not finite at {:g} s", seconds(now));
    series.utime.push_back(now);
    for (int i = 0; i < n; ++i) series.variance[static_cast<std::size_t>(i)].push_back(recursion.covariance()(i, i));
  }
  return series;
}

}  // namespace slipstream
