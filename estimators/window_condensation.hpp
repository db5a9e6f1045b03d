// A window without process noise, linearised at x_i, as a program in its first state alone:
//
//   d_i = Phi_i d_0 + c_i,   Phi_i+1 = F_i Phi_i,   c_i+1 = F_i c_i + f(x_i) - x_i+1,   Phi_0 = 1, c_0 = 0
//   min  1/2 d_0' A d_0 - b' d_0,   A = sum_i G_i' V_i G_i,   b = sum_i G_i' V_i (e_i - H_i c_i),   G_i = H_i Phi_i
//
// to which the arrival cost comes (rti.hpp). Beside it the slope of the measurements' cost, a = sum_i G_i' V_i e_i, which is b
// where the trajectory is one. Eight samples are summed at once (pack.hpp), those that fill no pack one by one.
// Bock, Plitt, IFAC World Congress (1984) (condensing); Albersmeyer, Diehl, SIAM J. Optim. 20 (2010).
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "estimators/window_linearisation.hpp"

namespace slipstream {

// The largest of many magnitudes; not a number if one of them is not.
class Largest {
 public:
  void add(double x) {
    const double size = std::abs(x);
    most_ = size > most_ ? size : most_;
    sum_ += size;
  }
  double value() const { return std::isfinite(sum_) ? most_ : std::numeric_limits<double>::quiet_NaN(); }

 private:
  double most_ = 0.0, sum_ = 0.0;
};

template <ProcessModel M>
class WindowCondensation {
 public:
  static constexpr int n = M::kStates, m = M::kOutputs;
  using At = WindowLayout<M>;
  using Rows = typename At::Rows;
  using Line = WindowLinearisation<M>;

  explicit WindowCondensation(int most) : blocks_(static_cast<std::size_t>((most + kLanes) / kLanes + 1)) {}

  // Sums over the samples from `base` on, which is 0, or 1 where the oldest is about to leave.
  Matrix<double, n> curvature;                                // A, lower triangle
  Vector<double, n> slope;                                    // b
  Vector<double, n> pull;                                     // a
  double phi(int r, int c) const { return last_phi_[r][c]; }  // of the newest sample

  // All samples. The largest f(x_i) - x_i+1 in units of `scale` goes to `most`.
  void condense(const Rows& rows, const Line& line, int base, const Vector<double, n>& inverse_scale, Largest& most) {
    first_ = 0;
    curvature.setZero();
    slope.setZero();
    pull.setZero();
    if (base == 1) put(0, 0.0);
    put(base, 1.0);
    for (int i = 0; i < base && i + 1 < rows.size(); ++i)
      for (int r = 0; r < n; ++r) most.add((line.reach(i, r) - rows(At::x + r, i + 1)) * inverse_scale[r]);
    for (int i = base; i + 1 < rows.size(); ++i) {
      double defect[n];
      for (int r = 0; r < n; ++r) {
        defect[r] = line.reach(i, r) - rows(At::x + r, i + 1);
        most.add(defect[r] * inverse_scale[r]);
      }
      move_on(line, i, defect);
    }
    int i = 0;
    if (rows.size() >= kLanes) i = with_widest([&](auto width) { return sum_packs<PackOf<width, kLanes>>(rows, line); });
    for (; i < rows.size(); ++i) sum(rows, line, i);
  }
  // One sample more, where the last one leads to.
  void append(const Rows& rows, const Line& line) {
    const int i = rows.size() - 1;
    if (i == 0) {
      first_ = 0;
      curvature.setZero();
      slope.setZero();
      pull.setZero();
      put(0, 1.0);
    } else {
      double defect[n];
      for (int r = 0; r < n; ++r) defect[r] = line.reach(i - 1, r) - rows(At::x + r, i);
      move_on(line, i - 1, defect);
    }
    sum(rows, line, i);
  }
  void slide() { ++first_; }

  // x_i += part d_i
  void expand(const Vector<double, n>& d, double part, Rows& rows) const {
    for (int i = 0; i < rows.size(); ++i) {
      const Block& b = block(i);
      for (int r = 0; r < n; ++r) {
        double way = b.c[r][lane(i)];
        for (int k = 0; k < n; ++k) way += b.phi[r * n + k][lane(i)] * d[k];
        rows(At::x + r, i) += part * way;
      }
    }
  }

