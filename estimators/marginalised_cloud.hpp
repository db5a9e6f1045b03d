// Particles of which a part is not drawn but known as a Gaussian each: the states that a model declares conditionally linear
// (kLinear), l, given the others, n. A particle is (x_n, mean x_l, covariance P).
//
//   predict   x- = f(x, u, dt),  C = F P F' + Q(dt),  F = df/dx_l at the particle       the whole state as one Gaussian
//   draw      x_n from its marginal N(x-_n, C_nn), and x_l, P become those given the draw: state by state, each drawn one takes
//             C(:, a) / C(a, a) times its deviation to the others. A direction that has no variance is not drawn
//   judge     nu = z - h(x),  S = H P H' + R,  H = dh/dx_l,   log w += log N(nu; 0, S)
//   absorb    K = P H' S^-1,  x_l += K nu,  P = (I - K H) P (I - K H)' + K R K'         (Joseph form)
//   moments   of the mixture: mean and covariance of the points, and the mean of P
//
// That is the Rao-Blackwellised (marginalised) filter of Schoen, Gustafsson and Nordlund, IEEE Trans. Signal Processing 53
// (2005), the mixed case. It is exact where the model is linear in x_l for given x_n, in discrete time; else an extended Kalman
// filter per particle. Runge-Kutta makes a rate that is linear in x_l slightly nonlinear where x_n moves with x_l within a
// step. R as in kalman.hpp: relative noise is expected under the particle's own prediction. A measurement is within reach when
// within 6 deviations of S. F and H by dual numbers. Particles go one by one: the cost is that of N small extended Kalman
// filters.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "common/normal_draws.hpp"
#include "estimators/kalman.hpp"
#include "estimators/particle_set.hpp"

namespace slipstream {

template <ProcessModel M>
class MarginalisedCloud {
  static constexpr int count_linear() {
    int count = 0;
    for (const bool linear : M::kLinear) count += linear ? 1 : 0;
    return count;
  }

 public:
  static constexpr int n = M::kStates;
  static constexpr int m = M::kOutputs;
  static constexpr int kLinear = count_linear();
  static_assert(kLinear > 0, "a model without linear states has nothing to take out of its particles");
  static constexpr bool kIntervals = false;
  using State = Vector<double, n>;
  using Input = Vector<double, M::kInputs>;
  using Set = ParticleSet<n, kLinear*(kLinear + 1) / 2>;  // P's lower triangle goes along

  struct Judgement {  // as ParticleCloud's
    bool finite = true;
    std::uint32_t lost = 0;
    double greatest = 0.0;
    Innovation<M> innovation{};
  };
  struct Ask {
    bool move = true, disturb = true;
    const double* relief = nullptr;
  };

  MarginalisedCloud(const Belief<M>& belief, int particles, Resampling method, const RandomStream& random)
      : belief_(belief), random_(random), draws_(random_), set_(particles, method) {
    const std::size_t deviates = static_cast<std::size_t>(n - kLinear) * set_.padded();
    normals_.resize((deviates + NormalDraws::kBlock - 1) / NormalDraws::kBlock * NormalDraws::kBlock);
  }

  Set& set() { return set_; }
  const Set& set() const { return set_; }
  static bool is_measured(const StepInput& step, std::size_t k) { return (step.measured >> k & 1U) != 0U; }

  void draw(const Gaussian<M>& at) {
    draws_.fill(normals_);
    for (std::size_t i = 0; i < set_.size(); ++i) {
      Gaussian<M> g = at;
      put_drawn(i, g);
    }
    pad();
    set_.forget_weights();
  }

  // As ParticleCloud::judge. Moving is drawing, too.
  Judgement judge(const Input& u, const StepInput& step, const State&, const Ask& ask) {
    if (ask.move && step.dt_s > 0.0) predict(u, step.dt_s);
    Judgement to;
    double zero = 0.0;
    for (int c = 0; c < Set::kColumns; ++c)
      for (std::size_t i = 0; i < set_.size(); ++i) zero += 0.0 * set_.column(c)[i];
    to.finite = zero == 0.0;
    weigh(u, step, to);
    return to;
  }

