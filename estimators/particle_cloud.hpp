// The particles of a process model: what every particle filter here does to them, many at a time.
//
//   move      x_i = f(x_i, u, dt)                     f: Runge-Kutta as in models/transition.hpp; eight particles take the
//   number
//                                                     of steps that the fastest of them needs
//   disturb   x_i += sqrt(Q(dt)) xi,  xi ~ N(0, I)    a random walk; only states whose process variance is positive are drawn
//   judge     h_i = h(x_i, u),  l_i += log p(z | x_i),  -2 log p = sum_k (z_k - h_ik)^2/R_ik + log R_ik,
//             R_ik = rel^2 h_ik^2 + abs^2             (the logarithm of an R that all share is left out)
//             innovation z - mean of h, its covariance that of h plus the mean of R, both under the weights before z
//   scatter   a set that has lost the state is drawn anew (see particle_estimator.hpp)
//
// One pass over memory does all three. Q and R are discrete here; sqrt(Q) is the deviation of one step's draw.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/normal_draws.hpp"
#include "estimators/kalman.hpp"
#include "estimators/particle_set.hpp"

namespace slipstream {

template <ProcessModel M>
class ParticleCloud {
 public:
  static constexpr int n = M::kStates;
  static constexpr int m = M::kOutputs;
  static constexpr bool kIntervals = true;  // each particle is a point
  using State = Vector<double, n>;
  using Input = Vector<double, M::kInputs>;

  // What judge() saw.
  struct Judgement {
    bool finite = true;          // all particles
    std::uint32_t lost = 0;      // bit k: z_k is beyond the reach of all particles
    double greatest = 0.0;       // of the new log-weights
    Innovation<M> innovation{};  // value and covariance
  };

  ParticleCloud(const Belief<M>& belief, int particles, Resampling method, const RandomStream& random)
      : belief_(belief), random_(random), draws_(random_), set_(particles, method) {
    for (int s = 0; s < n; ++s) noisy_ += belief_.process_variance[s] > 0.0 ? 1 : 0;
    normals_.resize(static_cast<std::size_t>(n) * set_.padded() + NormalDraws::kBlock);
  }

  ParticleSet<n>& set() { return set_; }
  const ParticleSet<n>& set() const { return set_; }

  // Draws the set from mean and covariance, P = L D L'.
  void draw(const Gaussian<M>& at) {
    const Eigen::LDLT<Matrix<double, n>> factor(at.covariance);
    const Matrix<double, n> root = factor.transpositionsP().transpose() * Matrix<double, n>(factor.matrixL()) *
                                   factor.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal();
    draw_normals(n);
    for (std::size_t i = 0; i < set_.padded(); ++i) {
      State xi;
      for (int s = 0; s < n; ++s) xi[s] = static_cast<double>(normals(s)[i]);
      set_.put(i, at.mean + root * xi);
    }
    set_.forget_weights();
  }

  // Moves the set over dt and disturbs it, each where asked (dt > 0), then judges it by what `step` measures. `near` is where
  // the state is thought to be. New log-weights wait in set(): those of the set, less `relief` (of each particle) where given.
  struct Ask {
    bool move = true, disturb = true;
    const double* relief = nullptr;
  };
  Judgement judge(const Input& u, const StepInput& step, const State& near, const Ask& ask) {
    const bool moves = ask.move && step.dt_s > 0.0;
    const bool moves_at_once = moves && !needs_divided_steps(step.dt_s);
    if (moves && !moves_at_once) move_in_divided_steps(u, step.dt_s);
    set_.touch();
    State sigma = State::Zero();
    if (ask.disturb && step.dt_s > 0.0) {
      sigma = belief_.process_covariance(step.dt_s).cwiseMax(0.0).cwiseSqrt();
      draw_normals(noisy_);
    }
    Judgement to;
    Sums sums;
    pass(u, step, moves_at_once, sigma, near, ask.relief, to, sums);
    innovate(step, sums, to.innovation);
    return to;
  }

  static bool is_measured(const StepInput& step, std::size_t k) { return (step.measured >> k & 1U) != 0U; }
  typename ParticleSet<n>::Moments moments(const State& near) const { return set_.moments(near); }
  void resample(std::vector<double>* along = nullptr) { set_.resample(random_, along); }

 private:
  static constexpr double kReach = 6.0;  // standard deviations: nothing Gaussian of this bench is further off in its lifetime
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  static constexpr double kLeastVariance = 1e-300;  // where the law is relative and h is 0; else lost in rounding

  // Particles that a derivative is evaluated for at once: as many as keep a processor busy, whose operations wait for each
  // other, and as a state leaves registers for. No particle's result depends on it.
  template <int kWidth>
  static constexpr int kMoved = kWidth == 2 ? 8
                                : n <= 2    ? 32
                                            : 2 * kWidth;
  static constexpr int kGroup = 8;  // that take the same number of divided steps

  struct Sums {  // under the weights before z, about `centre`
    Vector<double, m> centre, first;
    Matrix<double, m> second;
  };

