// Wheel, vehicle and friction without a tyre model: the friction coefficient is a state that only process noise moves.
//
//   w' = (T - b w - (mu + f_r) m g r) / J,   v' = mu g - R_aer(v)/m,   mu' = 0          (document 002, eq. 7.12; b of eq. 5.3)
//   z = (w, a_x),   a_x = v'
//
// The document leaves the drag R_aer out; `drag = false` does so too. Input: T, the torque at this wheel.
// v is not measured: it is the integral of a_x from the start, so its uncertainty grows with time.
#pragma once

#include "models/parts/quarter_car.hpp"
#include "models/process.hpp"

namespace slipstream {

struct LongitudinalFriction {
  static constexpr std::string_view kName = "longitudinal_friction";
  static constexpr int kStates = 3;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"wheel_speed_radps", "rad/s"}, {"speed_mps", "m/s"}, {"friction", "1"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  QuarterCar quarter;
  bool drag = true;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    QuarterCar::visit_parameters(p.quarter, v);
    v.flag("drag", p.drag);
  }

  template <typename T>
  T acceleration(const T& mu, const T& v) const {
    return drag ? quarter.acceleration_mps2(mu, v) : kGravity_mps2 * mu;
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const T& w = x[0];
    const T& v = x[1];
    const T& mu = x[2];
    // Forward driving: T_rol without the sign function, as in the document.
    const double constant = u[0] - quarter.rolling_resistance * quarter.normal_force_n() * quarter.wheel_radius_m;
    const T w_dot = (1.0 / quarter.wheel_inertia_kgm2) *
                    (constant - (quarter.normal_force_n() * quarter.wheel_radius_m) * mu - quarter.viscous_friction_nms * w);
    return {w_dot, acceleration(mu, v), T(0.0)};
  }

  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], acceleration(x[2], x[1])};
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = z * quarter.wheel_radius_m;
    return true;
  }
};

static_assert(ProcessModel<LongitudinalFriction>);

}  // namespace slipstream
