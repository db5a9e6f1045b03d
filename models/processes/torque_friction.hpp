// Wheel, vehicle and friction on a level road, with a friction that follows the torque: no lag where the torque steps.
//
//   w', v', mu' of parts/rolling_wheel.hpp with q = 0 and m known,   z = (w, a_x),   a_x = mu g - R_aer(v)/m
//
// Unlike longitudinal_friction, where only process noise moves mu (document 002, eq. 7.12), noise here says how far the
// friction may be from what the torque demands: a variance of density s^2 leaves mu with s^2 tau/2. Input: T, the torque at
// this wheel, as it is at the instant of a step (kInputsAtEnd), since mu there follows T there.
#pragma once

#include "models/parts/rolling_wheel.hpp"
#include "models/process.hpp"

namespace slipstream {

struct TorqueFriction {
  static constexpr std::string_view kName = "torque_friction";
  static constexpr int kStates = 3;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr bool kInputsAtEnd = true;
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"wheel_speed_radps", "rad/s"}, {"speed_mps", "m/s"}, {"friction", "1"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  static constexpr std::array<bool, kStates> kLinear{false, false, true};

  RollingWheel rolling;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    RollingWheel::visit_parameters(p.rolling, v);
  }

  template <typename T>
  RollingWheel::Road<T> level() const {
    return {T(rolling.wheel.quarter.mass_kg), T(0.0), T(1.0)};
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    return rolling.rates(level<T>(), u[0], x[0], x[1], x[2]);
  }
  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], rolling.specific_force_mps2(level<T>(), x[2], x[1])};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    return 1.0 / rolling.relaxation_s(level<T>(), x[1]);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = rolling.speed_mps(z, x[2]);
    return true;
  }
};

static_assert(ProcessModel<TorqueFriction>);

}  // namespace slipstream
