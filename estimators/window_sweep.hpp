// The quadratic program of a window, linearised at x_i, solved stage by stage: a Kalman filter forwards, its adjoint backwards.
//
//   min  1/2 |x_0 + d_0 - xbar|^2_{Pbar^-1} + 1/2 sum_i |e_i - H_i d_i|^2_{R_i^-1} + 1/2 sum_i |w_i|^2_{Q_i^-1}
//   with x_i+1 + d_i+1 = f(x_i) + F_i d_i + w_i+1,   e_i = z_i - h(x_i),   d_ik fixed where x_ik is held at a bound
//
//   forwards   the outputs one after another, h a row of H:  s = h P h' + R,  K = P h'/s,  d += K (e - h d),
//              P = (I - K h) P (I - K h)' + K R K';   a fixed component is an output h = e_k with R = 0;
//              then d = f(x_i) - x_i+1 + F d,  P = F P F' + Q
//   backwards  a_N = 0;  in reverse  a = F' a;  c = (e - h d)/s - K' a,  a += h c;   d_i = d_i^- + P_i^- a_i
//
// a_i is the multiplier of the way into sample i (xbar for i = 0), c of a fixed component the force that holds it. No inverse
// of P or Q is taken: either may be singular. Cost: linear in the window, cubic in the states. Rao, Wright, Rawlings, JOTA 99
// (1998), section 3 (the same recursion for control); Bierman, Factorization Methods for Discrete Sequential Estimation (1977),
// ch. X (adjoint variables); Joseph's form of the update.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "estimators/active_set.hpp"
#include "estimators/kalman.hpp"
#include "estimators/window_linearisation.hpp"

namespace slipstream {

template <ProcessModel M>
class WindowSweep {
 public:
  static constexpr int n = M::kStates, m = M::kOutputs;
  using State = Vector<double, n>;
  using At = WindowLayout<M>;

  WindowSweep(const Belief<M>& belief, const typename At::Rows& rows, const WindowLinearisation<M>& line, int most)
      : belief_(belief),
        rows_(rows),
        line_(line),
        stages_(static_cast<std::size_t>(most) + 1),
        applied_(static_cast<std::size_t>(most * n)) {}

  Gaussian<M> arrival;          // xbar, Pbar
  State scale = State::Ones();  // what the residual and rounding are measured by, per state

  // A new program: forwards without fixed components, up to what is known of the last sample before its measurement.
  void begin() {
    begin_at_arrival();
    std::fill(applied_.begin(), applied_.end(), Side::kFree);
    forward<false>(0, rows_.size() - 1);
  }
  // What is known of sample i without it and what comes after.
  Gaussian<M> prior(int i) const {
    const Stage& s = stages_[static_cast<std::size_t>(i)];
    Gaussian<M> g;
    for (int r = 0; r < n; ++r) {
      g.mean[r] = rows_(At::x + r, i) + s.mean[r];
      for (int c = 0; c < n; ++c) g.covariance(r, c) = s.covariance[r][c];
    }
    return g;
  }
  // Through the last sample. The covariance of what is known of it then, without bounds.
  Matrix<double, n> finish() {
    forward<false>(rows_.size() - 1, rows_.size());
    Matrix<double, n> covariance;
    const Stage& s = stage(rows_.size());
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c) covariance(r, c) = s.covariance[r][c];
    return covariance;
  }
  // As begin() and finish(), with one sample only: what is known of the second before it is measured.
  Gaussian<M> leave() {
    begin_at_arrival();
    forward<false>(0, 1);
    return prior(1);
  }

  // The program of active_set.hpp: component k of sample i is number i n + k.
  bool solve(const Side* side) {
    const int count = rows_.size() * n;
    int changed = 0;
    while (changed < count && side[changed] == applied_[static_cast<std::size_t>(changed)]) ++changed;
    if (changed < count) {
      std::copy(side, side + count, applied_.begin());
      forward<true>(changed / n, rows_.size());
    }
    backward();
    return true;
  }
  double value(int j) const { return rows_(At::x + j % n, j / n) + stage(j / n).d[j % n]; }
  double force(int j) const { return stage(j / n).force[j % n]; }
  double lower(int j) const { return belief_.lower[j % n]; }
  double upper(int j) const { return belief_.upper[j % n]; }
  double slack(int j) const { return 1e-10 * scale[j % n]; }

  double step(int i, int r) const { return stage(i).d[r]; }     // d_i
  double adjoint(int i, int r) const { return stage(i).a[r]; }  // a_i

 private:
  struct Stage {
    double mean[n], covariance[n][n];      // of d_i, before sample i
    double gain[m][n], pull[m];            // K and (e - h d)/s of each output
    double hold_gain[n][n], hold_pull[n];  // likewise of fixed components
    double a[n], d[n], force[n];
  };
  const Stage& stage(int i) const { return stages_[static_cast<std::size_t>(i)]; }

  void begin_at_arrival() {
    Stage& first = stages_[0];
    for (int r = 0; r < n; ++r) {
      first.mean[r] = arrival.mean[r] - rows_(At::x + r, 0);
      for (int c = 0; c < n; ++c) first.covariance[r][c] = arrival.covariance(r, c);
    }
  }

