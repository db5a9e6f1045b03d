// A wheel and its friction, without the vehicle's speed: the first level of the hierarchical observer, and what a filter can
// know from the wheel alone.
//
//   w' = (T - b w - (mu + f_r sgn w) m g r) / J,   mu' = 0,   z = (w, a_x),   a_x = mu g
//
// Document 002, eqs 5.2-5.6 and 7.11; sgn as in parts/driven_wheel.hpp. There is no drag in a_x, because there is no speed.
// Input: T, the torque at this wheel. Observable from w alone, with or without a_x (eq. 5.5: rank 2).
#pragma once

#include "models/parts/driven_wheel.hpp"
#include "models/process.hpp"

namespace slipstream {

struct WheelFriction {
  static constexpr std::string_view kName = "wheel_friction";
  static constexpr int kStates = 2;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{{{"wheel_speed_radps", "rad/s"}, {"friction", "1"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  static constexpr bool kInputsOfAnyScalar = true;
  static constexpr std::array<bool, kStates> kLinear{false, true};
  static constexpr std::array<bool, kStates> kConstant{false, true};

  DrivenWheel wheel;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    DrivenWheel::visit_parameters(p.wheel, v);
  }

  template <typename T, typename U>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<U, kInputs>& u) const {
    return {wheel.acceleration_radps2(u[0], x[0], x[1]), T(0.0)};
  }
  template <typename T, typename U>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<U, kInputs>&) const {
    return {x[0], kGravity_mps2 * x[1]};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    return wheel.fastest_rate_hz(x[0]);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    return true;
  }
};

static_assert(ProcessModel<WheelFriction>);

}  // namespace slipstream
