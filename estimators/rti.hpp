// Moving horizon by real-time iteration: the windows of mhe_window.hpp, with a solver of our own in place of a general one.
//
// Each step linearises the window at the last solution, moved on by one sample, and solves the quadratic program that results
// exactly, bounds included (Gauss-Newton: h and f to first order, their curvature left out). The solution is where the next
// step linearises; its KKT residual, with the functions and Jacobians there, is published. While it is above `enough`, and at
// most `most_programs` times, the same step solves another program.
//
// The residual is the largest of these, each in units of the newest estimate's standard deviation s (a, c: window_sweep.hpp)
//
//   |x_0 - xbar - Pbar a_0| / s,   |x_i - f(x_i-1) - Q_i a_i| / s,   |a_i - F_i' a_i+1 - H_i' R_i^-1 (z_i - h(x_i)) - c_i| s
//
// with c_i the forces of the bounds, all of the right sign. Above `acceptable` or not finite, the Kalman update of the last
// posterior is published with status `fallback` and no residual (NaN), and the window goes on from where it was.
//
// Diehl, Bock, Schloeder, SIAM J. Control Optim. 43 (2005), section 3 (real-time iteration); Kuehl et al., Comput. Chem. Eng.
// 35 (2011) (the same for moving horizons); Albersmeyer, Diehl, SIAM J. Optim. 20 (2010) (lifted Newton: single shooting whose
// intermediate states are kept as points of linearisation).
#pragma once

#include <cmath>
#include <limits>

#include "estimators/gaussian_estimator.hpp"
#include "estimators/window_condensation.hpp"
#include "estimators/window_sweep.hpp"

namespace slipstream {

struct RtiSettings {
  int most_programs = 3;    // quadratic programs a step
  double enough = 1e-2;     // residual below which the step is done
  double acceptable = 0.1;  // residual above which it has failed
};

// How much of a step is taken: all of it, but less where the last one led no nearer, as Gauss-Newton may near a kink.
class Damping {
 public:
  double part() const { return part_; }
  void judge(double residual) {
    part_ = residual < 0.9 * before_ ? std::min(1.0, 1.5 * part_) : std::max(0.05, 0.5 * part_);
    before_ = residual;
  }

 private:
  double part_ = 1.0, before_ = std::numeric_limits<double>::infinity();
};

// What both forms share: the samples and the model along them.
template <ProcessModel M>
class RealTimeHorizon : public GaussianEstimator<M> {
 public:
  static constexpr int n = M::kStates, m = M::kOutputs;
  using State = Vector<double, n>;
  using At = WindowLayout<M>;

  int samples() const { return rows_.size(); }
  // The present solution at sample i of the window, 0 the oldest.
  State solution(int i) const { return state(i); }

 protected:
  RealTimeHorizon(const Belief<M>& belief, int window, const RtiSettings& settings)
      : GaussianEstimator<M>(belief),
        settings_(settings),
        window_(window),
        rows_(window + 2),
        line_(window + 2),
        kept_(static_cast<std::size_t>((window + 2) * n)) {}

  // The new sample, where the last state leads to.
  void append(const StepInput& step) {
    rows_.push();
    const int i = rows_.size() - 1;
    for (int k = 0; k < M::kInputs; ++k) rows_(At::u + k, i) = step.input[static_cast<std::size_t>(k)];
    rows_(At::dt, i) = step.dt_s;
    const State q = this->belief_.process_covariance(step.dt_s);
    for (int r = 0; r < n; ++r) rows_(At::q + r, i) = q[r];
    if (i > 0) line_.evaluate_transition(this->belief_.model, rows_, i - 1);
    for (int r = 0; r < n; ++r) rows_(At::x + r, i) = i > 0 ? line_.reach(i - 1, r) : this->estimate_.mean[r];
    line_.evaluate_output(this->belief_.model, rows_, i);
  }
  bool full() const { return rows_.size() > window_ + 1; }
  void drop_oldest() {
    rows_.pop();
    line_.slide();
  }
  // The innovation of the newest sample and with it the weights; prior: its covariance before the measurement.
  void weigh(const StepInput& step, const Matrix<double, n>& prior) {
    const int i = rows_.size() - 1;
    this->estimate_ = {state(i), prior};
    innovate_into(this->belief_, this->estimate_, this->input_of(step), step.measured_value.data(), step.measured,
                  this->innovation_);
    for (int k = 0; k < m; ++k) {
      const bool on = (step.measured >> k & 1U) != 0U;
      rows_(At::z + k, i) = on ? step.measured_value[static_cast<std::size_t>(k)] : 0.0;
      rows_(At::variance + k, i) = on ? this->innovation_.noise[k] : 0.0;
      rows_(At::weight + k, i) = on ? 1.0 / this->innovation_.noise[k] : 0.0;
    }
  }