  // One output with variance R.
  template <typename H>
  [[gnu::always_inline]] static inline void absorb(const H& h, double e, double variance, double s_inverse,
                                                   const double (&ph)[n], double (&mean)[n], double (&p)[n][n],
                                                   double (&gain)[n], double& pull) {
    double half[n][n], halfh[n];
    pull = e * s_inverse;
    for (int r = 0; r < n; ++r) gain[r] = ph[r] * s_inverse;
    for (int r = 0; r < n; ++r) mean[r] += gain[r] * e;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) half[r][c] = p[r][c] - gain[r] * ph[c];
      halfh[r] = half[r][0] * h(0);
      for (int c = 1; c < n; ++c) halfh[r] += half[r][c] * h(c);
    }
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c) p[r][c] = p[c][r] = (half[r][c] - halfh[r] * gain[c]) + (variance * gain[r]) * gain[c];
  }

  template <bool kFixed>
  void forward(int from, int to) {
    const int last = rows_.size() - 1;
    double mean[n], p[n][n];
    {
      const Stage& s = stages_[static_cast<std::size_t>(from)];
      for (int r = 0; r < n; ++r) {
        mean[r] = s.mean[r];
        for (int c = 0; c < n; ++c) p[r][c] = s.covariance[r][c];
      }
    }
    for (int i = from; i < to; ++i) {
      Stage& s = stages_[static_cast<std::size_t>(i)];
      for (int k = 0; k < m; ++k) {
        const double variance = rows_(At::variance + k, i);
        if (variance == 0.0) continue;
        const auto h = [&](int c) { return line_.h(i, k, c); };
        double ph[n], e = rows_(At::z + k, i) - line_.output(i, k), variance_of_output = variance;
        for (int r = 0; r < n; ++r) {
          ph[r] = p[r][0] * h(0);
          for (int c = 1; c < n; ++c) ph[r] += p[r][c] * h(c);
        }
        for (int r = 0; r < n; ++r) {
          e -= h(r) * mean[r];
          variance_of_output += h(r) * ph[r];
        }
        absorb(h, e, variance, 1.0 / variance_of_output, ph, mean, p, s.gain[k], s.pull[k]);
      }
      if constexpr (kFixed) {
        for (int k = 0; k < n; ++k) {
          const Side side = applied_[static_cast<std::size_t>(i * n + k)];
          if (side == Side::kFree) continue;
          // Where the others leave nothing of this component, it cannot be moved; a small variance tells what would have to
          // give.
          const double least = 1e-10 * s.covariance[k][k] + 1e-12 * scale[k] * scale[k];
          const double variance = std::max(0.0, least - p[k][k]);
          const double bound = side == Side::kLower ? belief_.lower[k] : belief_.upper[k];
          double ph[n];
          for (int r = 0; r < n; ++r) ph[r] = p[r][k];
          absorb([&](int c) { return c == k ? 1.0 : 0.0; }, bound - rows_(At::x + k, i) - mean[k], variance,
                 1.0 / (p[k][k] + variance), ph, mean, p, s.hold_gain[k], s.hold_pull[k]);
        }
      }
      Stage& next = stages_[static_cast<std::size_t>(i) + 1];
      if (i < last) {
        double fp[n][n], moved[n];
        for (int r = 0; r < n; ++r) {
          moved[r] = line_.reach(i, r) - rows_(At::x + r, i + 1);
          for (int c = 0; c < n; ++c) moved[r] += line_.f(i, r, c) * mean[c];
          for (int c = 0; c < n; ++c) {
            fp[r][c] = line_.f(i, r, 0) * p[0][c];
            for (int k = 1; k < n; ++k) fp[r][c] += line_.f(i, r, k) * p[k][c];
          }
        }
        for (int r = 0; r < n; ++r) {
          mean[r] = moved[r];
          for (int c = 0; c <= r; ++c) {
            double sum = r == c ? rows_(At::q + r, i + 1) : 0.0;
            for (int k = 0; k < n; ++k) sum += fp[r][k] * line_.f(i, c, k);
            p[r][c] = p[c][r] = sum;
          }
        }
      }
      for (int r = 0; r < n; ++r) {
        next.mean[r] = mean[r];
        for (int c = 0; c < n; ++c) next.covariance[r][c] = p[r][c];
      }
    }
  }

  void backward() {
    const int last = rows_.size() - 1;
    double a[n] = {};
    for (int i = last; i >= 0; --i) {
      Stage& s = stages_[static_cast<std::size_t>(i)];
      if (i < last) {
        double back[n];
        for (int r = 0; r < n; ++r) {
          back[r] = line_.f(i, 0, r) * a[0];
          for (int k = 1; k < n; ++k) back[r] += line_.f(i, k, r) * a[k];
        }
        for (int r = 0; r < n; ++r) a[r] = back[r];
      }
      for (int k = n - 1; k >= 0; --k) {
        s.force[k] = 0.0;
        if (applied_[static_cast<std::size_t>(i * n + k)] == Side::kFree) continue;
        double c = s.hold_pull[k];
        for (int r = 0; r < n; ++r) c -= s.hold_gain[k][r] * a[r];
        s.force[k] = c;
        a[k] += c;
      }
      for (int k = m - 1; k >= 0; --k) {
        if (rows_(At::variance + k, i) == 0.0) continue;
        double c = s.pull[k];
        for (int r = 0; r < n; ++r) c -= s.gain[k][r] * a[r];
        for (int r = 0; r < n; ++r) a[r] += line_.h(i, k, r) * c;
      }
      for (int r = 0; r < n; ++r) {
        s.a[r] = a[r];
        s.d[r] = s.mean[r];
        for (int c = 0; c < n; ++c) s.d[r] += s.covariance[r][c] * a[c];
      }
    }
  }

  const Belief<M>& belief_;
  const typename At::Rows& rows_;
  const WindowLinearisation<M>& line_;
  std::vector<Stage> stages_;
  std::vector<Side> applied_;
};

}  // namespace slipstream
