// Error-state extended Kalman filter of document 001, eqs 3.1-3.27, with the biases' six error states beside its nine if
// wanted.
//
//   predict   the mean as in estimators/strapdown_equations.hpp, R = C(q), f and w free of bias
//             dp += dt dv,   dv += A dphi - dt R db_f,   dphi = E dphi - dt C db_w            eq. 3.10, and columns for biases
//             global error:  A = -dt [R f]x,  E = I,            C = R
//             local error:   A = -dt R [f]x,  E = exp(-w dt),   C = I
//             Q = dt^2 diag(f, w) on v and phi (eq. 3.12),  dt diag(f_walk, w_walk) on the biases
//   update    kPoint          dh = dp - [R l]x dphi                               local: - R [l]x dphi
//             kBodyVelocity   dh = R_BS (R' dv + R' [v]x dphi + [l]x db_w)        local: [R' v]x dphi
//             S = H P H' + R,  K = P H' S^-1,  x = x [+] K nu,  P = (I - K H) P (I - K H)' + K R K'     eqs 3.22-3.27, Joseph
//             form
//
// F is of first order in dt, as the document's: dp's dt^2/2 A dphi, C's change during the step, and position noise of the
// order dt^4 are left out. So is the covariance's reset I +- [dphi]x/2 after a correction, of second order in it. L of eq. 3.11
// as printed lacks the attitude's identity. The algebra of P: estimators/error_covariance.hpp.
// What is not finite leaves the belief as it is, and so does a singular S. Q and R are discrete covariances.
#include "estimators/error_covariance.hpp"
#include "estimators/strapdown_equations.hpp"

namespace slipstream {
namespace {

template <OrientationError kError>
class EsEkf final : public NavigationFilter {
 public:
  EsEkf(double gravity_mps2, bool biases) : gravity_mps2_(gravity_mps2), biases_(biases) {}

  OrientationError error() const override { return kError; }

  void predict(NavigationBelief& belief, const Inertial& reading, const InertialNoise& noise, double dt_s) const override {
    if (!is_usable(reading, noise, dt_s)) return;
    const Matrix3 r = belief.x.q_WS.toRotationMatrix();
    const Vector3 f = reading.f - belief.x.b_f;
    const Rotation turn = rotation_exp(dt_s * (reading.w - belief.x.b_w));
    belief.x = moved(belief.x, reading, gravity_mps2_, dt_s, r, turn);

    ErrorTransition transition;
    transition.dt_s = dt_s;
    transition.biases = biases_;
    transition.B_f = -dt_s * r;
    if constexpr (kGlobal) {
      transition.A = skew(-dt_s * (r * f));
      transition.B_w = transition.B_f;
    } else {
      transition.A = transition.B_f * skew(f);
      transition.has_E = true;
      transition.E = turn.toRotationMatrix().transpose();
      transition.B_w = -dt_s * Matrix3::Identity();
    }
    propagate(belief.P, transition, noise);
  }

  NavigationInnovation update(NavigationBelief& belief, const NavigationMeasurement& m, double gate) const override {
    NavigationInnovation i;
    const SparseRows h = jacobian(belief.x, m);
    ErrorVector d;
    i.gated = !correct(belief.P, h, m, predicted(belief.x, m), gate, i, d);
    if (!i.gated) belief.x = plus(belief.x, d, kError);
    return i;
  }

 private:
  static constexpr bool kGlobal = kError == OrientationError::kGlobal;

  SparseRows jacobian(const NavigationState& x, const NavigationMeasurement& m) const {
    SparseRows h;
    h.biases = biases_;
    if (m.kind == NavigationMeasurement::kPoint) {
      h.position = true;
      h.attitude = !m.l.isZero(0.0);
      if (h.attitude)
        h.of_attitude = kGlobal ? Matrix3(skew(-(x.q_WS * m.l))) : Matrix3(-(x.q_WS.toRotationMatrix() * skew(m.l)));
      return h;
    }
    const Matrix3 r_t = x.q_WS.toRotationMatrix().transpose();
    const auto rows = [&](const Matrix3& of) {
      Matrix3 selected = Matrix3::Zero();
      for (int i = 0; i < m.size; ++i) selected.row(i) = (m.R_BS * of).row(m.rows[static_cast<std::size_t>(i)]);
      return selected;
    };
    h.velocity = h.attitude = true;
    h.of_velocity = rows(r_t);
    h.of_attitude = rows(kGlobal ? Matrix3(r_t * skew(x.v_WS)) : skew(r_t * x.v_WS));
    h.gyro_bias = biases_ && !m.l.isZero(0.0);
    if (h.gyro_bias) h.of_gyro_bias = rows(skew(m.l));
    return h;
  }

  double gravity_mps2_;
  bool biases_;
};

}  // namespace

std::unique_ptr<NavigationFilter> make_es_ekf(const Strapdown& model, const StrapdownTuning& tuning) {
  if (orientation_error_of(tuning) == OrientationError::kLocal)
    return std::make_unique<EsEkf<OrientationError::kLocal>>(model.gravity_mps2, tuning.biases);
  return std::make_unique<EsEkf<OrientationError::kGlobal>>(model.gravity_mps2, tuning.biases);
}

}  // namespace slipstream
