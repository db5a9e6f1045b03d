// Unscented Kalman filter, for any process model, whatever form it keeps its covariance in (Spread: ukf.hpp, sqrt_ukf.hpp).
//
//   points    x_0 = x,  x_k+- = x +- r L_k,  P = L L',  and of their images y under a function, with s = 1/(2 r):
//             a_k = s (y_k+ - y_k-),   b_k = s ((y_k+ - y_0) + (y_k- - y_0)),   c = sum b_k / r,   mean = y_0 + c
//   predict   y = f(x, u, dt):   x- = y_0 + c,   P- = sum a_k a_k' + b_k b_k' + g c c' + Q(dt),   g = beta - alpha^2
//   update    with points drawn anew from x-, P-, and theta, phi, e the a, b, c of h:   nu = z - h_0 - e
//             S = sum theta theta' + phi phi' + g e e' + R,   K = (sum L_k theta_k') S^-1,   x = x- + K nu
//             P = sum (L_k - K theta_k)(...)' + K phi_k (...)' + g K e (K e)' + K R K'
//
// These are the sums of sigma_points.hpp with the two points of a column taken together: a is the difference that a Kalman
// filter's Jacobian makes, b what is curved. P is the Joseph form's twin, equal to P- - K S K', and like P- a sum of squares,
// so that it is positive where g >= 0. With g < 0 the term may leave it indefinite: it is then left out (kFallback).
//
// redraw = false uses the predicted points in the update: a for L, b and c of f in the cross covariance too. That saves a
// root and half the points, and lacks Q in S and K: on linear problems it is not the Kalman filter.
//
// R is diagonal; for noise in per cent it is the expected variance under the prediction, as in kalman.hpp:
// R_ii = rel^2 ((h_0 + e)_i^2 + (S - R)_ii) + abs^2. Outputs not measured have rows of zero. As many Runge-Kutta steps as the
// stiffest of the points needs. L_k of a direction without variance is zero. Q and R are discrete covariances. Julier and
// Uhlmann (2004); van der Merwe and Wan (2001); Simon (2006), section 14.3.
//
// Four points go through the model at once (Pack); where n is no multiple of four the middle is one of those that fill up.
#pragma once

#include <algorithm>
#include <memory>

#include "common/pack.hpp"
#include "estimators/gaussian_estimator.hpp"
#include "estimators/sigma_points.hpp"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SLIPSTREAM_CAN_CHOOSE_FOURS 1
#endif

namespace slipstream {

constexpr int packs_of(int numbers) { return (numbers + Pack::kLanes - 1) / Pack::kLanes; }

// Rows of numbers in packs; what fills up the last pack of a row is zero. A matrix' square: P = rows rows'.
template <int Rows, int Packs>
struct RowPacks {
  Pack at[Rows][Packs];

  double dot(int i, int j) const {
    Pack sum = at[i][0] * at[j][0];
    for (int g = 1; g < Packs; ++g) sum += at[i][g] * at[j][g];
    return sum.sum();
  }
};

// The g-th pack of the numbers that number(k) gives, k < Count.
template <int Count, typename F>
Pack pack_of(int g, const F& number) {
  const auto or_zero = [&](int k) { return k < Count ? number(k) : 0.0; };
  const int k = g * Pack::kLanes;
  return {or_zero(k), or_zero(k + 1), or_zero(k + 2), or_zero(k + 3)};
}

template <int N>
RowPacks<N, packs_of(N)> rows_of(const double (&l)[N][N]) {
  RowPacks<N, packs_of(N)> rows;
  for (int i = 0; i < N; ++i)
    for (int g = 0; g < packs_of(N); ++g) rows.at[i][g] = pack_of<N>(g, [&](int k) { return k <= i ? l[i][k] : 0.0; });
  return rows;
}

template <ProcessModel M, template <int> class Spread>
class Unscented final : public GaussianEstimator<M> {
  static constexpr int n = M::kStates, m = M::kOutputs;
  static constexpr int kGroups = packs_of(n);
  static constexpr bool kMiddleApart = n % Pack::kLanes == 0;
  static constexpr int kSets = 2 * kGroups + (kMiddleApart ? 1 : 0);  // upwards, downwards, the middle
  using State = Vector<double, n>;
  using Input = Vector<double, M::kInputs>;

