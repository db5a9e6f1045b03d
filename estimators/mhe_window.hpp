// The window of a moving-horizon estimator: the samples it holds and the two nonlinear programs over it.
//
// Sample i (0 the oldest, N the newest) is an instant: what was measured there, and how the state got there from sample i - 1
// (time passed, mean input). The measurement z_i belongs to x_i; u_i acts from x_{i-1} to x_i.
#pragma once

#include <vector>

#include "estimators/kalman.hpp"
#include "estimators/nlp.hpp"

namespace slipstream {

template <ProcessModel M>
struct WindowSample {
  double dt_s = 0.0;              // from the previous sample
  Vector<double, M::kInputs> u;   // mean over dt_s
  Vector<double, M::kOutputs> z;  // read only where measured
  std::uint32_t measured = 0;
  Vector<double, M::kOutputs> weight;        // of each squared residual: 1/R where measured, else 0
  Vector<double, M::kStates> process_sigma;  // square root of Q over dt_s
};

// Every derivative of one stage in one nested evaluation: grad^2 of the scalar `f`, added to the lower triangle `hessian`.
template <int N, typename F>
void add_hessian(const F& f, const Vector<double, N>& x, Matrix<double, N>& hessian) {
  using Inner = Dual<double, N>;
  const Vector<Inner, N> inner = independent(x);
  const Dual<Inner, N> value = f(independent(inner));
  for (int r = 0; r < N; ++r)
    for (int c = 0; c <= r; ++c) hessian(r, c) += value.grad[static_cast<std::size_t>(r)].grad[static_cast<std::size_t>(c)];
}

// Half the weighted squared residuals of one sample, for any scalar.
template <ProcessModel M, typename T>
T measurement_cost(const M& model, const WindowSample<M>& sample, const Vector<T, M::kStates>& x) {
  const Vector<T, M::kOutputs> h = model.output(x, sample.u);
  T cost = T(0.0);
  for (int k = 0; k < M::kOutputs; ++k) {
    if (sample.weight[k] == 0.0) continue;
    const T residual = sample.z[k] - h[k];
    cost += (0.5 * sample.weight[k]) * (residual * residual);
  }
  return cost;
}

// Multiple shooting with process noise, in units of the estimate's standard deviation s:
//
//   min  1/2 |x_0 - xbar|^2_{Pbar^-1} + 1/2 sum_i |z_i - h(x_i)|^2_{R^-1} + 1/2 sum_i |w_i|^2
//   with x_{i+1} = f(x_i, u_{i+1}) + Q^{1/2} w_i,   lower <= x_i <= upper,   x_i = ref_i + s y_i
//
// Variables in the order y_0, w_0, y_1, w_1, ..., y_N. Rao, Rawlings, Mayne, IEEE TAC 48 (2003) 246-258.
template <ProcessModel M>
class MultipleShooting final : public NonlinearProgram {
 public:
  static constexpr int n = M::kStates;
  using State = Vector<double, n>;

  const Belief<M>* belief = nullptr;
  const std::vector<WindowSample<M>>* samples = nullptr;
  Gaussian<M> arrival;           // xbar, Pbar
  State scale = State::Ones();   // s
  std::vector<State> reference;  // one per sample

  // Call when the above have changed and before solving.
  void prepare() {
    arrival_information_ =
        scale.asDiagonal() * arrival.covariance.llt().solve(Matrix<double, n>::Identity()) * scale.asDiagonal();
    symmetrise(arrival_information_);
  }
  State state(std::span<const double> y, int i) const {
    return reference[static_cast<std::size_t>(i)] + scale.cwiseProduct(map(y, 2 * n * i));
  }

  int intervals() const { return static_cast<int>(samples->size()) - 1; }
  int variables() const override { return n * (2 * intervals() + 1); }
  int constraints() const override { return n * intervals(); }

  void bounds(std::span<double> lower, std::span<double> upper) const override {
    std::fill(lower.begin(), lower.end(), -std::numeric_limits<double>::infinity());
    std::fill(upper.begin(), upper.end(), std::numeric_limits<double>::infinity());
    for (int i = 0; i <= intervals(); ++i)
      for (int k = 0; k < n; ++k) {
        const double ref = reference[static_cast<std::size_t>(i)][k];
        lower[static_cast<std::size_t>(2 * n * i + k)] = (belief->lower[k] - ref) / scale[k];
        upper[static_cast<std::size_t>(2 * n * i + k)] = (belief->upper[k] - ref) / scale[k];
      }
  }

