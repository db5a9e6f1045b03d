// Unscented Kalman filter on the manifold: the error-state filter's rival, by points instead of derivatives.
//
//   points    x_i+- = x [+] +-sqrt(n + l) L_i,  P = L L',  w = 1 / (2 (n + l)),  n + l = alpha^2 (n + kappa);  x_0 = x
//   predict   d_i = f(x_i) [-] f(x_0),  c = sum w d_i,  x = f(x_0) [+] c,  P = sum w d_i d_i' + (beta - alpha^2) c c' + Q
//   update    with points drawn anew:  e_i = h(x_i) - h(x_0),  c = sum w e_i,  nu = z - h(x_0) - c
//             S = sum w e_i e_i' + (beta - alpha^2) c c' + R,  K = (sum w d_i e_i') S^-1,  x = x [+] K nu
//             P = sum w (d_i - K e_i)(d_i - K e_i)' + (beta - alpha^2) K c c' K' + K R K'
//
// These are the sums about the point in the middle of sigma_points.hpp, and L is the factor there. P of the update is the
// Joseph form's twin, equal to P - K S K'. The mean is one step of minus() from the middle. Noise is added, Q as in the
// error-state filter (there is no L to draw it through: it acts on v and phi alike on all axes). f and h:
// estimators/strapdown_equations.hpp. Q and R are discrete covariances.
#include <fmt/format.h>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "estimators/navigation.hpp"
#include "estimators/sigma_points.hpp"
#include "estimators/strapdown_equations.hpp"

namespace slipstream {
namespace {

class NavigationUkf final : public NavigationFilter {
 public:
  NavigationUkf(double gravity_mps2, bool biases, OrientationError error, const SigmaPoints& points)
      : gravity_mps2_(gravity_mps2), biases_(biases), error_(error), points_(points) {}

  OrientationError error() const override { return error_; }

  void predict(NavigationBelief& belief, const Inertial& reading, const InertialNoise& noise, double dt_s) const override {
    if (!is_usable(reading, noise, dt_s)) return;
    const NavigationState middle = moved(belief.x, reading, gravity_mps2_, dt_s);
    const ErrorCovariance l = ways(belief.P);
    ErrorVector c = ErrorVector::Zero();
    ErrorCovariance p = ErrorCovariance::Zero();
    for_points(l, [&](const ErrorVector& d) {
      const ErrorVector to = minus(moved(plus(belief.x, d, error_), reading, gravity_mps2_, dt_s), middle, error_);
      c += points_.weight * to;
      add_square(points_.weight, to, p);
    });
    add_square(points_.middle, c, p);
    p.diagonal().segment<3>(kVelocity).array() += dt_s * dt_s * noise.f;
    p.diagonal().segment<3>(kAttitude).array() += dt_s * dt_s * noise.w;
    if (biases_) p.diagonal().segment<3>(kAccelerometerBias).array() += dt_s * noise.f_walk;
    if (biases_) p.diagonal().segment<3>(kGyroBias).array() += dt_s * noise.w_walk;
    belief.x = plus(middle, c, error_);
    finish(p, belief);
  }

  NavigationInnovation update(NavigationBelief& belief, const NavigationMeasurement& m, double gate) const override {
    NavigationInnovation i;
    const Vector3 middle = predicted(belief.x, m);
    const ErrorCovariance l = ways(belief.P);
    Vector3 c = Vector3::Zero();
    Matrix3 s = Matrix3::Zero(), inverse;
    Matrix<double, kErrors, 3> cross = Matrix<double, kErrors, 3>::Zero();
    for_points(l, [&](const ErrorVector& d) {
      const Vector3 e = predicted(plus(belief.x, d, error_), m) - middle;
      c += points_.weight * e;
      s += points_.weight * e * e.transpose();
      cross += points_.weight * d * e.transpose();
    });
    s += points_.middle * c * c.transpose();
    i.gated = !weigh(m, middle + c, s, i, inverse) || i.nis > gate;
    if (i.gated) return i;

    const Matrix<double, kErrors, 3> gain = cross * inverse;
    ErrorCovariance p = ErrorCovariance::Zero();
    for_points(l, [&](const ErrorVector& d) {
      add_square(points_.weight, d - gain * (predicted(plus(belief.x, d, error_), m) - middle), p);
    });
    add_square(points_.middle, gain * c, p);
    Matrix3 r = Matrix3::Zero();
    r.topLeftCorner(m.size, m.size) = m.R.topLeftCorner(m.size, m.size);
    p += gain * r * gain.transpose();
    belief.x = plus(belief.x, gain * i.nu, error_);
    finish(p, belief);
    return i;
  }

 private:
  // The columns of sqrt(n + l) L.
  ErrorCovariance ways(const ErrorCovariance& p) const {
    double l[kErrors][kErrors]{};
    semidefinite_factor(p, l);
    return points_.reach * Eigen::Map<const Eigen::Matrix<double, kErrors, kErrors, Eigen::RowMajor>>(&l[0][0]);
  }
  template <typename F>
  static void for_points(const ErrorCovariance& l, const F& f) {
    for (int k = 0; k < kErrors; ++k) {
      if (l(k, k) == 0.0) continue;
      f(l.col(k));
      f(-l.col(k));
    }
  }
  static void add_square(double weight, const ErrorVector& d, ErrorCovariance& p) { p.noalias() += weight * d * d.transpose(); }

  static void finish(const ErrorCovariance& p, NavigationBelief& belief) {
    belief.P = 0.5 * (p + p.transpose());
#ifndef NDEBUG
    SLIPSTREAM_CHECK(!belief.P.allFinite() || is_covariance(belief.P));
#endif
  }

  double gravity_mps2_;
  bool biases_;
  OrientationError error_;
  SigmaPoints points_;
};

}  // namespace

std::unique_ptr<NavigationFilter> make_navigation_ukf(const Strapdown& model, const StrapdownTuning& tuning) {
  const int n = tuning.biases ? Strapdown::kStates : Strapdown::kStatesWithoutBiases;
  const SigmaPoints points = sigma_points(n, "error states", tuning.ukf_alpha, tuning.ukf_beta, tuning.ukf_kappa);
  if (points.middle < 0.0)
    throw Refusal(fmt::format("ukf_beta = {} must be at least ukf_alpha squared, {}: else the covariance may become indefinite",
                              tuning.ukf_beta, tuning.ukf_alpha * tuning.ukf_alpha));
  return std::make_unique<NavigationUkf>(model.gravity_mps2, tuning.biases, orientation_error_of(tuning), points);
}

}  // namespace slipstream