 public:
  Unscented(const Belief<M>& belief, const SigmaPoints& points, bool redraw)
      : GaussianEstimator<M>(belief), points_(points), redraw_(redraw) {}

  void step(const StepInput& step) override {
#ifdef SLIPSTREAM_CAN_CHOOSE_FOURS
    if (fours_) return advance_by_fours(step);
#endif
    advance_by_twos(step);
  }

 private:
  void on_start() override { spread_.start(this->estimate_.covariance); }

#ifdef SLIPSTREAM_CAN_CHOOSE_FOURS
  [[gnu::target("avx2"), gnu::flatten]] void advance_by_fours(const StepInput& step) { advance(step); }
  bool fours_ = __builtin_cpu_supports("avx2") != 0;
#endif
  [[gnu::flatten]] void advance_by_twos(const StepInput& step) { advance(step); }

  // a, b, c and the mean of N-vectors y.
  template <int N>
  struct Image {
    RowPacks<N, 2 * kGroups> differences;  // a, then b
    Vector<double, N> bend, mean;          // c; y_0 + c
  };

  void advance(const StepInput& step) {
    const Input u = this->input_of(step);
    State& x = this->estimate_.mean;
    bool sound = true, drawn = false;
    Vector<Pack, n> at[kSets];
    Image<n> moved;
    const State q = step.dt_s > 0.0 ? this->belief_.process_covariance(step.dt_s) : State(State::Zero());
    if (step.dt_s > 0.0) {
      draw(x, spread_.root(), at);
      propagate(u, step.dt_s, at);
      image(at, moved);
      x = moved.mean;
      sound = spread_.assign(moved.differences, q, points_.middle, moved.bend);
      drawn = !redraw_;
    }
    sound &= drawn ? update<false>(step, u, at, moved, q) : update<true>(step, u, at, moved, q);
    spread_.covariance_into(this->estimate_.covariance);
    this->settle(sound ? EstimateStatus::kValid : EstimateStatus::kFallback);
  }

  void draw(const State& x, const RowPacks<n, kGroups>& root, Vector<Pack, n>* at) const {
    for (int i = 0; i < n; ++i) {
      const Pack middle = x[i];
      for (int g = 0; g < kGroups; ++g) {
        const Pack way = points_.reach * root.at[i][g];
        at[g][i] = middle + way;
        at[kGroups + g][i] = middle - way;
      }
      if constexpr (kMiddleApart) at[2 * kGroups][i] = middle;
    }
  }

  void propagate(const Input& u, double dt_s, Vector<Pack, n>* at) const {
    const M& model = this->belief_.model;
    double fastest_rate_hz = 0.0;
    for (int s = 0; s < kSets; ++s)
      for (int lane = 0; lane < (s < 2 * kGroups ? Pack::kLanes : 1); ++lane) {
        State x;
        for (int i = 0; i < n; ++i) x[i] = at[s][i][lane];
        fastest_rate_hz = std::max(fastest_rate_hz, static_cast<double>(model.fastest_rate_hz(x)));
      }
    const int steps = transition_steps(fastest_rate_hz, dt_s);
    if (steps > 1) return propagate_divided(u, dt_s, steps, at);
    for (int s = 0; s < kSets; ++s) at[s] = single_transition(model, at[s], u, dt_s);
  }
  [[gnu::noinline]] void propagate_divided(const Input& u, double dt_s, int steps, Vector<Pack, n>* at) const {
    for (int s = 0; s < kSets; ++s)
      for (int i = 0; i < steps; ++i) at[s] = single_transition(this->belief_.model, at[s], u, dt_s / steps);
  }

  template <int N>
  void image(const Vector<Pack, N>* y, Image<N>& to) const {
    const double half = 0.5 / points_.reach;
    for (int i = 0; i < N; ++i) {
      const Pack middle = kMiddleApart ? y[kSets - 1][i] : Pack(y[kGroups - 1][i][Pack::kLanes - 1]);
      Pack sum = 0.0;
      for (int g = 0; g < kGroups; ++g) {
        const Pack &up = y[g][i], &down = y[kGroups + g][i];
        to.differences.at[i][g] = half * (up - down);
        sum += to.differences.at[i][kGroups + g] = half * ((up - middle) + (down - middle));
      }
      to.bend[i] = sum.sum() / points_.reach;
      to.mean[i] = middle[0] + to.bend[i];
    }
  }

