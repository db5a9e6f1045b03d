#include "common/geodesy.hpp"

#include <GeographicLib/LocalCartesian.hpp>

namespace slipstream {

struct LocalFrame::Impl {
  GeographicLib::LocalCartesian frame;
};

LocalFrame::LocalFrame(const Geodetic& origin)
    : impl_(std::make_unique<Impl>(
          Impl{GeographicLib::LocalCartesian(origin.latitude_deg, origin.longitude_deg, origin.height_m)})) {}
LocalFrame::~LocalFrame() = default;
LocalFrame::LocalFrame(LocalFrame&&) noexcept = default;
LocalFrame& LocalFrame::operator=(LocalFrame&&) noexcept = default;

Vector<double, 3> LocalFrame::to_enu(const Geodetic& at) const {
  Vector<double, 3> enu_m;
  impl_->frame.Forward(at.latitude_deg, at.longitude_deg, at.height_m, enu_m[0], enu_m[1], enu_m[2]);
  return enu_m;
}

Geodetic LocalFrame::to_geodetic(const Vector<double, 3>& enu_m) const {
  Geodetic at;
  impl_->frame.Reverse(enu_m[0], enu_m[1], enu_m[2], at.latitude_deg, at.longitude_deg, at.height_m);
  return at;
}

}  // namespace slipstream
