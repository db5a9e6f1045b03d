// The strapdown filters' common ground: their state on a manifold, what they believe, and what they measure.
//
// State of the IMU frame S (origin and axes of the sensor): position and velocity in W, attitude, biases in S.
// Error (15): dp, dv, dphi, db_f, db_w, where p = p^ + dp, ..., and the attitude's is global, R = exp(dphi) R^ with dphi in W's
// axes (document 001, eq. 3.26), or local, R = R^ exp(dphi). P is the covariance of that error. Q and R are discrete
// covariances.
//
// Without biases (document 001's nine error states) their block of P is zero and stays so.
#pragma once

#include <cstdint>
#include <memory>

#include "common/rotation.hpp"
#include "models/scenario.hpp"

namespace slipstream {

inline constexpr int kErrors = 15;
enum ErrorBlock { kPosition = 0, kVelocity = 3, kAttitude = 6, kAccelerometerBias = 9, kGyroBias = 12 };
using ErrorVector = Vector<double, kErrors>;
using ErrorCovariance = Matrix<double, kErrors>;

struct NavigationState {
  Rotation q_WS = Rotation::Identity();
  Vector3 p_WS = Vector3::Zero();
  Vector3 v_WS = Vector3::Zero();
  Vector3 b_f = Vector3::Zero();
  Vector3 b_w = Vector3::Zero();
};

struct NavigationBelief {
  NavigationState x;
  ErrorCovariance P = ErrorCovariance::Zero();
};

inline bool is_sound(const NavigationBelief& belief) {
  const NavigationState& x = belief.x;
  return x.p_WS.allFinite() && x.v_WS.allFinite() && x.q_WS.coeffs().allFinite() && x.b_f.allFinite() && x.b_w.allFinite() &&
         belief.P.allFinite() && (belief.P.diagonal().array() >= 0.0).all();
}

enum class OrientationError { kGlobal, kLocal };
inline OrientationError orientation_error_of(const StrapdownTuning& tuning) {
  return tuning.orientation_error == "local" ? OrientationError::kLocal : OrientationError::kGlobal;
}

inline NavigationState plus(const NavigationState& x, const ErrorVector& d, OrientationError error) {
  const Vector3 phi = d.segment<3>(kAttitude);
  return {error == OrientationError::kGlobal ? global_plus(x.q_WS, phi) : local_plus(x.q_WS, phi),
          x.p_WS + d.segment<3>(kPosition), x.v_WS + d.segment<3>(kVelocity), x.b_f + d.segment<3>(kAccelerometerBias),
          x.b_w + d.segment<3>(kGyroBias)};
}
// d with a = plus(b, d).
inline ErrorVector minus(const NavigationState& a, const NavigationState& b, OrientationError error) {
  ErrorVector d;
  d << a.p_WS - b.p_WS, a.v_WS - b.v_WS,
      error == OrientationError::kGlobal ? global_minus(a.q_WS, b.q_WS) : local_minus(a.q_WS, b.q_WS), a.b_f - b.b_f,
      a.b_w - b.b_w;
  return d;
}

// An IMU reading, in S.
struct Inertial {
  Vector3 f = Vector3::Zero();  // specific force, m/s^2
  Vector3 w = Vector3::Zero();  // angular rate, rad/s
};

// Variances that the prediction believes in. Of a sample over dt: document 001, eq. 3.12, Q = dt^2 diag(f, w); of the biases,
// per second.
struct InertialNoise {
  double f = 0.0, w = 0.0;            // of a sample, (m/s^2)^2 and (rad/s)^2
  double f_walk = 0.0, w_walk = 0.0;  // per second
};

// What was measured, in the form every algorithm understands. R is its discrete covariance; rows >= size are not used.
//   kPoint         h = p + R l                                   position in W of the point l (in S)
//   kBodyVelocity  h = R_BS [R' v + (w - b_w) x l]               velocity of the point l in B's axes, `rows` of it
//                  w: the rate measured then
struct NavigationMeasurement {
  enum Kind { kPoint, kBodyVelocity };
  Kind kind = kPoint;
  int size = 3;
  std::array<int, 3> rows{0, 1, 2};  // of kBodyVelocity: which components, in order
  Vector3 z = Vector3::Zero();
  Matrix3 R = Matrix3::Identity();
  Vector3 l = Vector3::Zero();
  Matrix3 R_BS = Matrix3::Identity();
  Vector3 w = Vector3::Zero();  // of kBodyVelocity: the angular rate measured then, in S
};

struct NavigationInnovation {
  int size = 3;
  Vector3 nu = Vector3::Zero();     // z - h(x-)
  Matrix3 S = Matrix3::Identity();  // its covariance; identity beyond size
  double nis = 0.0;                 // nu' S^-1 nu
  bool gated = false;
};

// An algorithm is a pure function on beliefs: a history of them can be rewound. Allocates nothing.
class NavigationFilter {
 public:
  virtual ~NavigationFilter() = default;
  virtual OrientationError error() const = 0;
  // Over dt_s with the reading held. `noise` is that of this step: a session raises it where the IMU has fallen silent.
  virtual void predict(NavigationBelief& belief, const Inertial& reading, const InertialNoise& noise, double dt_s) const = 0;
  // Leaves the belief as it is where nis > gate.
  virtual NavigationInnovation update(NavigationBelief& belief, const NavigationMeasurement& measurement,
                                      double gate) const = 0;
};

// Each is defined in the .cpp of its name. gravity_mps2 and the choices among them come from the tuning.
std::unique_ptr<NavigationFilter> make_es_ekf(const Strapdown& model, const StrapdownTuning& tuning);
std::unique_ptr<NavigationFilter> make_navigation_ukf(const Strapdown& model, const StrapdownTuning& tuning);

}  // namespace slipstream