  template <bool kRedrawn>
  bool update(const StepInput& step, const Input& u, Vector<Pack, n>* at, Image<n>& moved, const State& q) {
    State& x = this->estimate_.mean;
    Innovation<M>& i = this->innovation_;
    if constexpr (kRedrawn) {
      const RowPacks<n, kGroups> root = spread_.root();
      draw(x, root, at);
      for (int r = 0; r < n; ++r)
        for (int g = 0; g < kGroups; ++g) moved.differences.at[r][g] = root.at[r][g];
    }
    Vector<Pack, m> y[kSets];
    for (int s = 0; s < kSets; ++s) y[s] = this->belief_.model.output(at[s], u);
    Image<m> seen;
    image(y, seen);
    RowPacks<n, 2 * kGroups + packs_of(m)> rows;
    for (int k = 0; k < m; ++k) {
      if ((step.measured >> k & 1U) != 0U) {
        i.value[k] = step.measured_value[static_cast<std::size_t>(k)] - seen.mean[k];
        const double variance = seen.differences.dot(k, k) + points_.middle * seen.bend[k] * seen.bend[k];
        i.noise[k] = this->belief_.noise[static_cast<std::size_t>(k)].variance(seen.mean[k], variance);
      } else {
        i.value[k] = seen.bend[k] = 0.0;
        i.noise[k] = 1.0;
        for (int g = 0; g < 2 * kGroups; ++g) seen.differences.at[k][g] = 0.0;
      }
    }
    Spread<m> s;
    bool sound = s.assign(seen.differences, i.noise, points_.middle, seen.bend);
    s.covariance_into(i.covariance);

    for (int r = 0; r < n; ++r)
      for (int k = 0; k < m; ++k) {
        Pack sum = moved.differences.at[r][0] * seen.differences.at[k][0];
        for (int g = 1; g < (kRedrawn ? 1 : 2) * kGroups; ++g) sum += moved.differences.at[r][g] * seen.differences.at[k][g];
        i.ph(r, k) = sum.sum();
        if constexpr (!kRedrawn) i.ph(r, k) += points_.middle * moved.bend[r] * seen.bend[k];
      }
    const Matrix<double, n, m> gain = s.divide(i.ph);
    State bend;
    const Vector<double, m> deviation = i.noise.cwiseSqrt();
    for (int r = 0; r < n; ++r) {
      for (int g = 0; g < 2 * kGroups; ++g) {
        Pack sum = gain(r, 0) * seen.differences.at[0][g];
        for (int k = 1; k < m; ++k) sum += gain(r, k) * seen.differences.at[k][g];
        rows.at[r][g] = kRedrawn && g >= kGroups ? -sum : moved.differences.at[r][g] - sum;
      }
      for (int g = 0; g < packs_of(m); ++g)
        rows.at[r][2 * kGroups + g] = pack_of<m>(g, [&](int k) { return gain(r, k) * deviation[k]; });
      double of_bend = gain(r, 0) * seen.bend[0], of_value = gain(r, 0) * i.value[0];
      for (int k = 1; k < m; ++k) {
        of_bend += gain(r, k) * seen.bend[k];
        of_value += gain(r, k) * i.value[k];
      }
      bend[r] = kRedrawn ? -of_bend : moved.bend[r] - of_bend;
      x[r] += of_value;
    }
    return spread_.assign(rows, kRedrawn ? State(State::Zero()) : q, points_.middle, bend) && sound;
  }

  SigmaPoints points_;
  bool redraw_;
  Spread<n> spread_;
};

template <template <int> class Spread>
std::unique_ptr<Estimator> make_unscented(const Scenario& scenario, const Tuning& tuning) {
  return std::visit(
      [&]<typename M>(const M& model) -> std::unique_ptr<Estimator> {
        const SigmaPoints points = sigma_points(M::kStates, "states", tuning.ukf_alpha, tuning.ukf_beta, tuning.ukf_kappa);
        return std::make_unique<Unscented<M, Spread>>(make_belief(model, scenario, tuning), points, tuning.ukf_redraw);
      },
      tuning.process ? *tuning.process : scenario.estimator.process);
}

}  // namespace slipstream