  State state(int i) const {
    State x;
    for (int r = 0; r < n; ++r) x[r] = rows_(At::x + r, i);
    return x;
  }
  double clipped(double x, int r) const { return std::min(std::max(x, this->belief_.lower[r]), this->belief_.upper[r]); }
  // R^-1 (z - h(x)) of output k of sample i.
  double pull(int i, int k) const { return rows_(At::weight + k, i) * (rows_(At::z + k, i) - line_.output(i, k)); }

  void keep() {
    for (int r = 0; r < n; ++r) std::copy_n(rows_.from(At::x + r, 0), rows_.size(), kept_.begin() + r * (window_ + 2));
  }
  // The solution as it was kept, the newest state that of the Kalman update, which is the estimate: no solution of the window,
  // so there is no residual.
  void fall_back() {
    this->kkt_residual_ = std::numeric_limits<double>::quiet_NaN();
    this->estimate_ = update(Gaussian<M>(this->estimate_), this->innovation_);
    const int last = rows_.size() - 1;
    for (int r = 0; r < n; ++r) {
      std::copy_n(kept_.begin() + r * (window_ + 2), last, &rows_(At::x + r, 0));
      rows_(At::x + r, last) = this->estimate_.mean[r];
    }
    line_.evaluate(this->belief_.model, rows_);
  }

  RtiSettings settings_;
  int window_;  // N
  typename At::Rows rows_;
  WindowLinearisation<M> line_;

 private:
  std::vector<double> kept_;
};

// Mhe (mhe.hpp) by real-time iteration: multiple shooting with process noise.
template <ProcessModel M>
class RtiMhe final : public RealTimeHorizon<M> {
  using Base = RealTimeHorizon<M>;
  using Base::line_, Base::rows_, Base::settings_;

 public:
  static constexpr int n = M::kStates;
  using typename Base::At, typename Base::State;

  // window: N, the number of intervals; every initial variance must be positive.
  RtiMhe(const Belief<M>& belief, int window, const RtiSettings& settings = {})
      : Base(belief, window, settings), sweep_(this->belief_, rows_, line_, window + 2), bounds_((window + 2) * n) {}

  void step(const StepInput& step) override {
    this->append(step);
    if (this->full()) {
      sweep_.arrival = sweep_.leave();
      this->drop_oldest();
      bounds_.shift(n, rows_.size() * n);
    }
    sweep_.begin();
    const int last = rows_.size() - 1;
    this->weigh(step, sweep_.prior(last).covariance);
    this->keep();
    Damping damping;
    for (int programs = 1;; ++programs) {
      const Matrix<double, n> covariance = sweep_.finish();
      sweep_.scale = covariance.diagonal().cwiseSqrt();
      if (!bounds_.solve(sweep_, rows_.size() * n)) break;
      take_step(damping.part());
      this->kkt_residual_ = residual();
      damping.judge(this->kkt_residual_);
      const bool enough = this->kkt_residual_ <= settings_.enough;
      if (enough || programs == settings_.most_programs) {
        if (!(this->kkt_residual_ <= settings_.acceptable)) break;
        this->estimate_ = {this->state(last), covariance};
        return this->settle(EstimateStatus::kValid);
      }
      sweep_.begin();
    }
    bounds_.clear();
    this->fall_back();
    this->settle(EstimateStatus::kFallback);
  }

 private:
  void on_start() override {
    rows_.clear();
    bounds_.clear();
    sweep_.arrival = this->estimate_;
  }

  void take_step(double part) {
    for (int i = 0; i < rows_.size(); ++i)
      for (int r = 0; r < n; ++r) rows_(At::x + r, i) = this->clipped(rows_(At::x + r, i) + part * sweep_.step(i, r), r);
    line_.evaluate(this->belief_.model, rows_);
  }

  double residual() const {
    Largest most;
    const int last = rows_.size() - 1;
    const Gaussian<M>& from = sweep_.arrival;
    for (int i = 0; i <= last; ++i) {
      for (int r = 0; r < n; ++r) {
        double way = rows_(At::x + r, i), slope = sweep_.adjoint(i, r) - sweep_.force(i * n + r);
        if (i == 0) {
          way -= from.mean[r];
          for (int c = 0; c < n; ++c) way -= from.covariance(r, c) * sweep_.adjoint(0, c);
        } else {
          way -= line_.reach(i - 1, r) + rows_(At::q + r, i) * sweep_.adjoint(i, r);
        }
        for (int k = 0; k < M::kOutputs; ++k) slope -= line_.h(i, k, r) * this->pull(i, k);
        if (i < last)
          for (int c = 0; c < n; ++c) slope -= line_.f(i, c, r) * sweep_.adjoint(i + 1, c);
        most.add(way / sweep_.scale[r]);
        most.add(slope * sweep_.scale[r]);
      }
    }
    return most.value();
  }

