// Localising the recorded cars through the whole session: the figures that the README beside the data and the bars name.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/localisation.hpp"

namespace slipstream::test {
namespace {

constexpr const char* kCarla = "coursera_carla_pt1";

Localised carla(const std::string& tuning, const std::vector<std::string>& overrides = {}, const Tamper& tamper = nullptr,
                const std::string& algorithm = "es_ekf", const std::string& scenario = "coursera_carla") {
  return localise_recorded(shipped(scenario, overrides), recorded_folder(kCarla), algorithm, tuning, tamper);
}

const std::vector<std::string> kWithoutLidar{"tuning.document.use_lidar=false", "tuning.matched.use_lidar=false"};

TEST(Carla, TheDocumentsFilterAttainsThePublishedFigures) {
  SLIPSTREAM_NEEDS_DATA(kCarla);
  constexpr double kTolerance_m = 0.005;  // the issue's
  const Localised gnss = carla("document", kWithoutLidar);
  EXPECT_NEAR(gnss.position_rmse(), 0.195, kTolerance_m);
  EXPECT_LE(gnss.position_rmse(), 0.200);
  const Localised all = carla("document");
  EXPECT_NEAR(all.position_rmse(), 0.177, kTolerance_m);
  EXPECT_LE(all.position_rmse(), 0.180);
  EXPECT_GE(all.mean_position_nees(), 2.4);  // 3 for a consistent filter; the band
  EXPECT_LE(all.mean_position_nees(), 3.6);
}

TEST(Carla, TheMatchedFilterIsAsGood) {
  SLIPSTREAM_NEEDS_DATA(kCarla);
  for (const std::string algorithm : {"es_ekf"}) {
    SCOPED_TRACE(algorithm);
    const Localised gnss = carla("matched", kWithoutLidar, nullptr, algorithm), all = carla("matched", {}, nullptr, algorithm);
    EXPECT_LE(gnss.position_rmse(), 0.200);
    EXPECT_LE(all.position_rmse(), 0.180);
    EXPECT_GE(all.mean_position_nees(), 2.4);
    EXPECT_LE(all.mean_position_nees(), 3.6);
    EXPECT_GE(gnss.mean_position_nees(), 2.4);
    EXPECT_LE(gnss.mean_position_nees(), 3.6);
  }
}

TEST(Carla, StartedFromTheFirstFixesItCatchesUpInTenSeconds) {
  SLIPSTREAM_NEEDS_DATA(kCarla);
  constexpr double kFirst_s = 2.055;  // of the recording
  const Localised told = carla("matched"), fixes = carla("fixes");
  std::cout << "from fixes " << fixes.position_rmse(kFirst_s + 10.0) << " m, from truth " << told.position_rmse(kFirst_s + 10.0)
            << " m\n";
  EXPECT_LE(fixes.position_rmse(kFirst_s + 10.0), 1.15 * told.position_rmse(kFirst_s + 10.0));
  // It says that it is starting until it knows its heading: the car stands until 3.0 s.
  EXPECT_EQ(fixes.estimates.front().status, EstimateStatus::kInitialising);
  EXPECT_GT(fixes.statuses()[EstimateStatus::kValid], 8000);  // of 10918 instants
}

// The largest step of roll, pitch or yaw from one instant to the next beyond the car's own.
double attitude_jump_deg(const Localised& run, double from_s) {
  double largest = 0.0;
  std::optional<Eigen::VectorXd> before;
  run.each(from_s, 1e9, [&](const Estimate& e, const Eigen::VectorXd& d) {
    if (before)
      for (Eigen::Index i = 6; i < 9; ++i) {
        const double j = std::abs(wrap_angle(d[i] - (*before)[i])) * 180.0 / kPi;
        if (j > 0.8) std::cout << "  jump " << i << " " << j << " at " << seconds(e.header.utime) << " sigma " << std::sqrt(e.covariance[static_cast<std::size_t>(i)*16])*57.3 << "\n";
        largest = std::max(largest, j);
      }
    before = d;
  });
  return largest;
}

// GNSS is away for 7 s, LIDAR for 6 s of them.
TEST(Carla, AGapIsCoveredByThePromisedUncertainty) {
  SLIPSTREAM_NEEDS_DATA(kCarla);
  constexpr double kFrom_s = 25.0, kLidarTo_s = kFrom_s + 6.0, kGnssTo_s = kFrom_s + 7.0;
  for (const std::string algorithm : {"es_ekf"}) {
    SCOPED_TRACE(algorithm);
    const Localised gap =
        carla("matched", {"sensor.gnss.outages_s=[25.0, 32.0]", "sensor.lidar.outages_s=[25.0, 31.0]"}, nullptr, algorithm);
    constexpr double kThreeSigma = 14.156;  // chi-square with 3 degrees of freedom, 0.9973
    int inside = 0, total = 0;
    gap.each(kFrom_s, kLidarTo_s, [&](const Estimate& e, const Eigen::VectorXd& d) {
      inside += Localised::nees(e, d, 0, 3) <= kThreeSigma ? 1 : 0;
      ++total;
    });
    ASSERT_EQ(total, 1201);  // 6 s at 200 Hz, both ends
    EXPECT_GE(inside, 0.99 * total);

    std::cout << algorithm << ": inside 3 sigma " << inside << " of " << total << ", largest jump " << attitude_jump_deg(gap, kFrom_s)
              << " deg\n";
    EXPECT_LE(attitude_jump_deg(gap, kFrom_s), 1.0);

    // Two GNSS fixes after the gap it is as good as without one: within three of its own standard deviations, which are small.
    gap.each(kGnssTo_s + 1.01, kGnssTo_s + 2.0, [&](const Estimate& e, const Eigen::VectorXd& d) {
      EXPECT_LE(d.head<3>().norm(), 0.6) << "at " << seconds(e.header.utime);  // the largest error without a gap is 0.6 m
      EXPECT_LE(Localised::nees(e, d, 0, 3), kThreeSigma) << "at " << seconds(e.header.utime);
    });
  }
}

TEST(Carla, WrongCalibrationAsTheCourseHasIt) {
  SLIPSTREAM_NEEDS_DATA(kCarla);
  const Localised wrong = carla("document", {}, nullptr, "es_ekf", "coursera_wrong_lidar");
  EXPECT_NEAR(wrong.position_rmse(), 2.25, 0.02);  // README, two digits after the point
  double nis = 0.0;
  int fixes = 0;
  for (const Estimate& e : wrong.estimates)
    for (std::size_t i = 0; i < e.innovation_of.size(); ++i) {
      if (e.innovation_of[i] != "gnss_east_m") continue;
      const auto m = static_cast<Eigen::Index>(e.innovation.size());
      const Eigen::Map<const Eigen::MatrixXd> S(e.innovation_covariance.data(), m, m);
      const Eigen::Map<const Eigen::VectorXd> nu(e.innovation.data(), m);
      const auto k = static_cast<Eigen::Index>(i);
      nis += nu.segment(k, 3).dot(S.block(k, k, 3, 3).llt().solve(nu.segment(k, 3)));
      ++fixes;
    }
  EXPECT_NEAR(nis / fixes, 500.0, 25.0);  // README: "about 500"
}

constexpr const char* kCivic = "comma2k19_civic";

// The README's window: the first seconds align the filter.
TEST(Civic, VelocityIsGoodToFiveCentimetresASecond) {
  SLIPSTREAM_NEEDS_DATA(kCivic);
  const Localised car = localise_recorded(shipped("comma_civic"), recorded_folder(kCivic), "es_ekf", "matched");
  const double east = car.rmse(3, 1, 3.0, 59.0), north = car.rmse(4, 1, 3.0, 59.0), up = car.rmse(5, 1, 3.0, 59.0);
  std::cout << "velocity RMSE east " << east << ", north " << north << ", up " << up << " m/s\n";
  EXPECT_LE(east, 0.05);
  EXPECT_LE(north, 0.05);
}

TEST(Civic, FifteenSecondsWithoutGnssCostLittle) {
  SLIPSTREAM_NEEDS_DATA(kCivic);
  const Localised whole = localise_recorded(shipped("comma_civic"), recorded_folder(kCivic), "es_ekf", "matched");
  const Localised gap = localise_recorded(shipped("comma_civic", {"sensor.gnss.outages_s=[30.0, 45.0]"}), recorded_folder(kCivic),
                                          "es_ekf", "matched");
  double largest = 0.0, cost = 0.0;
  std::map<Utime, Eigen::VectorXd> undisturbed;
  whole.each(30.0, 45.0, [&](const Estimate& e, const Eigen::VectorXd& d) { undisturbed[e.header.utime] = d; });
  gap.each(30.0, 45.0, [&](const Estimate& e, const Eigen::VectorXd& d) {
    largest = std::max(largest, d.head<2>().norm());
    cost = std::max(cost, (d - undisturbed.at(e.header.utime)).head<2>().norm());
  });
  std::cout << "largest horizontal error in the gap " << largest << " m, of it the gap's " << cost << " m\n";
  EXPECT_LE(largest, 0.7);
}

}  // namespace
}  // namespace slipstream::test
