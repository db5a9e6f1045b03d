// DC motor behind a gear: the torque at the wheel is proportional to the armature's current.
//
//   T = k_m i,   k_m = k_t n          k_t torque constant of the motor, n motor turns per wheel turn
//
// Losses of motor and gear are not in it: what of them grows with speed belongs to the wheel's viscous friction. T and i are
// positive when driving. Source: document 002, eq. 5.1, which lumps k_t and n into k_m.
#pragma once

#include "common/parameters.hpp"

namespace slipstream {

struct DcMotor {
  double motor_torque_constant_nmpa = 0.0027;
  double motor_gear_ratio = 70.0 * 30.0 / (13.0 * 19.0);

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("motor_torque_constant_nmpa", p.motor_torque_constant_nmpa, positive());
    v.number("motor_gear_ratio", p.motor_gear_ratio, positive());
  }

  double wheel_torque_constant_nmpa() const { return motor_torque_constant_nmpa * motor_gear_ratio; }  // k_m

  template <typename T>
  T wheel_torque_nm(const T& current_a) const {
    return wheel_torque_constant_nmpa() * current_a;
  }
};

}  // namespace slipstream
