// A process model along the trajectory of a window: f(x_i, u_i+1), df/dx, h(x_i, u_i), dh/dx of every sample.
//
// The points are known in advance, so eight samples go through the model at once, as dual numbers over packs (pack_dual.hpp),
// where the model takes inputs of their own for each; else, and where an interval needs more than one Runge-Kutta step, one by
// one.
#pragma once

#include <vector>

#include "common/pack_dual.hpp"
#include "common/widest.hpp"
#include "estimators/window_rows.hpp"
#include "models/transition.hpp"

namespace slipstream {

template <ProcessModel M>
struct WindowLayout {
  static constexpr int n = M::kStates, m = M::kOutputs;
  // Rows: the state; the mean input and the time from the sample before; the measurement, its variance (0: not measured) and
  // 1/variance; the process noise's variance on the way from the sample before.
  static constexpr int x = 0, u = x + n, dt = u + M::kInputs, z = dt + 1, variance = z + m, weight = variance + m,
                       q = weight + m, kRows = q + n;
  using Rows = WindowRows<kRows>;
};

template <ProcessModel M>
class WindowLinearisation {
 public:
  static constexpr int n = M::kStates, m = M::kOutputs;
  using At = WindowLayout<M>;
  using Rows = typename At::Rows;
  static constexpr int kLanes = Rows::kLanes;

  explicit WindowLinearisation(int most) : blocks_(static_cast<std::size_t>((most + kLanes) / kLanes + 1)) {}

  // Of sample i.
  double reach(int i, int r) const { return block(i).reach[r][lane(i)]; }         // f_r(x_i, u_i+1)
  double f(int i, int r, int c) const { return block(i).f[r * n + c][lane(i)]; }  // df_r/dx_c
  double output(int i, int k) const { return block(i).output[k][lane(i)]; }       // h_k(x_i, u_i)
  double h(int i, int k, int c) const { return block(i).h[k * n + c][lane(i)]; }  // dh_k/dx_c

  // Likewise of as many samples as a pack has, from i on, which must be the first of a pack of those last evaluated.
  const double* outputs(int i, int k) const { return &block(i).output[k][lane(i)]; }
  const double* hs(int i, int k, int c) const { return &block(i).h[k * n + c][lane(i)]; }

  // All samples; of the last one there is no f yet.
  void evaluate(const M& model, const Rows& rows) {
    first_ = 0;
    if constexpr (TakesPackedInputs<M>) {
      with_widest([&](auto width) {
        for (int i = 0; i < rows.size(); i += kLanes)
          if (together<PackOf<width, kLanes>>(model, rows, i)) divide(model, rows, i);
      });
    } else {
      for (int i = 0; i < rows.size(); ++i) {
        evaluate_output(model, rows, i);
        if (i + 1 < rows.size()) evaluate_transition(model, rows, i);
      }
    }
  }
  // From sample i to i + 1.
  void evaluate_transition(const M& model, const Rows& rows, int i) {
    Vector<double, n> to;
    Matrix<double, n> f;
    transition_and_jacobian(model, state(rows, i), input(rows, i + 1), rows(At::dt, i + 1), to, f);
    Block& b = block(i);
    for (int r = 0; r < n; ++r) {
      b.reach[r][lane(i)] = to[r];
      for (int c = 0; c < n; ++c) b.f[r * n + c][lane(i)] = f(r, c);
    }
  }
  void evaluate_output(const M& model, const Rows& rows, int i) {
    Vector<double, m> y;
    Matrix<double, m, n> h;
    const Vector<double, M::kInputs> u = input(rows, i);
    value_and_jacobian<m>([&](const auto& x) { return model.output(x, u); }, state(rows, i), y, h);
    Block& b = block(i);
    for (int k = 0; k < m; ++k) {
      b.output[k][lane(i)] = y[k];
      for (int c = 0; c < n; ++c) b.h[k * n + c][lane(i)] = h(k, c);
    }
  }
  // The oldest sample has left: what was i + 1 is i.
  void slide() { ++first_; }

 private:
  struct alignas(64) Block {
    double reach[n][kLanes], f[n * n][kLanes], output[m][kLanes], h[m * n][kLanes];
  };

  static Vector<double, n> state(const Rows& rows, int i) {
    Vector<double, n> x;
    for (int r = 0; r < n; ++r) x[r] = rows(At::x + r, i);
    return x;
  }
  static Vector<double, M::kInputs> input(const Rows& rows, int i) {
    Vector<double, M::kInputs> u;
    for (int r = 0; r < M::kInputs; ++r) u[r] = rows(At::u + r, i);
    return u;
  }

  // The intervals of a block that are too long for one Runge-Kutta step.
  [[gnu::noinline]] void divide(const M& model, const Rows& rows, int from) {
    for (int i = from; i < from + kLanes && i + 1 < rows.size(); ++i)
      if (transition_steps(model, state(rows, i), rows(At::dt, i + 1)) > 1) evaluate_transition(model, rows, i);
  }

  // Eight samples from i on, those past the end among them. True: an interval may be too long for one step.
  template <typename P>
  bool together(const M& model, const Rows& rows, int i) {
    using D = Dual<P, n>;
    Vector<P, n> x;
    Vector<P, M::kInputs> u, u_next;
    for (int r = 0; r < n; ++r) x[r] = P::load(rows.from(At::x + r, i));
    for (int r = 0; r < M::kInputs; ++r)
      u[r] = P::load(rows.from(At::u + r, i)), u_next[r] = P::load(rows.from(At::u + r, i + 1));
    const Vector<D, n> at = independent(x);
    const P dt_s = P::load(rows.from(At::dt, i + 1));
    const Vector<D, n> to = single_transition(model, at, u_next, dt_s);
    const Vector<D, m> y = model.output(at, u);
    Block& b = block(i);
    for (int r = 0; r < n; ++r) {
      to[r].value.store(b.reach[r]);
      for (int c = 0; c < n; ++c) to[r].grad[static_cast<std::size_t>(c)].store(b.f[r * n + c]);
    }
    for (int k = 0; k < m; ++k) {
      y[k].value.store(b.output[k]);
      for (int c = 0; c < n; ++c) y[k].grad[static_cast<std::size_t>(c)].store(b.h[k * n + c]);
    }
    return any_less(P(1.0), 0.5 * dt_s * model.fastest_rate_hz(x));
  }

  const Block& block(int i) const { return blocks_[static_cast<std::size_t>(first_ + i) / kLanes]; }
  Block& block(int i) { return blocks_[static_cast<std::size_t>(first_ + i) / kLanes]; }
  std::size_t lane(int i) const { return static_cast<std::size_t>(first_ + i) % kLanes; }

  int first_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace slipstream
