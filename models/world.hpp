// Where a run takes place: the origin of W (east-north-up, WGS-84), and gravity there.
#pragma once

#include "common/geodesy.hpp"
#include "common/parameters.hpp"

namespace slipstream {

struct World {
  Geodetic origin{49.0, 8.0, 0.0};  // of CARLA's towns, document 001
  double gravity_mps2 = kGravity_mps2;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("latitude_deg", p.origin.latitude_deg, between(-90.0, 90.0));
    v.number("longitude_deg", p.origin.longitude_deg, between(-180.0, 180.0));
    v.number("height_m", p.origin.height_m, between(-1e4, 1e5));
    v.number("gravity_mps2", p.gravity_mps2, between(0.0, 100.0));
  }
};

}  // namespace slipstream