  const float* normals(int row) const { return normals_.data() + static_cast<std::size_t>(row) * set_.padded(); }
  // `rows` arrays of deviates, whose padding repeats the last particle's.
  void draw_normals(int rows) {
    const std::size_t padded = set_.padded(), all = static_cast<std::size_t>(rows) * padded;
    draws_.fill({normals_.data(), (all + NormalDraws::kBlock - 1) / NormalDraws::kBlock * NormalDraws::kBlock});
    for (int r = 0; r < rows; ++r) {
      float* const row = normals_.data() + static_cast<std::size_t>(r) * padded;
      for (std::size_t i = set_.size(); i < padded; ++i) row[i] = row[set_.size() - 1];
    }
  }

  bool needs_divided_steps(double dt_s) const {
    double most = 0.0;
    with_widest([&](auto width) {
      using P = PackOf<width, kSumLanes>;
      const M model = belief_.model;
      const double* const x = set_.column(0);
      const std::size_t padded = set_.padded();
      P greatest(0.0);
      for (std::size_t i = 0; i < padded; i += P::kLanes)
        greatest = max(model.fastest_rate_hz(load<P>(x, i, padded)), greatest);
      for (int lane = 0; lane < P::kLanes; ++lane) most = std::max(most, greatest[lane]);
    });
    return transition_steps(most, dt_s) > 1;
  }

  void move_in_divided_steps(const Input& u, double dt_s) {
    with_widest([&](auto width) {
      using P = PackOf<width, kGroup>;
      const M model = belief_.model;
      double* const to = set_.column(0);
      const std::size_t padded = set_.padded();
      for (std::size_t i = 0; i < padded; i += P::kLanes) {
        Vector<P, n> x = load<P>(to, i, padded);
        const P rate = model.fastest_rate_hz(x);
        double most = 0.0;
        for (int lane = 0; lane < P::kLanes; ++lane) most = std::max(most, rate[lane]);
        const int steps = transition_steps(most, dt_s);
        for (int k = 0; k < steps; ++k) x = single_transition(model, x, u, dt_s / steps);
        store(x, to, i, padded);
      }
    });
  }

  template <typename P>
  static Vector<P, n> load(const double* from, std::size_t i, std::size_t padded) {
    Vector<P, n> x;
    for (int s = 0; s < n; ++s) x[s] = P::load(from + static_cast<std::size_t>(s) * padded + i);
    return x;
  }
  template <typename P>
  static void store(const Vector<P, n>& x, double* to, std::size_t i, std::size_t padded) {
    for (int s = 0; s < n; ++s) x[s].store(to + static_cast<std::size_t>(s) * padded + i);
  }

  // Pushes each particle in its noise; moves it before where asked.
  template <typename P, bool kMoves>
  static void advance(const M& model, const Input& u, double dt_s, const State& sigma, double* x_all, const float* normal,
                      std::size_t begin, std::size_t end, std::size_t padded, bool& finite) {
    P zero(0.0);
    for (std::size_t i = begin; i < end; i += P::kLanes) {
      Vector<P, n> x = load<P>(x_all, i, padded);
      if constexpr (kMoves) x = single_transition(model, x, u, dt_s);
      std::size_t row = 0;
      for (int s = 0; s < n; ++s)
        if (sigma[s] > 0.0) x[s] += sigma[s] * P::load(normal + row++ * padded + i);
      P sum = x[0];
      for (int s = 1; s < n; ++s) sum += x[s];
      zero += 0.0 * sum;
      store(x, x_all, i, padded);
    }
    finite &= sum_of(zero) == 0.0;
  }

  // One measured output: h beside the others', log-weights, sums.
  struct Output {
    double z, relative2, absolute2, centre;
  };
  template <typename P, int k, bool kRelative>
  static void weigh_output(const M& model, const Input& u, const Output& o, const double* x_all, const double* w_all,
                           const double* l_from, double* l_to, double* h_of_block, std::size_t begin, std::size_t end,
                           std::size_t padded, P& least_of_all, P& first_of_all, P& second_of_all, P& greatest_of_all) {
    const double z = o.z, relative2 = o.relative2, absolute2 = o.absolute2, precision = 1.0 / absolute2, centre = o.centre;
    P least = least_of_all, first = first_of_all, second = second_of_all, greatest(-kInfinity);
    for (std::size_t i = begin; i < end; i += P::kLanes) {
      const P h = model.output(load<P>(x_all, i, padded), u)[k];
      const P off = z - h;
      P square = off * off, constant(0.0);
      if constexpr (kRelative) {
        const P r = relative2 * (h * h) + absolute2;
        square /= r;
        constant = log(r);
      } else {
        square *= precision;
      }
      const P l = P::load(l_from + i) - 0.5 * (square + constant);
      l.store(l_to + i);
      greatest = max(l, greatest);
      least = min(square, least);
      const P d = h - centre;
      d.store(h_of_block + (i - begin));
      const P weighted = P::load(w_all + i) * d;
      first += weighted;
      second += weighted * d;
    }
    least_of_all = least;
    first_of_all = first;
    second_of_all = second;
    greatest_of_all = greatest;
  }