  // Per interval: the identity of y_{i+1}, the dense block of y_i, the diagonal of w_i.
  void jacobian_structure(std::vector<Triplet>& e) const override {
    for (int i = 0; i < intervals(); ++i) {
      for (int r = 0; r < n; ++r) e.push_back({n * i + r, 2 * n * (i + 1) + r});
      for (int r = 0; r < n; ++r)
        for (int c = 0; c < n; ++c) e.push_back({n * i + r, 2 * n * i + c});
      for (int r = 0; r < n; ++r) e.push_back({n * i + r, 2 * n * i + n + r});
    }
  }
  // Per sample: the lower triangle of y_i, then the diagonal of w_i.
  void hessian_structure(std::vector<Triplet>& e) const override {
    for (int i = 0; i <= intervals(); ++i) {
      for (int r = 0; r < n; ++r)
        for (int c = 0; c <= r; ++c) e.push_back({2 * n * i + r, 2 * n * i + c});
      if (i == intervals()) break;
      for (int r = 0; r < n; ++r) e.push_back({2 * n * i + n + r, 2 * n * i + n + r});
    }
  }

  double objective(std::span<const double> y) override {
    const State off = arrival_offset(y);
    double cost = 0.5 * off.dot(arrival_information_ * off);
    for (int i = 0; i <= intervals(); ++i) cost += measurement_cost(belief->model, sample(i), state(y, i));
    for (int i = 0; i < intervals(); ++i) cost += 0.5 * map(y, 2 * n * i + n).squaredNorm();
    return cost;
  }

  void gradient(std::span<const double> y, std::span<double> g) override {
    for (int i = 0; i <= intervals(); ++i) {
      State slope = State::Zero();
      const Dual<double, n> cost = measurement_cost(belief->model, sample(i), independent(state(y, i)));
      for (int k = 0; k < n; ++k) slope[k] = scale[k] * cost.grad[static_cast<std::size_t>(k)];
      if (i == 0) slope += arrival_information_ * arrival_offset(y);
      map(g, 2 * n * i) = slope;
      if (i < intervals()) map(g, 2 * n * i + n) = map(y, 2 * n * i + n);
    }
  }

  void constraint_values(std::span<const double> y, std::span<double> c) override {
    for (int i = 0; i < intervals(); ++i) {
      const WindowSample<M>& next = sample(i + 1);
      const State defect = state(y, i + 1) - transition(belief->model, state(y, i), next.u, next.dt_s) -
                           next.process_sigma.cwiseProduct(map(y, 2 * n * i + n));
      map(c, n * i) = defect.cwiseQuotient(scale);
    }
  }

  void jacobian_values(std::span<const double> y, std::span<double> values) override {
    std::size_t e = 0;
    for (int i = 0; i < intervals(); ++i) {
      const WindowSample<M>& next = sample(i + 1);
      State reached;
      Matrix<double, n> f;
      transition_and_jacobian(belief->model, state(y, i), next.u, next.dt_s, reached, f);
      for (int r = 0; r < n; ++r) values[e++] = 1.0;
      for (int r = 0; r < n; ++r)
        for (int c = 0; c < n; ++c) values[e++] = -f(r, c) * scale[c] / scale[r];
      for (int r = 0; r < n; ++r) values[e++] = -next.process_sigma[r] / scale[r];
    }
  }

  void hessian_values(std::span<const double> y, double sigma, std::span<const double> lambda,
                      std::span<double> values) override {
    std::size_t e = 0;
    for (int i = 0; i <= intervals(); ++i) {
      Matrix<double, n> h = Matrix<double, n>::Zero();
      add_hessian([&](const auto& x) { return stage_lagrangian(x, i, sigma, lambda); }, state(y, i), h);
      h = (scale.asDiagonal() * h * scale.asDiagonal()).eval();
      if (i == 0) h += sigma * arrival_information_;
      for (int r = 0; r < n; ++r)
        for (int c = 0; c <= r; ++c) values[e++] = h(r, c);
      if (i == intervals()) break;
      for (int r = 0; r < n; ++r) values[e++] = sigma;
    }
  }