  // The measurement's share of x_l and P, once it has been weighed.
  void absorb(const Input& u, const StepInput& step) {
    for (std::size_t i = 0; i < set_.size(); ++i) {
      const Particle at = particle(i);
      const Seen seen = look(at, u, step);
      const Matrix<double, kLinear, m> gain = at.covariance * seen.h.transpose() * seen.s.inverse();
      const Vector<double, kLinear> change = gain * seen.off;
      const Matrix<double, kLinear> left = Matrix<double, kLinear>::Identity() - gain * seen.h;
      const Matrix<double, kLinear> half = left * at.covariance;
      const Matrix<double, kLinear, m> weighted = gain * seen.r.asDiagonal();
      put_covariance(i, symmetric_product<kLinear, kLinear>(half, left) + symmetric_product<kLinear, m>(weighted, gain));
      for (int l = 0; l < kLinear; ++l) set_.column(kIndex[static_cast<std::size_t>(l)])[i] += change[l];
    }
    pad();
  }

  typename Set::Moments moments(const State& near) const {
    typename Set::Moments to = set_.moments(near);
    const double* const w = set_.weights();
    for (int r = 0, c = n; r < kLinear; ++r)
      for (int s = 0; s <= r; ++s, ++c) {
        double mean = 0.0;
        for (std::size_t i = 0; i < set_.size(); ++i) mean += w[i] * set_.column(c)[i];
        mean /= set_.total_weight();
        const int row = kIndex[static_cast<std::size_t>(r)], other = kIndex[static_cast<std::size_t>(s)];
        to.covariance(row, other) += mean;
        if (row != other) to.covariance(other, row) += mean;
      }
    return to;
  }

  void resample() { set_.resample(random_); }

 private:
  static constexpr double kReach = 6.0;  // standard deviations, as ParticleCloud's
  static constexpr std::array<int, kLinear> linear_states() {
    std::array<int, kLinear> index{};
    int at = 0;
    for (int s = 0; s < n; ++s)
      if (M::kLinear[static_cast<std::size_t>(s)]) index[static_cast<std::size_t>(at++)] = s;
    return index;
  }
  static constexpr std::array<int, kLinear> kIndex = linear_states();
  static constexpr bool is_linear(int s) { return M::kLinear[static_cast<std::size_t>(s)]; }

  struct Particle {
    State x;
    Matrix<double, kLinear> covariance;
  };
  struct Seen {
    Vector<double, m> off;         // nu; 0 where not measured
    Matrix<double, m, kLinear> h;  // H; 0 there
    Vector<double, m> r;           // 1 there
    Matrix<double, m> s;
    Vector<double, m> predicted;
  };

  Particle particle(std::size_t i) const {
    Particle p;
    p.x = set_.particle(i);
    for (int r = 0, c = n; r < kLinear; ++r)
      for (int s = 0; s <= r; ++s, ++c) p.covariance(r, s) = p.covariance(s, r) = set_.column(c)[i];
    return p;
  }
  void put_covariance(std::size_t i, const Matrix<double, kLinear>& covariance) {
    for (int r = 0, c = n; r < kLinear; ++r)
      for (int s = 0; s <= r; ++s, ++c) set_.column(c)[i] = covariance(r, s);
  }
  void pad() {
    set_.touch();
    for (int c = 0; c < Set::kColumns; ++c) set_.repeat_last(set_.column(c));
  }

  // x with its linear states as independent variables.
  static auto varied(const State& x) {
    Vector<Dual<double, kLinear>, n> d;
    for (int s = 0; s < n; ++s) d[s] = Dual<double, kLinear>(x[s]);
    for (int l = 0; l < kLinear; ++l) {
      const int s = kIndex[static_cast<std::size_t>(l)];
      d[s] = Dual<double, kLinear>::variable(x[s], l);
    }
    return d;
  }
  template <int kRows>
  static void split(const Vector<Dual<double, kLinear>, kRows>& from, Vector<double, kRows>& value,
                    Matrix<double, kRows, kLinear>& jacobian) {
    for (int r = 0; r < kRows; ++r) {
      value[r] = from[r].value;
      for (int l = 0; l < kLinear; ++l) jacobian(r, l) = from[r].grad[static_cast<std::size_t>(l)];
    }
  }

  void predict(const Input& u, double dt_s) {
    draws_.fill(normals_);
    const State q = belief_.process_covariance(dt_s);
    for (std::size_t i = 0; i < set_.size(); ++i) {
      const Particle from = particle(i);
      Gaussian<M> to;
      Matrix<double, n, kLinear> f;
      split<n>(transition(belief_.model, varied(from.x), u, dt_s), to.mean, f);
      const Matrix<double, n, kLinear> half = f * from.covariance;
      to.covariance = symmetric_product<n, kLinear>(half, f);
      to.covariance.diagonal() += q;
      put_drawn(i, to);
    }
    pad();
  }

