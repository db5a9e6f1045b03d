// A local east-north-up frame W on the WGS-84 ellipsoid, and the way between its metres and latitude, longitude, height:
// geodetic -> earth-centred earth-fixed (ECEF) -> ENU, exactly (GeographicLib), not a flat-earth approximation.
//
// Latitude and longitude in degrees, height in metres above the ellipsoid. The .cpp is the only file that names GeographicLib.
#pragma once

#include <memory>

#include "common/types.hpp"

namespace slipstream {

struct Geodetic {
  double latitude_deg = 0.0;   // -90 to 90
  double longitude_deg = 0.0;  // -180 to 180
  double height_m = 0.0;
};

class LocalFrame {
 public:
  explicit LocalFrame(const Geodetic& origin);
  ~LocalFrame();
  LocalFrame(LocalFrame&&) noexcept;
  LocalFrame& operator=(LocalFrame&&) noexcept;

  Vector<double, 3> to_enu(const Geodetic& at) const;
  Geodetic to_geodetic(const Vector<double, 3>& enu_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace slipstream
