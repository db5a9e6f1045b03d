#include "common/geodesy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace slipstream {
namespace {

using Vector3 = Vector<double, 3>;

// The ellipsoid from its definition (NIMA TR8350.2): a = 6378137 m, 1/f = 298.257223563.
constexpr double kA = 6378137.0, kF = 1.0 / 298.257223563, kE2 = kF * (2.0 - kF);

Vector3 ecef(const Geodetic& g) {
  const double lat = g.latitude_deg * kPi / 180.0, lon = g.longitude_deg * kPi / 180.0;
  const double n = kA / std::sqrt(1.0 - kE2 * std::sin(lat) * std::sin(lat));
  return {(n + g.height_m) * std::cos(lat) * std::cos(lon), (n + g.height_m) * std::cos(lat) * std::sin(lon),
          (n * (1.0 - kE2) + g.height_m) * std::sin(lat)};
}
// Document 001, section 4.1: geodetic -> ECEF -> ENU, from the textbook's matrix.
Vector3 enu(const Geodetic& origin, const Geodetic& g) {
  const double lat = origin.latitude_deg * kPi / 180.0, lon = origin.longitude_deg * kPi / 180.0;
  Matrix<double, 3> r;
  r << -std::sin(lon), std::cos(lon), 0.0, -std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat),
      std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat);
  return r * (ecef(g) - ecef(origin));
}

const std::vector<Geodetic> kOrigins{{49.0, 8.0, 0.0},    {49.0, 8.0, 110.0},   {0.0, 0.0, 0.0},      {-33.9, 151.2, 40.0},
                                     {64.1, -21.9, 15.0}, {35.7, 179.999, 5.0}, {-23.5, -46.6, 760.0}};

TEST(Geodesy, TheOriginIsNought) {
  for (const Geodetic& o : kOrigins) EXPECT_LT(LocalFrame(o).to_enu(o).norm(), 3e-9);  // rounding of 6.4e6 m
}

TEST(Geodesy, ThereAndBackOverACityIsBelowAMicrometre) {
  for (const Geodetic& o : kOrigins) {
    const LocalFrame frame(o);
    for (double east = -20000.0; east <= 20000.0; east += 2500.0)
      for (double north = -20000.0; north <= 20000.0; north += 2500.0)
        for (const double up : {-100.0, 0.0, 500.0}) {
          const Vector3 p(east, north, up);
          EXPECT_LT((frame.to_enu(frame.to_geodetic(p)) - p).norm(), 1e-6) << o.latitude_deg << ": " << p.transpose();
        }
  }
}

TEST(Geodesy, AgreesWithTheTextbooksChain) {
  for (const Geodetic& o : kOrigins) {
    const LocalFrame frame(o);
    for (const double east : {-20000.0, -300.0, 0.0, 7.0, 20000.0})
      for (const double north : {-20000.0, 0.0, 1234.5}) {
        const Vector3 p(east, north, 25.0);
        EXPECT_LT((enu(o, frame.to_geodetic(p)) - p).norm(),
                  2e-8);  // rounding of differences of 6.4e6 m, and of degrees, 1e-14 of 180
      }
  }
}

// Radii of curvature at 45 deg, where sin^2 = 1/2: along the meridian M = a (1 - e^2) / (1 - e^2 / 2)^1.5, across it N = a /
// sqrt(1 - e^2 / 2). In metres per degree: 111132 and 78847, as in every table of WGS-84; on the equator 111319.49 of
// longitude.
TEST(Geodesy, DegreesHaveTheirLengths) {
  const double small = 1e-3, turn = kPi / 180.0;  // degrees; a chord misses (s / R)^2 / 24 of the arc, 1e-11
  const double meridian = kA * (1.0 - kE2) / std::pow(1.0 - 0.5 * kE2, 1.5) * turn;
  const double parallel = kA / std::sqrt(1.0 - 0.5 * kE2) * std::sqrt(0.5) * turn;
  EXPECT_NEAR(meridian, 111132.0, 0.5);  // the tables' last digit
  EXPECT_NEAR(parallel, 78847.0, 0.5);
  const LocalFrame middle({45.0, 10.0, 0.0});
  const Vector3 south = middle.to_enu({45.0 - small / 2, 10.0, 0.0}), north = middle.to_enu({45.0 + small / 2, 10.0, 0.0});
  EXPECT_NEAR((north - south).norm() / small, meridian, 1e-4);  // rounding of 6.4e6 m / small
  EXPECT_NEAR(middle.to_enu({45.0, 10.0 + small, 0.0}).norm() / small, parallel, 1e-4);
  EXPECT_NEAR(LocalFrame({0.0, 0.0, 0.0}).to_enu({0.0, small, 0.0})[0] / small, 111319.490793, 1e-4);  // 2 pi a / 360
}

TEST(Geodesy, AxesPointEastNorthUpAndTheEarthFallsAway) {
  const LocalFrame frame({49.0, 8.0, 100.0});
  const Vector3 up = frame.to_enu({49.0, 8.0, 130.0});
  EXPECT_LT((up - Vector3(0.0, 0.0, 30.0)).norm(), 3e-9);  // rounding of 6.4e6 m
  EXPECT_GT(frame.to_enu({49.0, 8.01, 100.0})[0], 700.0);
  EXPECT_GT(frame.to_enu({49.01, 8.0, 100.0})[1], 1100.0);
  // d^2 / 2R below the tangent plane: 20 km away 31.3 m, R along the meridian at 49 deg 6371.8 km
  const double north = 20000.0;
  EXPECT_NEAR(frame.to_geodetic({0.0, north, 0.0}).height_m - 100.0, north * north / (2.0 * 6371.8e3), 0.01);  // d^3 and h / R
}

}  // namespace
}  // namespace slipstream