  WindowSweep<M> sweep_;
  ActiveSet bounds_;
};

// x_0 of a condensed window: min 1/2 d' A d - b' d with some d_k fixed, for active_set.hpp.
template <int n>
class BoxProgram {
 public:
  Matrix<double, n> curvature;         // A
  Vector<double, n> slope, low, high;  // b; bounds of d
  Vector<double, n> scale;

  bool solve(const Side* side) {
    // The fixed components' rows and columns are those of the identity.
    Matrix<double, n> a = curvature;
    Vector<double, n> b = slope;
    for (int k = 0; k < n; ++k) {
      if (side[k] == Side::kFree) continue;
      const double fixed = side[k] == Side::kLower ? low[k] : high[k];
      for (int r = 0; r < n; ++r) {
        b[r] -= curvature(r, k) * fixed;
        a(r, k) = a(k, r) = 0.0;
      }
    }
    for (int k = 0; k < n; ++k)
      if (side[k] != Side::kFree)
        a(k, k) = curvature(k, k), b[k] = curvature(k, k) * (side[k] == Side::kLower ? low[k] : high[k]);
    if (!factorise(a)) return false;
    substitute(a, b);
    for (int k = 0; k < n; ++k)
      if (side[k] != Side::kFree) b[k] = side[k] == Side::kLower ? low[k] : high[k];
    step_ = b;
    for (int r = 0; r < n; ++r) {
      force_[r] = -slope[r];
      for (int c = 0; c < n; ++c) force_[r] += curvature(r, c) * step_[c];
    }
    return true;
  }
  double value(int j) const { return step_[j]; }
  double force(int j) const { return force_[j]; }
  double lower(int j) const { return low[j]; }
  double upper(int j) const { return high[j]; }
  double slack(int j) const { return 1e-10 * scale[j]; }

  // a := L, 1/D of a = L D L' in the lower triangle and the diagonal; false where a pivot is lost in rounding.
  static bool factorise(Matrix<double, n>& a) {
    double d[n];
    for (int c = 0; c < n; ++c) {
      d[c] = a(c, c);
      for (int k = 0; k < c; ++k) d[c] -= a(c, k) * a(c, k) * d[k];
      if (!(d[c] > 1e-13 * a(c, c))) return false;
      a(c, c) = 1.0 / d[c];
      for (int r = c + 1; r < n; ++r) {
        for (int k = 0; k < c; ++k) a(r, c) -= a(r, k) * a(c, k) * d[k];
        a(r, c) *= a(c, c);
      }
    }
    return true;
  }
  // b := a^-1 b with the factors of a.
  static void substitute(const Matrix<double, n>& factors, Vector<double, n>& b) {
    for (int c = 0; c < n; ++c)
      for (int k = 0; k < c; ++k) b[c] -= factors(c, k) * b[k];
    for (int c = 0; c < n; ++c) b[c] *= factors(c, c);
    for (int c = n - 1; c >= 0; --c)
      for (int r = c + 1; r < n; ++r) b[c] -= factors(r, c) * b[r];
  }

 private:
  Vector<double, n> step_, force_;
};

// MheSingleShooting (mhe.hpp) by real-time iteration: the document's form, without process noise, condensed to x_0
// (window_condensation.hpp) and the arrival cost added. The covariance published is Phi_N A^-1 Phi_N'.
//
// What is summed over the samples that stay is summed when their linearisation is new, at the end of a step: it gives the KKT
// residual of this one, and the next has only its own sample to add.
template <ProcessModel M>
class RtiSingleShooting final : public RealTimeHorizon<M> {
  using Base = RealTimeHorizon<M>;
  using Base::line_, Base::rows_, Base::settings_;

 public:
  static constexpr int n = M::kStates, m = M::kOutputs;
  using typename Base::At, typename Base::State;

  // The belief's measurement noise must be 1/V. arrival_weight: the diagonal of S.
  RtiSingleShooting(const Belief<M>& belief, int window, const State& arrival_weight, const RtiSettings& settings = {})
      : Base(belief, window, settings), arrival_weight_(arrival_weight), sums_(window + 2), bounds_(n) {}

