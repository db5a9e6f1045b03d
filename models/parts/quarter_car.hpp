// Quarter car: one wheel that carries a mass, straight ahead on level ground.
//
//   m v' = F_x - R_aer                     F_x = mu m g,  R_aer = rho C_d A_f v |v| / 2     (document 002, eqs 3.2, 3.13, 3.14)
//   J w' = T - r F_x - T_rol - b w         T_rol = f_r m g r sgn(w)                         (eqs 3.11, 3.12, 3.15)
//
// sgn is regularised as w / sqrt(w^2 + w_eps^2), so that the wheel can stand still. v positive forward, w positive when
// rolling forward, T positive when driving. No load transfer, no grade.
#pragma once

#include <cmath>

#include "common/parameters.hpp"
#include "common/types.hpp"

namespace slipstream {

struct QuarterCar {
  static constexpr double kWheelSpeedEps_radps = 1e-3;

  double mass_kg = 2000.0;  // the Unimog's: document 002, Table 15
  double wheel_inertia_kgm2 = 11.5;
  double wheel_radius_m = 0.52;
  double rolling_resistance = 0.02;   // f_r
  double viscous_friction_nms = 0.0;  // b
  double air_density_kgpm3 = 1.2;
  double frontal_area_m2 = 5.6;
  double drag_coefficient = 0.6;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("mass_kg", p.mass_kg, positive());
    v.number("wheel_inertia_kgm2", p.wheel_inertia_kgm2, positive());
    v.number("wheel_radius_m", p.wheel_radius_m, positive());
    v.number("rolling_resistance", p.rolling_resistance, non_negative());
    v.number("viscous_friction_nms", p.viscous_friction_nms, non_negative());
    v.number("air_density_kgpm3", p.air_density_kgpm3, non_negative());
    v.number("frontal_area_m2", p.frontal_area_m2, non_negative());
    v.number("drag_coefficient", p.drag_coefficient, non_negative());
  }

  double normal_force_n() const { return mass_kg * kGravity_mps2; }

  template <typename T>
  T drag_n(const T& speed_mps) const {
    using std::abs;
    return (0.5 * air_density_kgpm3 * drag_coefficient * frontal_area_m2) * (speed_mps * abs(speed_mps));
  }
  // sgn w
  template <typename T>
  static T direction(const T& w) {
    using std::sqrt;
    return w / sqrt(w * w + kWheelSpeedEps_radps * kWheelSpeedEps_radps);
  }
  template <typename T>
  T rolling_torque_nm(const T& wheel_speed_radps) const {
    return (rolling_resistance * normal_force_n() * wheel_radius_m) * direction(wheel_speed_radps);
  }
  template <typename T>
  T acceleration_mps2(const T& friction, const T& speed_mps) const {
    return kGravity_mps2 * friction - (1.0 / mass_kg) * drag_n(speed_mps);
  }
  template <typename T>
  T wheel_acceleration_radps2(const T& torque_nm, const T& friction, const T& wheel_speed_radps) const {
    return (1.0 / wheel_inertia_kgm2) * (torque_nm - (wheel_radius_m * normal_force_n()) * friction -
                                         rolling_torque_nm(wheel_speed_radps) - viscous_friction_nms * wheel_speed_radps);
  }
};

}  // namespace slipstream