 private:
  static constexpr int kLanes = Rows::kLanes;
  struct alignas(64) Block {
    double phi[n * n][kLanes], c[n][kLanes];
  };

  // Phi_i = scale times the identity, c_i = 0.
  void put(int i, double scale) {
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c < n; ++c) last_phi_[r][c] = r == c ? scale : 0.0;
      last_c_[r] = 0.0;
    }
    store(i);
  }
  void store(int i) {
    Block& b = block(i);
    for (int r = 0; r < n; ++r) {
      b.c[r][lane(i)] = last_c_[r];
      for (int c = 0; c < n; ++c) b.phi[r * n + c][lane(i)] = last_phi_[r][c];
    }
  }
  void move_on(const Line& line, int i, const double (&defect)[n]) {
    double phi[n][n], way[n];
    for (int r = 0; r < n; ++r) {
      way[r] = defect[r];
      for (int k = 0; k < n; ++k) way[r] += line.f(i, r, k) * last_c_[k];
      for (int c = 0; c < n; ++c) {
        phi[r][c] = line.f(i, r, 0) * last_phi_[0][c];
        for (int k = 1; k < n; ++k) phi[r][c] += line.f(i, r, k) * last_phi_[k][c];
      }
    }
    for (int r = 0; r < n; ++r) {
      last_c_[r] = way[r];
      for (int c = 0; c < n; ++c) last_phi_[r][c] = phi[r][c];
    }
    store(i + 1);
  }

  void sum(const Rows& rows, const Line& line, int i) {
    const Block& b = block(i);
    const std::size_t at = lane(i);
    for (int k = 0; k < m; ++k) {
      const double weight = rows(At::weight + k, i), e = rows(At::z + k, i) - line.output(i, k);
      double g[n], left = e;
      for (int r = 0; r < n; ++r) {
        left -= line.h(i, k, r) * b.c[r][at];
        g[r] = line.h(i, k, 0) * b.phi[r][at];
        for (int s = 1; s < n; ++s) g[r] += line.h(i, k, s) * b.phi[s * n + r][at];
      }
      for (int r = 0; r < n; ++r) {
        const double weighted = weight * g[r];
        slope[r] += weighted * left;
        pull[r] += weighted * e;
        for (int s = 0; s <= r; ++s) curvature(r, s) += weighted * g[s];
      }
    }
  }
  // As many samples as fill packs; how many.
  template <typename P>
  int sum_packs(const Rows& rows, const Line& line) {
    P all_a[n][n], all_b[n], all_pull[n];
    for (int r = 0; r < n; ++r) {
      all_b[r] = all_pull[r] = 0.0;
      for (int s = 0; s <= r; ++s) all_a[r][s] = 0.0;
    }
    int i = 0;
    for (; i + kLanes <= rows.size(); i += kLanes) {
      const Block& b = block(i);
      for (int k = 0; k < m; ++k) {
        const P weight = P::load(rows.from(At::weight + k, i));
        const P e = P::load(rows.from(At::z + k, i)) - P::load(line.outputs(i, k));
        P left = e, g[n];
        for (int r = 0; r < n; ++r) {
          left -= P::load(line.hs(i, k, r)) * P::load(b.c[r]);
          g[r] = P::load(line.hs(i, k, 0)) * P::load(b.phi[r]);
          for (int s = 1; s < n; ++s) g[r] += P::load(line.hs(i, k, s)) * P::load(b.phi[s * n + r]);
        }
        for (int r = 0; r < n; ++r) {
          const P weighted = weight * g[r];
          all_b[r] += weighted * left;
          all_pull[r] += weighted * e;
          for (int s = 0; s <= r; ++s) all_a[r][s] += weighted * g[s];
        }
      }
    }
    for (int r = 0; r < n; ++r) {
      slope[r] = sum_of(all_b[r]);
      pull[r] = sum_of(all_pull[r]);
      for (int s = 0; s <= r; ++s) curvature(r, s) = sum_of(all_a[r][s]);
    }
    return i;
  }

  const Block& block(int i) const { return blocks_[static_cast<std::size_t>(first_ + i) / kLanes]; }
  Block& block(int i) { return blocks_[static_cast<std::size_t>(first_ + i) / kLanes]; }
  std::size_t lane(int i) const { return static_cast<std::size_t>(first_ + i) % kLanes; }

  int first_ = 0;
  double last_phi_[n][n], last_c_[n];
  std::vector<Block> blocks_;
};

}  // namespace slipstream
