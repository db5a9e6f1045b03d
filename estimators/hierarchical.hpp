// Hierarchical observer: the first level estimates wheel speed and friction, which the measurements fix; the second integrates
// the vehicle's speed, which they do not, by Runge-Kutta from the friction that the first level found.
//
//   first level   x = (w, mu): an EKF or a moving horizon on wheel_friction.hpp, fed with  z_a - (a_x(mu, v) - mu g),
//                 the acceleration cleared of the drag at the speed of the second level
//   second level  v' = mu g - R_aer(v)/m + k (r w - v)            with the first level's estimate of the step's start, so
//                 v_k+1 = f_v(w_k|k, v_k, mu_k|k, u, dt);  no measurement corrects it
//
// The published covariance is that of the joint error e = (e_w, e_v, e_mu), as of a filter whose gain for v is zero. With
// F = df/dx of all three states, Q of the tuning, H and h_v the slopes of the outputs in x and in v (h_v: the drag), and with
// P-, P+ the covariances that the first level believes before and after its update,
//
//   predict   P = F P F' + Q:   e_v+ = F_vw e_w + F_vv e_v + F_vmu e_mu + q_v, where F_vmu = g dt without drag
//   update    P = B P B' + N,   B = [I - K H, -K h_v; 0, 1],   K = P- H' S^-1,   N = P+ - (I - K H) P- (I - K H)'
//
// Taking mu at the start of the step makes e_v+ linear in e_k|k alone, so that the recursion is exact on a linear model. For an
// EKF N = K R K' (Joseph form). A moving horizon may find another P+; N is then cut off at zero, which errs to the safe side.
// Single shooting has no process noise on (w, mu) and 1/V for R, and I - K H stands for the memory of its window.
// Without drag the covariance of (w, mu) is the first level's own; S is, too, with drag as well.
//
// Document 002, section 5.2 (text below eq. 5.6; first level eqs 5.2-5.6). The covariance: Simon, Optimal State Estimation
// (2006), eq. 5.19 (any gain), with a zero row as in the consider filter of Schmidt.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "estimators/gaussian_estimator.hpp"
#include "models/processes/longitudinal_friction.hpp"
#include "models/processes/wheel_friction.hpp"

namespace slipstream {

class Hierarchical final : public GaussianEstimator<LongitudinalFriction> {
  using Base = GaussianEstimator<LongitudinalFriction>;

 public:
  // belief: of all three states; first_belief: what first_level believes.
  Hierarchical(const Belief<LongitudinalFriction>& belief, const Belief<WheelFriction>& first_belief,
               std::unique_ptr<Estimator> first_level)
      : Base(belief), first_belief_(first_belief), first_level_(std::move(first_level)) {}

  void start_given() override {
    Base::start_given();
    first_level_->start_given();
  }
  bool start_measured(int output, double z) override {
    return Base::start_measured(output, z) && first_level_->start_measured(output, z);
  }

  void step(const StepInput& step) override {
    const Vector<double, 1> u = input_of(step);
    Gaussian<WheelFriction> first_prior = first_estimate();
    Gaussian<LongitudinalFriction> prior = estimate_;
    if (step.dt_s > 0.0) {
      predict_into(first_belief_, first_estimate(), u, step.dt_s, first_prior);
      predict_into(belief_, estimate_, u, step.dt_s, prior);
    }
    Vector<double, 2> predicted;
    Matrix<double, 2, 3> h;
    value_and_jacobian<2>([&](const auto& x) { return belief_.model.output(x, u); }, prior.mean, predicted, h);
    const double drag_mps2 = kGravity_mps2 * prior.mean[2] - predicted[1];
    const std::array<double, 2> z{step.measured_value[0], step.measured_value[1] + drag_mps2};

    innovate_into(first_belief_, first_prior, u, z.data(), step.measured, first_innovation_);
    const Matrix<double, 2> gain = first_innovation_.ph * first_innovation_.covariance.inverse();
    first_level_->step({step.dt_s, step.input, z, step.measured});

    const Gaussian<WheelFriction> first = first_estimate();
    estimate_.mean = {first.mean[0], prior.mean[1], first.mean[1]};
    correct(prior, first_prior.covariance, first.covariance, gain, h(1, 1));
    const Posterior p = first_level_->posterior();
    innovation_.value = Eigen::Map<const Vector<double, 2>>(p.innovation.data());
    innovation_.covariance = Eigen::Map<const Matrix<double, 2>>(p.innovation_covariance.data());
    kkt_residual_ = p.kkt_residual;
    settle(p.status);
  }

 private:
  static constexpr std::array<int, 2> kAt{0, 2};  // where the first level's states lie among the three

  Gaussian<WheelFriction> first_estimate() const {
    const Posterior p = first_level_->posterior();
    return {Eigen::Map<const Vector<double, 2>>(p.mean.data()), Eigen::Map<const Matrix<double, 2>>(p.covariance.data())};
  }

  // P = B P B' + N. drag_slope: h_v, of a_x; its gain is zero where a_x was not measured.
  void correct(const Gaussian<LongitudinalFriction>& prior, const Matrix<double, 2>& before, const Matrix<double, 2>& after,
               const Matrix<double, 2>& gain, double drag_slope) {
    const Matrix<double, 2> left = Matrix<double, 2>::Identity() - gain * first_innovation_.h;
    const Matrix<double, 2> renewed = not_below_zero(after - symmetric_product<2, 2>(Matrix<double, 2>(left * before), left));
    Matrix<double, 3> b = Matrix<double, 3>::Identity();
    for (int r = 0; r < 2; ++r) {
      b(kAt[r], 1) = -gain(r, 1) * drag_slope;
      for (int c = 0; c < 2; ++c) b(kAt[r], kAt[c]) = left(r, c);
    }
    estimate_.covariance = symmetric_product<3, 3>(Matrix<double, 3>(b * prior.covariance), b);
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 2; ++c) estimate_.covariance(kAt[r], kAt[c]) += renewed(r, c);
  }

  // The symmetric matrix without its negative part.
  static Matrix<double, 2> not_below_zero(const Matrix<double, 2>& m) {
    const Eigen::SelfAdjointEigenSolver<Matrix<double, 2>> eigen(m);
    if (!(eigen.eigenvalues()[0] < 0.0)) return m;
    const Matrix<double, 2> scaled = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal();
    return symmetric_product<2, 2>(scaled, eigen.eigenvectors());
  }

  Belief<WheelFriction> first_belief_;
  std::unique_ptr<Estimator> first_level_;
  Innovation<WheelFriction> first_innovation_{};
};

}  // namespace slipstream
