// Inertial measurement unit, fixed to the body at r (lever arm) with axes R_BS: specific force and angular rate in its own
// axes.
//
//   z_f = sat(diag(scale_f) f_k + b_f + noise_mps2 xi),    z_w = sat(diag(scale_w) w_k + b_w + noise_radps xi),    xi ~ N(0, I)
//   f_k = R_WS(t_k)' ((v_WS(t_k+1) - v_WS(t_k)) / dt + g z),   w_k = log(R_WS(t_k)' R_WS(t_k+1)) / dt,   dt = t_k+1 - t_k
//   biases walk:  b(t + dt) = b(t) + walk sqrt(dt) xi;     sat(y) = max(-range, min(range, y)) on each axis; range 0: none
//
// A reading stamped t_k describes t_k ... t_k+1 and is held over it, as with the recorded CARLA drive: f_k and w_k are what
// integrating units output, velocity and angle gained over the interval, coning and sculling compensated, in the axes at its
// beginning. Then
//
//   v += (R f_k - g z) dt,   R = R exp(w_k dt),   p += v dt + (R f_k - g z) dt^2 / 2         (document 001, eqs 3.2-3.5)
//
// is exact for v and R and of second order for p. A sample of the motion at t_k would leave an error of first order: over a
// minute of city driving, without noise, 0.54 m where these readings leave 7 um (tests/plant/mounted_sensors_test.cpp). The
// bench sends the reading at t_k, one period before a real unit could know it. Noise is white and of one reading. In a
// scenario: [sensor.imu].
#pragma once

#include "common/parameters.hpp"
#include "models/rigid_motion.hpp"

namespace slipstream {

struct Imu {
  double rate_hz = 500.0;
  double noise_mps2 = 0.05, noise_radps = 0.005;                // standard deviation of a sample
  Vector3 bias_mps2{0.0, 0.0, 0.0}, bias_radps{0.0, 0.0, 0.0};  // at the start
  double bias_walk_mps2 = 0.0, bias_walk_radps = 0.0;           // standard deviation after one second
  Vector3 accelerometer_scale{1.0, 1.0, 1.0}, gyro_scale{1.0, 1.0, 1.0};
  double range_mps2 = 0.0, range_radps = 0.0;
  Vector3 position_m{0.0, 0.0, 0.0};  // r, in B
  Vector3 rpy_rad{0.0, 0.0, 0.0};     // of R_BS

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("rate_hz", p.rate_hz, between(1.0, 1e4));
    v.number("noise_mps2", p.noise_mps2, between(0.0, 1e3));
    v.number("noise_radps", p.noise_radps, between(0.0, 1e3));
    v.triple("bias_mps2", p.bias_mps2, between(-100.0, 100.0));
    v.triple("bias_radps", p.bias_radps, between(-10.0, 10.0));
    v.number("bias_walk_mps2", p.bias_walk_mps2, between(0.0, 100.0));
    v.number("bias_walk_radps", p.bias_walk_radps, between(0.0, 10.0));
    v.triple("accelerometer_scale", p.accelerometer_scale, between(0.1, 10.0));
    v.triple("gyro_scale", p.gyro_scale, between(0.1, 10.0));
    v.number("range_mps2", p.range_mps2, between(0.0, 1e5));
    v.number("range_radps", p.range_radps, between(0.0, 1e4));
    v.triple("position_m", p.position_m, between(-100.0, 100.0));
    v.triple("rpy_rad", p.rpy_rad, between(-kPi, kPi));
  }
};

}  // namespace slipstream