  // The one pass, by blocks that stay in the nearest memory: move, disturb, h, log-weights, sums.
  void pass(const Input& input, const StepInput& step, bool moves, const State& deviation, const State& near,
            const double* relief, Judgement& to, Sums& sums) {
    sums.centre = belief_.model.output(near, input);
    for (int k = 0; k < m; ++k)
      if (!std::isfinite(sums.centre[k])) sums.centre[k] = 0.0;
    with_widest([&](auto width) {
      using P = PackOf<width, kSumLanes>;
      constexpr std::size_t kBlock = 256;
      const M model = belief_.model;
      const Input u = input;
      const State sigma = deviation;
      const std::size_t padded = set_.padded();
      double* const x = set_.column(0);
      double* const l_new = set_.new_log_weights();
      const double* const w = set_.weights();
      double h[m][kBlock];
      P least[m], first[m], second[m][m];
      for (int k = 0; k < m; ++k) {
        least[k] = P(kInfinity);
        first[k] = P(0.0);
        for (int j = 0; j <= k; ++j) second[k][j] = P(0.0);
      }
      P greatest(-kInfinity);
      for (std::size_t begin = 0; begin < padded; begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, padded);
        using Q = PackOf<width, kMoved<width>>;
        if (moves) {
          advance<Q, true>(model, u, step.dt_s, sigma, x, normals_.data(), begin, end, padded, to.finite);
        } else {
          advance<Q, false>(model, u, step.dt_s, sigma, x, normals_.data(), begin, end, padded, to.finite);
        }
        const double* l_from = set_.log_weights();
        if (relief) {
          for (std::size_t i = begin; i < end; i += P::kLanes) (P::load(l_from + i) - P::load(relief + i)).store(l_new + i);
          l_from = l_new;
        }
        P block_greatest(-kInfinity);
        [&]<std::size_t... k>(std::index_sequence<k...>) {
          (
              [&] {
                if (!is_measured(step, k)) return;
                const NoiseLaw& law = belief_.noise[k];
                const Output o{step.measured_value[k], law.relative * law.relative,
                               law.absolute * law.absolute + kLeastVariance, sums.centre[k]};
                if (law.relative != 0.0) {
                  weigh_output<P, k, true>(model, u, o, x, w, l_from, l_new, h[k], begin, end, padded, least[k], first[k],
                                           second[k][k], block_greatest);
                } else {
                  weigh_output<P, k, false>(model, u, o, x, w, l_from, l_new, h[k], begin, end, padded, least[k], first[k],
                                            second[k][k], block_greatest);
                }
                l_from = l_new;
              }(),
              ...);
        }
        (std::make_index_sequence<m>());
        for (int k = 0; k < m; ++k)
          for (int j = 0; j < k; ++j)
            if (is_measured(step, k) && is_measured(step, j))
              for (std::size_t i = begin; i < end; i += P::kLanes)
                second[k][j] += P::load(w + i) * (P::load(h[k] + (i - begin)) * P::load(h[j] + (i - begin)));
        greatest = max(block_greatest, greatest);
      }
      to.greatest = -kInfinity;
      for (int lane = 0; lane < P::kLanes; ++lane) to.greatest = std::max(to.greatest, greatest[lane]);
      for (int k = 0; k < m; ++k) {
        if (!is_measured(step, k)) continue;
        double nearest = kInfinity;
        for (int lane = 0; lane < P::kLanes; ++lane) nearest = std::min(nearest, least[k][lane]);
        if (nearest > kReach * kReach && nearest < kInfinity) to.lost |= 1U << k;  // beyond all numbers: left out, not lost
        sums.first[k] = sum_of(first[k]);
        for (int j = 0; j <= k; ++j) sums.second(k, j) = sums.second(j, k) = sum_of(second[k][j]);
      }
    });
  }

  void innovate(const StepInput& step, const Sums& sums, Innovation<M>& to) const {
    const double scale = 1.0 / set_.total_weight();
    to.value.setZero();
    to.covariance.setIdentity();
    for (int k = 0; k < m; ++k) {
      if (!is_measured(step, k)) continue;
      const auto at = static_cast<std::size_t>(k);
      const double off = sums.first[k] * scale, mean = sums.centre[k] + off;
      to.value[k] = step.measured_value[at] - mean;
      for (int j = 0; j <= k; ++j)
        if (is_measured(step, j))
          to.covariance(k, j) = to.covariance(j, k) = sums.second(k, j) * scale - off * (sums.first[j] * scale);
      const double spread = std::max(to.covariance(k, k), 0.0);
      to.covariance(k, k) = spread + belief_.noise[at].variance(mean, spread);
    }
  }

  Belief<M> belief_;
  RandomStream random_;
  NormalDraws draws_;
  ParticleSet<n> set_;
  int noisy_ = 0;  // states that are drawn
  std::vector<float> normals_;
};

}  // namespace slipstream
