// Gearbox and differential: engine to wheel, rigid.
//
//   w_m = w i_dif i_cx                      (document 002, eq. 7.7)
//   T   = eta_t i_cx i_dif T_m              (eq. 7.10), eta_t = eta_cx eta_dif (eq. 7.9)
//   v_x = w_m r_e / (i_cx i_dif)            (eq. 7.8), without slip
//
// Gears count from 1. T is the torque at all driven wheels together; `share` of it reaches one wheel.
#pragma once

#include <vector>

#include "common/types.hpp"

namespace slipstream {

struct Driveline {
  std::vector<double> gear_ratio{9.57, 6.635, 4.375, 3.219, 2.188, 1.517, 1.0, 0.736};  // Table 13
  double final_drive = 6.94;                                                            // Table 13, i_dif
  double efficiency = 0.9;                                                              // eta_t

  int gears() const { return static_cast<int>(gear_ratio.size()); }
  double total_ratio(int gear) const { return gear_ratio[static_cast<std::size_t>(gear - 1)] * final_drive; }

  template <typename T>
  T engine_speed_radps(const T& wheel_speed_radps, int gear) const {
    return total_ratio(gear) * wheel_speed_radps;
  }
  template <typename T>
  T wheel_torque_nm(const T& engine_torque_nm, int gear) const {
    return (efficiency * total_ratio(gear)) * engine_torque_nm;
  }
  double speed_mps(double engine_speed_radps, int gear, double effective_radius_m) const {
    return engine_speed_radps * effective_radius_m / total_ratio(gear);
  }
};

}  // namespace slipstream