 private:
  // sigma times the measurement cost minus lambda' f / s: all that is not linear in x_i.
  template <typename T>
  T stage_lagrangian(const Vector<T, n>& x, int i, double sigma, std::span<const double> lambda) const {
    T value = measurement_cost(belief->model, sample(i), x) * sigma;
    if (i == intervals()) return value;
    const WindowSample<M>& next = sample(i + 1);
    const Vector<T, n> reached = transition(belief->model, x, next.u, next.dt_s);
    for (int k = 0; k < n; ++k) value -= reached[k] * (lambda[static_cast<std::size_t>(n * i + k)] / scale[k]);
    return value;
  }
  State arrival_offset(std::span<const double> y) const { return (state(y, 0) - arrival.mean).cwiseQuotient(scale); }
  const WindowSample<M>& sample(int i) const { return (*samples)[static_cast<std::size_t>(i)]; }
  static Eigen::Map<const State> map(std::span<const double> y, int at) { return Eigen::Map<const State>(y.data() + at); }
  static Eigen::Map<State> map(std::span<double> y, int at) { return Eigen::Map<State>(y.data() + at); }

  Matrix<double, n> arrival_information_ = Matrix<double, n>::Identity();
};

// Single shooting on the window's first state, the document's own form (document 002, eqs 3.22-3.23):
//
//   min  1/2 |x_0 - x+|^2_S + 1/2 sum_i |z_i - h(x_i)|^2_V,   x_{i+1} = f(x_i, u_{i+1}),   lower <= x_0 <= upper
//
// No process noise. x_0 = x+ + s y. The bounds are kept on x_0, the program's only variable.
template <ProcessModel M>
class SingleShooting final : public NonlinearProgram {
 public:
  static constexpr int n = M::kStates;
  using State = Vector<double, n>;

  const Belief<M>* belief = nullptr;
  const std::vector<WindowSample<M>>* samples = nullptr;
  State arrival = State::Zero();         // x+
  State arrival_weight = State::Zero();  // diagonal of S
  State scale = State::Ones();           // s

  State state(std::span<const double> y) const { return arrival + scale.cwiseProduct(Eigen::Map<const State>(y.data())); }

  // The Hessian of the objective with respect to x_0, full.
  Matrix<double, n> information(const State& x0) const {
    Matrix<double, n> h = Matrix<double, n>::Zero();
    add_hessian([&](const auto& x) { return cost(x); }, x0, h);
    return h.template selfadjointView<Eigen::Lower>();
  }
  // The newest state that x_0 leads to.
  template <typename T>
  Vector<T, n> roll_out(Vector<T, n> x) const {
    for (std::size_t i = 1; i < samples->size(); ++i) x = transition(belief->model, x, (*samples)[i].u, (*samples)[i].dt_s);
    return x;
  }

  int variables() const override { return n; }
  int constraints() const override { return 0; }
  void bounds(std::span<double> lower, std::span<double> upper) const override {
    for (int k = 0; k < n; ++k) {
      lower[static_cast<std::size_t>(k)] = (belief->lower[k] - arrival[k]) / scale[k];
      upper[static_cast<std::size_t>(k)] = (belief->upper[k] - arrival[k]) / scale[k];
    }
  }
  void jacobian_structure(std::vector<Triplet>&) const override {}
  void hessian_structure(std::vector<Triplet>& e) const override {
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c) e.push_back({r, c});
  }
  double objective(std::span<const double> y) override { return cost(state(y)); }
  void gradient(std::span<const double> y, std::span<double> g) override {
    const Dual<double, n> value = cost(independent(state(y)));
    for (std::size_t k = 0; k < n; ++k) g[k] = scale[static_cast<int>(k)] * value.grad[k];
  }
  void constraint_values(std::span<const double>, std::span<double>) override {}
  void jacobian_values(std::span<const double>, std::span<double>) override {}
  void hessian_values(std::span<const double> y, double sigma, std::span<const double>, std::span<double> values) override {
    const Matrix<double, n> h = information(state(y));
    std::size_t e = 0;
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c) values[e++] = sigma * scale[r] * h(r, c) * scale[c];
  }

 private:
  template <typename T>
  T cost(const Vector<T, n>& x0) const {
    T sum = T(0.0);
    for (int k = 0; k < n; ++k) {
      const T off = x0[k] - arrival[k];
      sum += (0.5 * arrival_weight[k]) * (off * off);
    }
    Vector<T, n> x = x0;
    for (std::size_t i = 0; i < samples->size(); ++i) {
      const WindowSample<M>& s = (*samples)[i];
      if (i > 0) x = transition(belief->model, x, s.u, s.dt_s);
      sum += measurement_cost(belief->model, s, x);
    }
    return sum;
  }
};

}  // namespace slipstream