  // Particle i from a Gaussian of the whole state: draws x_n, and conditions x_l and P on it.
  void put_drawn(std::size_t i, Gaussian<M>& g) {
    constexpr double kNone = 1e-12;  // of a variance: what rounding leaves of one that others explain
    const State whole = g.covariance.diagonal();
    std::size_t row = 0;
    for (int a = 0; a < n; ++a) {
      if (is_linear(a)) continue;
      const double variance = g.covariance(a, a), xi = static_cast<double>(normals_[row++ * set_.padded() + i]);
      if (!(variance > kNone * whole[a])) continue;
      const double deviation = std::sqrt(variance) * xi;
      const State column = g.covariance.col(a);
      g.mean += column * (deviation / variance);
      for (int r = 0; r < n; ++r)
        for (int c = 0; c < n; ++c) g.covariance(r, c) -= column[r] * column[c] / variance;
    }
    set_.put(i, g.mean);
    Matrix<double, kLinear> rest;
    for (int r = 0; r < kLinear; ++r)
      for (int c = 0; c < kLinear; ++c)
        rest(r, c) = g.covariance(kIndex[static_cast<std::size_t>(r)], kIndex[static_cast<std::size_t>(c)]);
    for (int r = 0; r < kLinear; ++r) rest(r, r) = std::max(rest(r, r), 0.0);  // rounding
    put_covariance(i, rest);
  }

  Seen look(const Particle& at, const Input& u, const StepInput& step) const {
    Seen to;
    split<m>(belief_.model.output(varied(at.x), u), to.predicted, to.h);
    for (std::size_t k = 0; k < m; ++k) {
      const auto row = static_cast<int>(k);
      const bool on = is_measured(step, k);
      to.off[row] = on ? step.measured_value[k] - to.predicted[row] : 0.0;
      if (!on) to.h.row(row).setZero();
    }
    const Matrix<double, m, kLinear> half = to.h * at.covariance;
    to.s = symmetric_product<m, kLinear>(half, to.h);
    for (std::size_t k = 0; k < m; ++k) {
      const auto row = static_cast<int>(k);
      to.r[row] = is_measured(step, k) ? belief_.noise[k].variance(to.predicted[row], to.s(row, row)) : 1.0;
      to.s(row, row) += to.r[row];
    }
    return to;
  }

  void weigh(const Input& u, const StepInput& step, Judgement& to) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const double *const l_old = set_.log_weights(), *const w = set_.weights();
    double* const l_new = set_.new_log_weights();
    std::fill_n(l_new, set_.padded(), -kInfinity);
    to.greatest = -kInfinity;
    Vector<double, m> nearest = Vector<double, m>::Constant(kInfinity), mean_off = Vector<double, m>::Zero();
    Matrix<double, m> mean_square = Matrix<double, m>::Zero(), mean_s = Matrix<double, m>::Zero();
    for (std::size_t i = 0; i < set_.size(); ++i) {
      const Seen seen = look(particle(i), u, step);
      const Eigen::LLT<Matrix<double, m>> factor(seen.s);
      const Vector<double, m> white = factor.matrixL().solve(seen.off);
      l_new[i] = l_old[i] - 0.5 * white.squaredNorm();
      for (int k = 0; k < m; ++k) l_new[i] -= std::log(factor.matrixLLT()(k, k));
      if (l_new[i] > to.greatest) to.greatest = l_new[i];
      for (int k = 0; k < m; ++k) {
        const double square = seen.off[k] * seen.off[k] / seen.s(k, k);
        if (square < nearest[k]) nearest[k] = square;
      }
      mean_off += w[i] * seen.off;
      mean_square += w[i] * (seen.off * seen.off.transpose());
      mean_s += w[i] * seen.s;
    }
    const double scale = 1.0 / set_.total_weight();
    mean_off *= scale;
    to.innovation.value = mean_off;
    to.innovation.covariance = (mean_square + mean_s) * scale - mean_off * mean_off.transpose();
    for (std::size_t k = 0; k < m; ++k) {
      const double least = nearest[static_cast<int>(k)];
      if (is_measured(step, k) && least > kReach * kReach && least < kInfinity) to.lost |= 1U << k;
    }
  }

  Belief<M> belief_;
  RandomStream random_;
  NormalDraws draws_;
  Set set_;
  std::vector<float> normals_;
};

}  // namespace slipstream
