// A car on four wheels as seen from above, and how it stands on them: what plant and estimator share.
//
//   static load of an axle's two wheels:   F_1 = m g a_2 / L,   F_2 = m g a_1 / L,   L = a_1 + a_2
//   steady body roll:   K phi = m h a_y + m g h phi,   K = K_1 + K_2     (right wheels loaded in a turn to the left: phi > 0)
//   steady body pitch:  K_p theta = -m h a_x                              (nose down: theta > 0)
//   from left to right of axle i:  (K_i phi) / w;   from rear to front:  K_p theta / L
//
// Index 1 is the front axle. Body frame: x forward, y left, z up, at the centre of gravity, at height h; the roll axis lies on
// the road, so that springs carry all of the load transfer. w is the track width. Gillespie, Fundamentals of Vehicle Dynamics,
// ch. 1 and 6.
#pragma once

#include <string>

#include "common/parameters.hpp"
#include "common/refusal.hpp"
#include "common/types.hpp"

namespace slipstream {

struct Chassis {
  double mass_kg = 2.8;
  double front_axle_m = 0.134;  // a_1, from the centre of gravity
  double rear_axle_m = 0.122;   // a_2
  double yaw_inertia_kgm2 = 0.2;
  double wheel_radius_m = 0.033;
  double track_width_m = 0.19;                // w
  double cg_height_m = 0.04;                  // h
  double front_roll_stiffness_nmprad = 12.0;  // K_1
  double rear_roll_stiffness_nmprad = 12.0;   // K_2
  double pitch_stiffness_nmprad = 40.0;       // K_p
  double drive_front_share = 0.5;             // of the driving force
  double brake_front_share = 0.5;             // of the braking force
  double slip_speed_eps_mps = 0.1;            // keeps slip angles finite at standstill: short by half of (eps / v)^2

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("mass_kg", p.mass_kg, positive());
    v.number("front_axle_m", p.front_axle_m, positive());
    v.number("rear_axle_m", p.rear_axle_m, positive());
    v.number("yaw_inertia_kgm2", p.yaw_inertia_kgm2, positive());
    v.number("wheel_radius_m", p.wheel_radius_m, positive());
    v.number("track_width_m", p.track_width_m, positive());
    v.number("cg_height_m", p.cg_height_m, non_negative());
    v.number("front_roll_stiffness_nmprad", p.front_roll_stiffness_nmprad, positive());
    v.number("rear_roll_stiffness_nmprad", p.rear_roll_stiffness_nmprad, positive());
    v.number("pitch_stiffness_nmprad", p.pitch_stiffness_nmprad, positive());
    v.number("drive_front_share", p.drive_front_share, between(0.0, 1.0));
    v.number("brake_front_share", p.brake_front_share, between(0.0, 1.0));
    v.number("slip_speed_eps_mps", p.slip_speed_eps_mps, positive());
  }

  double wheelbase_m() const { return front_axle_m + rear_axle_m; }
  double front_load_n() const { return mass_kg * kGravity_mps2 * rear_axle_m / wheelbase_m(); }  // of both wheels
  double rear_load_n() const { return mass_kg * kGravity_mps2 * front_axle_m / wheelbase_m(); }
  double roll_stiffness_nmprad() const { return front_roll_stiffness_nmprad + rear_roll_stiffness_nmprad; }  // K
  // K - m g h: below 0 the body would fall over.
  double net_roll_stiffness_nmprad() const { return roll_stiffness_nmprad() - mass_kg * kGravity_mps2 * cg_height_m; }
  void require_upright() const {
    if (!(net_roll_stiffness_nmprad() > 0.0))
      throw Refusal("vehicle.front_roll_stiffness_nmprad: with the rear's it is " + std::to_string(roll_stiffness_nmprad()) +
                    ", expected more than mass_kg g cg_height_m = " + std::to_string(mass_kg * kGravity_mps2 * cg_height_m) +
                    ": the body would fall over");
  }
  double roll_per_mps2() const { return mass_kg * cg_height_m / net_roll_stiffness_nmprad(); }
  double pitch_per_mps2() const { return -mass_kg * cg_height_m / pitch_stiffness_nmprad; }
};

}  // namespace slipstream
