// Position fixes of a point r (lever arm, in B) of the body: GNSS as latitude, longitude, height; LIDAR in its map's own frame.
//
//   GNSS    p_WS = p + R r + diag(noise_m) xi  in W's axes, then geodetic (common/geodesy.hpp)
//   LIDAR   l = C' (p + R r - t) + diag(noise_m) xi  in the map's axes;   so p + R r = C l + t
//           C = R(map_rpy_rad),   t = map_offset_m
//
// A fix carries the time of its measurement and is sent `delay_s` later. During an outage none is measured. In a scenario:
// [sensor.gnss], [sensor.lidar]; of a recorded drive they say what estimators believe, and its outages drop what was recorded.
#pragma once

#include <vector>

#include "common/parameters.hpp"
#include "models/rigid_motion.hpp"

namespace slipstream {

struct FixSensor {
  double rate_hz = 10.0;
  Vector3 noise_m{0.1, 0.1, 0.1};  // standard deviations
  double delay_s = 0.0;
  std::vector<double> outages_s;      // from, to, from, to, ...: from <= t < to
  Vector3 position_m{0.0, 0.0, 0.0};  // r

  bool is_out(double t_s) const {
    for (std::size_t i = 0; i + 1 < outages_s.size(); i += 2)
      if (outages_s[i] <= t_s && t_s < outages_s[i + 1]) return true;
    return false;
  }

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("rate_hz", p.rate_hz, between(1e-3, 1e3));
    v.triple("noise_m", p.noise_m, Range{0.0, 1e4, true});
    v.number("delay_s", p.delay_s, between(0.0, 10.0));
    v.list("outages_s", p.outages_s, between(0.0, 1e6));
    v.triple("position_m", p.position_m, between(-100.0, 100.0));
  }
};

struct Gnss : FixSensor {};

struct Lidar : FixSensor {
  Vector3 map_rpy_rad{0.0, 0.0, 0.0};
  Vector3 map_offset_m{0.0, 0.0, 0.0};

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    FixSensor::visit_parameters(p, v);
    v.triple("map_rpy_rad", p.map_rpy_rad, between(-kPi, kPi));
    v.triple("map_offset_m", p.map_offset_m, between(-1e6, 1e6));
  }
};

}  // namespace slipstream
