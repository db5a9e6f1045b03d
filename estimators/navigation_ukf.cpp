// Unscented Kalman filter on the manifold: the error-state filter's rival, by points instead of derivatives.
//
//   points    x_i+- = x [+] +-sqrt(n + l) L_i,  P = L L',  w = 1 / (2 (n + l)),  n + l = alpha^2 (n + kappa);  x_0 = x
//   predict   d_i = f(x_i) [-] f(x_0),  c = sum w d_i,  x = f(x_0) [+] c,  P = sum w d_i d_i' + (beta - alpha^2) c c' + Q
//   update    with points drawn anew:  e_i = h(x_i) - h(x_0),  c = sum w e_i,  nu = z - h(x_0) - c
//             S = sum w e_i e_i' + (beta - alpha^2) c c' + R,  K = (sum w d_i e_i') S^-1,  x = x [+] K nu
//             P = sum w (d_i - K e_i)(d_i - K e_i)' + (beta - alpha^2) K c c' K' + K R K'
//
// These are the scaled transform's sums written about the point in the middle: its large negative weight has cancelled, so that
// every term is positive semidefinite where beta >= alpha^2. P of the update is the Joseph form's twin, equal to P - K S K'.
// The mean is one step of minus() from the middle. Noise is added, Q as in the error-state filter (there is no L to draw it
// through: it acts on v and phi alike on all axes).
// L is the triangular factor of a semidefinite P: where a pivot is rounding against its diagonal, the column is zero and draws
// no points - a direction without variance, as at a start at truth or with biases left out. f and h:
// estimators/strapdown_equations.hpp. Julier, The Scaled Unscented Transformation (ACC 2002); Q and R discrete covariances.
#include <fmt/format.h>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "estimators/navigation.hpp"
#include "estimators/strapdown_equations.hpp"

namespace slipstream {
namespace {

ErrorCovariance semidefinite_factor(const ErrorCovariance& p) {
  constexpr double kDigits = 1e-14;  // of a pivot against its diagonal: what 15 subtractions leave of a zero
  ErrorCovariance l = ErrorCovariance::Zero();
  for (int c = 0; c < kErrors; ++c) {
    const double pivot = p(c, c) - l.row(c).head(c).squaredNorm();
    if (!(pivot > kDigits * p(c, c))) continue;
    l(c, c) = std::sqrt(pivot);
    for (int r = c + 1; r < kErrors; ++r) l(r, c) = (p(r, c) - l.row(r).head(c).dot(l.row(c).head(c))) / l(c, c);
  }
  return l;
}

class NavigationUkf final : public NavigationFilter {
 public:
  NavigationUkf(double gravity_mps2, bool biases, OrientationError error, double squared_reach, double middle)
      : gravity_mps2_(gravity_mps2),
        biases_(biases),
        error_(error),
        reach_(std::sqrt(squared_reach)),
        weight_(0.5 / squared_reach),
        middle_(middle) {}

  OrientationError error() const override { return error_; }

  void predict(NavigationBelief& belief, const Inertial& reading, const InertialNoise& noise, double dt_s) const override {
    if (!is_usable(reading, noise, dt_s)) return;
    const NavigationState middle = moved(belief.x, reading, gravity_mps2_, dt_s);
    const ErrorCovariance l = reach_ * semidefinite_factor(belief.P);
    ErrorVector c = ErrorVector::Zero();
    ErrorCovariance p = ErrorCovariance::Zero();
    for_points(l, [&](const ErrorVector& d) {
      const ErrorVector to = minus(moved(plus(belief.x, d, error_), reading, gravity_mps2_, dt_s), middle, error_);
      c += weight_ * to;
      add_square(weight_, to, p);
    });
    add_square(middle_, c, p);
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
    const ErrorCovariance l = reach_ * semidefinite_factor(belief.P);
    Vector3 c = Vector3::Zero();
    Matrix3 s = Matrix3::Zero(), inverse;
    Matrix<double, kErrors, 3> cross = Matrix<double, kErrors, 3>::Zero();
    for_points(l, [&](const ErrorVector& d) {
      const Vector3 e = predicted(plus(belief.x, d, error_), m) - middle;
      c += weight_ * e;
      s += weight_ * e * e.transpose();
      cross += weight_ * d * e.transpose();
    });
    s += middle_ * c * c.transpose();
    i.gated = !weigh(m, middle + c, s, i, inverse) || i.nis > gate;
    if (i.gated) return i;

    const Matrix<double, kErrors, 3> gain = cross * inverse;
    ErrorCovariance p = ErrorCovariance::Zero();
    for_points(l, [&](const ErrorVector& d) {
      add_square(weight_, d - gain * (predicted(plus(belief.x, d, error_), m) - middle), p);
    });
    add_square(middle_, gain * c, p);
    Matrix3 r = Matrix3::Zero();
    r.topLeftCorner(m.size, m.size) = m.R.topLeftCorner(m.size, m.size);
    p += gain * r * gain.transpose();
    belief.x = plus(belief.x, gain * i.nu, error_);
    finish(p, belief);
    return i;
  }

 private:
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
  double reach_, weight_, middle_;  // sqrt(n + lambda), w, beta - alpha^2
};

}  // namespace

std::unique_ptr<NavigationFilter> make_navigation_ukf(const Strapdown& model, const StrapdownTuning& tuning) {
  const int n = tuning.biases ? Strapdown::kStates : Strapdown::kStatesWithoutBiases;
  const double squared_alpha = tuning.ukf_alpha * tuning.ukf_alpha;
  if (n + tuning.ukf_kappa <= 0.0)
    throw Refusal(fmt::format("ukf_kappa = {} must be more than -{}, the number of error states", tuning.ukf_kappa, n));
  if (tuning.ukf_beta < squared_alpha)
    throw Refusal(fmt::format("ukf_beta = {} must be at least ukf_alpha squared, {}: else the covariance may become indefinite",
                              tuning.ukf_beta, squared_alpha));
  return std::make_unique<NavigationUkf>(model.gravity_mps2, tuning.biases, orientation_error_of(tuning),
                                         squared_alpha * (n + tuning.ukf_kappa), tuning.ukf_beta - squared_alpha);
}

}  // namespace slipstream