  void step(const StepInput& step) override {
    this->append(step);
    predict_covariance();
    if (this->full()) {
      for (int r = 0; r < n; ++r) arrival_[r] = line_.reach(0, r);
      this->drop_oldest();
      sums_.slide();
    }
    this->weigh(step, this->estimate_.covariance);
    this->keep();
    sums_.append(rows_, line_);
    Damping damping;
    for (int programs = 1;; ++programs) {
      if (!solve()) break;
      for (int r = 0; r < n; ++r)
        for (int c = 0; c < n; ++c) phi_(r, c) = sums_.phi(r, c);
      take_step(damping.part());
      this->kkt_residual_ = condense(staying());
      damping.judge(this->kkt_residual_);
      const bool enough = this->kkt_residual_ <= settings_.enough;
      if (enough || programs == settings_.most_programs) {
        if (!(this->kkt_residual_ <= settings_.acceptable) || !take_solution()) break;
        return this->settle(EstimateStatus::kValid);
      }
      if (staying() > 0) condense(0);
    }
    bounds_.clear();
    this->fall_back();
    condense(staying());
    this->settle(EstimateStatus::kFallback);
  }

 private:
  void on_start() override {
    rows_.clear();
    bounds_.clear();
    arrival_ = this->estimate_.mean;
    inverse_scale_.setOnes();
  }

  void predict_covariance() {
    const int i = rows_.size() - 1;
    if (i == 0) return;
    Matrix<double, n> f;
    for (int r = 0; r < n; ++r)
      for (int c = 0; c < n; ++c) f(r, c) = line_.f(i - 1, r, c);
    const Matrix<double, n> half = f * this->estimate_.covariance;
    this->estimate_.covariance = symmetric_product<n, n>(half, f);
    for (int r = 0; r < n; ++r) this->estimate_.covariance(r, r) += rows_(At::q + r, i);
  }

  // The first sample of the next step's window.
  int staying() const { return rows_.size() > this->window_ ? 1 : 0; }

  bool solve() {
    for (int r = 0; r < n; ++r) {
      const double x = rows_(At::x + r, 0);
      for (int c = 0; c <= r; ++c) box_.curvature(r, c) = box_.curvature(c, r) = sums_.curvature(r, c);
      box_.curvature(r, r) += arrival_weight_[r];
      box_.slope[r] = sums_.slope[r] + arrival_weight_[r] * (arrival_[r] - x);
      box_.low[r] = this->belief_.lower[r] - x;
      box_.high[r] = this->belief_.upper[r] - x;
      inverse_scale_[r] = std::sqrt(box_.curvature(r, r));
      box_.scale[r] = 1.0 / inverse_scale_[r];
    }
    return bounds_.solve(box_, n);
  }
  void take_step(double part) {
    State d;
    for (int r = 0; r < n; ++r) d[r] = box_.value(r);
    sums_.expand(d, part, rows_);
    for (int r = 0; r < n; ++r) rows_(At::x + r, 0) = this->clipped(rows_(At::x + r, 0), r);
    line_.evaluate(this->belief_.model, rows_);
  }
  // Sums from `base` on; the residual.
  double condense(int base) {
    Largest most;
    sums_.condense(rows_, line_, base, inverse_scale_, most);
    for (int r = 0; r < n; ++r) {
      double slope = arrival_weight_[r] * (rows_(At::x + r, 0) - arrival_[r]);
      if (base == 0) slope -= sums_.pull[r];
      if (base == 1) {
        for (int k = 0; k < m; ++k) slope -= line_.h(0, k, r) * this->pull(0, k);
        if (rows_.size() > 1)
          for (int c = 0; c < n; ++c) slope -= line_.f(0, c, r) * sums_.pull[c];
      }
      if (bounds_.side(r) != Side::kFree) slope -= box_.force(r);
      most.add(slope * box_.scale[r]);
    }
    return most.value();
  }

  // False: the covariance is that without bounds, and there is none where only a bound held the program together.
  bool take_solution() {
    const int last = rows_.size() - 1;
    Matrix<double, n> covariance;
    Matrix<double, n> factors = box_.curvature;
    if (!BoxProgram<n>::factorise(factors)) return false;
    for (int r = 0; r < n; ++r) {
      State column = phi_.row(r).transpose();
      BoxProgram<n>::substitute(factors, column);
      for (int s = 0; s <= r; ++s) {
        double sum = 0.0;
        for (int k = 0; k < n; ++k) sum += phi_(s, k) * column[k];
        covariance(r, s) = covariance(s, r) = sum;
      }
    }
    this->estimate_ = {this->state(last), covariance};
    return true;
  }

  State arrival_weight_, arrival_ = State::Zero(), inverse_scale_ = State::Ones();
  WindowCondensation<M> sums_;
  BoxProgram<n> box_;
  ActiveSet bounds_;
  Matrix<double, n> phi_ = Matrix<double, n>::Identity();  // of the newest sample, when the program was solved
};

}  // namespace slipstream
