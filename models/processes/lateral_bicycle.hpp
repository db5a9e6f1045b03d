// Single-track model whose cornering stiffnesses are states that only process noise moves, with heading and position.
//
//   v_y' = a_y - w_z v_x,   w_z' as in parts/single_track.hpp,   psi' = w_z
//   X' = v_x cos psi - v_y sin psi,   Y' = v_x sin psi + v_y cos psi,   C_1' = C_2' = 0
//   z = (a_y, w_z),   u = (delta, w),   v_x = r w
//
// Document 002, eq. 6.1. W: X, Y level, psi from X towards Y, not wrapped: three laps end at 6 pi.
// psi, X and Y are not observable: nothing measured depends on them. They are counted on from the start, and their uncertainty
// only grows; who starts from a measurement counts from the tuning's pose. C_1 and C_2 are observable only while the tyres
// slip: when driving straight, a_y and w_z do not depend on them. w is a sensor's reading: its noise goes through v_x into v_y'
// (w_z v_x) and X', Y' and must be part of the process noise.
#pragma once

#include "models/parts/single_track.hpp"
#include "models/process.hpp"

namespace slipstream {

struct LateralBicycle {
  static constexpr std::string_view kName = "lateral_bicycle";
  static constexpr int kStates = 7;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{{{"lateral_speed_mps", "m/s"},
                                                              {"yaw_rate_radps", "rad/s"},
                                                              {"heading_rad", "rad"},
                                                              {"x_m", "m"},
                                                              {"y_m", "m"},
                                                              {"front_stiffness_npr", "N/rad"},
                                                              {"rear_stiffness_npr", "N/rad"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"steering_angle_rad", "rad"}, {"wheel_speed_radps", "rad/s"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"a_y_mps2", "m/s^2"}, {"yaw_rate_radps", "rad/s"}}};

  static constexpr bool kInputsOfAnyScalar = true;
  static constexpr std::array<bool, kStates> kLinear{true, true, false, true, true, false, false};
  static constexpr std::array<bool, kStates> kConstant{false, false, false, false, false, true, true};

  SingleTrack track;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    SingleTrack::visit_parameters(p.track, v);
  }

  template <typename T, typename U>
  auto accelerations(const Vector<T, kStates>& x, const Vector<U, kInputs>& u) const {
    return track.accelerations(x[0], x[1], track.wheel_radius_m * u[1], u[0], x[5], x[6]);
  }

  template <typename T, typename U>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<U, kInputs>& u) const {
    using std::cos, std::sin;
    const T &v_y = x[0], &w_z = x[1], &psi = x[2];
    const U v_x = track.wheel_radius_m * u[1];
    const auto a = accelerations(x, u);
    const T c = cos(psi), s = sin(psi);
    Vector<T, kStates> rate;
    rate << a.lateral_mps2 - v_x * w_z, a.yaw_radps2, w_z, v_x * c - v_y * s, v_x * s + v_y * c, T(0.0), T(0.0);
    return rate;
  }

  template <typename T, typename U>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<U, kInputs>& u) const {
    return {accelerations(x, u).lateral_mps2, x[1]};
  }

  // The fastest rate of x' = f around x, 1/s, at any speed: bounds the length of a stable Runge-Kutta step.
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    return track.fastest_rate_hz(x[5], x[6]);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 1) return false;
    x[1] = z;
    return true;
  }
};

static_assert(ProcessModel<LateralBicycle>);

}  // namespace slipstream
