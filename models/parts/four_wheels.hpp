// The forces of four tyres on a car in plane motion: what the plant and an estimator's model share.
//
//   v_i = (v_x - w_z y_i, v_y + w_z x_i), in the wheel's axes (v_along, v_aside);   t_i = -v_aside / sqrt(v_along^2 + eps^2)
//   F_z,i = F_j / 2 -+ K_j lambda / w +- P / 2;   F_x, F_y: lateral_tyre.hpp, and turned by the steering (X_i, Y_i)
//   m a_x = sum X_i,   m a_y = sum Y_i,   I_z w_z' = sum (x_i Y_i - y_i X_i)
//
// Wheel i stands at (x_i, y_i) = (a_1 or -a_2, +-w/2) of axle j. lambda is the roll angle that the springs and dampers answer
// to (phi + c_x phi' / K), P the load that pitch puts on the front axle, N. What drives and what brakes is shared among the
// axles, half and half among an axle's wheels. A wheel's load fades out smoothly where it would lift. Milliken and Milliken,
// Race Car Vehicle Dynamics, ch. 5.
#pragma once

#include <array>

#include "models/parts/chassis.hpp"
#include "models/parts/lateral_tyre.hpp"

namespace slipstream {

struct FourWheels {
  Chassis chassis;
  LateralTyre tyre;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    Chassis::visit_parameters(p.chassis, v);
    LateralTyre::visit_parameters(p.tyre, v);
  }

  template <typename T>
  struct Wheel {
    T slip, load_n;
    T along_n, aside_n;  // F_x, F_y
    T x_n, y_n;          // X, Y
  };
  // How the car moves and stands: T depends on a model's states, U need not.
  template <typename T, typename U>
  struct Motion {
    U v_x;
    T v_y, w_z;
    U delta;
    T lean_rad;    // lambda
    U to_front_n;  // P
    T demand_n;    // longitudinal force of all wheels
  };

  // Front left, front right, rear left, rear right; k in 1/rad and mu, positive, of the tyres of each axle.
  template <typename T, typename U>
  std::array<Wheel<T>, 4> wheels(const Motion<T, U>& at, const std::array<T, 2>& k, const std::array<T, 2>& mu) const {
    using std::cos, std::sin, std::sqrt;
    const Chassis& c = chassis;
    const U steered_cos = cos(at.delta), steered_sin = sin(at.delta);
    const T drive_n = positive_part(at.demand_n, kSplit * c.mass_kg * kGravity_mps2);  // smooth, so that there is no kink
    const T brake_n = at.demand_n - drive_n;
    std::array<Wheel<T>, 4> all;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t axle = i / 2;
      const bool front = axle == 0;
      const double left = i % 2 == 0 ? 1.0 : -1.0, static_n = 0.5 * (front ? c.front_load_n() : c.rear_load_n());
      const double k_roll = front ? c.front_roll_stiffness_nmprad : c.rear_roll_stiffness_nmprad;
      const double drive = front ? c.drive_front_share : 1.0 - c.drive_front_share;
      const double brake = front ? c.brake_front_share : 1.0 - c.brake_front_share;
      const U cd = front ? steered_cos : U(1.0), sd = front ? steered_sin : U(0.0);
      const T v_i = at.v_x - (left * 0.5 * c.track_width_m) * at.w_z;
      const T w_i = at.v_y + (front ? c.front_axle_m : -c.rear_axle_m) * at.w_z;
      const T along = cd * v_i + sd * w_i, aside = cd * w_i - sd * v_i;
      Wheel<T>& wheel = all[i];
      wheel.slip = -aside / sqrt(along * along + c.slip_speed_eps_mps * c.slip_speed_eps_mps);
      const U even_n = static_n + (front ? 0.5 : -0.5) * at.to_front_n;
      wheel.load_n = positive_part(T(even_n - (left * k_roll / c.track_width_m) * at.lean_rad), kLeastLoad * static_n);
      const auto f = tyre.force(wheel.slip, k[axle], mu[axle], wheel.load_n, static_n,
                                T((0.5 * drive) * drive_n + (0.5 * brake) * brake_n));
      wheel.along_n = f.along_n;
      wheel.aside_n = f.aside_n;
      wheel.x_n = cd * f.along_n - sd * f.aside_n;
      wheel.y_n = sd * f.along_n + cd * f.aside_n;
    }
    return all;
  }

  template <typename T>
  struct Accelerations {
    T forward_mps2, lateral_mps2;  // a_x, a_y, level
    T yaw_radps2;
  };
  template <typename T>
  Accelerations<T> accelerations(const std::array<Wheel<T>, 4>& w) const {
    const Chassis& c = chassis;
    const T front_y = w[0].y_n + w[1].y_n, rear_y = w[2].y_n + w[3].y_n;
    const T left_x = w[0].x_n + w[2].x_n, right_x = w[1].x_n + w[3].x_n;
    const T moment_nm = c.front_axle_m * front_y - c.rear_axle_m * rear_y + (0.5 * c.track_width_m) * (right_x - left_x);
    return {(left_x + right_x) * (1.0 / c.mass_kg), (front_y + rear_y) * (1.0 / c.mass_kg),
            moment_nm * (1.0 / c.yaw_inertia_kgm2)};
  }

 private:
  static constexpr double kLeastLoad = 0.02;  // of the static load
  static constexpr double kSplit = 0.01;      // of the weight: forces much above it either drive or brake
};

}  // namespace slipstream
