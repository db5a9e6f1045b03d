// What reaches a strapdown filter: in order or late, good or bad. The simulated city drive, through the whole session.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "tests/support/localisation.hpp"

namespace slipstream::test {
namespace {

Scenario city(std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.begin(), {"run.duration_s=20", "plant.truth_rate_hz=100"});
  return shipped("city", overrides);
}

void expect_always_sound(const Localised& run) {
  for (const Estimate& e : run.estimates) {
    if (e.status == EstimateStatus::kInitialising) continue;
    ASSERT_NE(e.status, EstimateStatus::kInvalid) << "at " << seconds(e.header.utime);
    for (const double x : e.mean) ASSERT_TRUE(std::isfinite(x)) << "at " << seconds(e.header.utime);
    const auto n = static_cast<Eigen::Index>(e.mean.size());
    const Eigen::Map<const Eigen::MatrixXd> P(e.covariance.data(), n, n);
    ASSERT_TRUE(P.allFinite()) << "at " << seconds(e.header.utime);
    ASSERT_EQ((P - P.transpose()).cwiseAbs().maxCoeff(), 0.0);
    // Scaled to unit variances, so that metres and radians weigh alike; rounding may leave a little below zero.
    const Eigen::VectorXd scale = P.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
    ASSERT_GE(least, -1e-9) << "at " << seconds(e.header.utime);
  }
}

// What the plain run gives after the disturbance has been forgotten.
void expect_recovered(const Localised& run, double from_s, double most_m) {
  int instants = 0;
  run.each(from_s, 20.0, [&](const Estimate& e, const Eigen::VectorXd& d) {
    ++instants;
    ASSERT_LE(d.head<3>().norm(), most_m) << "at " << seconds(e.header.utime);
  });
  EXPECT_GT(instants, 100);
}

// A delay moves when fixes arrive, not what they say: once all have arrived, the estimates are those without a delay to the
// bit. Both drives draw the same noise, because a sensor's stream is its own.
TEST(LateFixes, GiveTheSameBitsOnceTheyHaveArrived) {
  for (const std::string algorithm : {"es_ekf", "ukf"}) {
    SCOPED_TRACE(algorithm);
    const std::vector<std::string> common{"run.duration_s=6", "sensor.lidar.rate_hz=10", "sensor.gnss.rate_hz=4"};
    auto in_time_overrides = common, late_overrides = common;
    for (const std::string sensor : {"gnss", "lidar"}) {
      in_time_overrides.push_back("sensor." + sensor + ".delay_s=0");
      late_overrides.push_back("sensor." + sensor + (sensor == "gnss" ? ".delay_s=0.2" : ".delay_s=0.07"));
    }
    const Localised in_time = localise_simulated(city(in_time_overrides), algorithm, "matched");
    const Localised late = localise_simulated(city(late_overrides), algorithm, "matched");
    std::map<Utime, const Estimate*> by_time;
    for (const Estimate& e : in_time.estimates) by_time[e.header.utime] = &e;
    int same = 0, other = 0;
    for (const Estimate& e : late.estimates) {
      // GNSS every 0.25 s, there after 0.2 s; LIDAR every 0.1 s, there after 0.07 s. Nothing is on its way from 0.2 to 0.25 s
      // and from 0.07 to 0.1 s after the whole seconds and quarters: the instants in which both hold have 20 to 25 hundredths
      // past a quarter.
      const Utime quarter = e.header.utime % 250'000, tenth = e.header.utime % 100'000;
      if (e.header.utime < 300'000 || quarter < 202'000 || tenth < 72'000) continue;
      const Estimate& expected = *by_time.at(e.header.utime);
      (e.mean == expected.mean && e.covariance == expected.covariance ? same : other) += 1;
    }
    EXPECT_EQ(other, 0);
    EXPECT_GT(same, 100);
    EXPECT_TRUE(late.complaints.empty());
  }
}

TEST(LateFixes, OutOfOrderIsAsInOrder) {
  const Scenario scenario = city({"run.duration_s=6", "sensor.gnss.delay_s=0"});
  const Localised plain = localise_simulated(scenario, "es_ekf", "matched");
  // Every second GNSS fix is held back and sent after its successor.
  std::optional<Reading> held;
  Delivery delivery;
  delivery.reading = [&](RunFollower& follower, Reading& reading) {
    if (reading.quantity != "gnss") return follower.on_reading(reading);
    if (reading.header.seq % 2 == 1) {
      held = reading;
      return;
    }
    follower.on_reading(reading);
    if (held) follower.on_reading(*held);
    held.reset();
  };
  const Localised swapped = localise(scenario, *make_simulated_drive(scenario), "es_ekf", "matched", delivery);
  EXPECT_TRUE(swapped.complaints.empty());
  EXPECT_EQ(swapped.estimates.back().messages_lost, 0);
  // 25 Hz and 6 s: the last fix, at 6.0 s, has an even number, so all have arrived.
  EXPECT_EQ(swapped.estimates.back().mean, plain.estimates.back().mean);
  EXPECT_EQ(swapped.estimates.back().covariance, plain.estimates.back().covariance);
}

TEST(LateFixes, TooLateIsRefusedAndNamed) {
  const Localised late = localise_simulated(city({"run.duration_s=4", "sensor.gnss.delay_s=1.5"}), "es_ekf", "matched");
  ASSERT_EQ(late.complaints.size(), 1U);
  EXPECT_EQ(late.complaints.begin()->first, "gnss: it comes later than history_s of the tuning allows");
  EXPECT_GT(late.estimates.back().messages_rejected, 50);  // 2.5 s at 25 Hz
  expect_always_sound(late);
}

// Nobody says where the car is and which way it looks: what the filter then claims to know is true. 20 independent runs, the
// nine states at three instants: standing, pulling away, in the first curve.
TEST(StartFromFixes, IsAsUncertainAsItSays) {
  constexpr int kRuns = 20;
  // Chi-square with 20 * 9 degrees of freedom over 20: 0.0005 and 0.9995 quantiles, 6.13 and 12.5.
  constexpr double kLow = 6.13, kHigh = 12.5;
  for (const std::string algorithm : {"es_ekf", "ukf"}) {
    std::map<Utime, double> sum{{1'500'000, 0.0}, {3'500'000, 0.0}, {5'900'000, 0.0}};
    for (int seed = 2001; seed < 2001 + kRuns; ++seed) {
      const Localised run =
          localise_simulated(city({"run.duration_s=6", "run.seed=" + std::to_string(seed)}), algorithm, "fixes");
      run.each(1.5, 6.0, [&](const Estimate& e, const Eigen::VectorXd& d) {
        if (const auto found = sum.find(e.header.utime); found != sum.end())
          found->second += Localised::nees(e, d, 0, 9) / kRuns;
      });
    }
    for (const auto& [utime, nees] : sum) {
      std::cout << algorithm << ": mean NEES at " << seconds(utime) << " s: " << nees << "\n";
      EXPECT_GT(nees, kLow) << algorithm << " at " << seconds(utime);
      EXPECT_LT(nees, kHigh) << algorithm << " at " << seconds(utime);
    }
  }
}

// --- Bad input ------------------------------------------------------------------------------------------------------------

TEST(BadInput, NotFiniteIsRefusedAndNamed) {
  int spoilt = 0;
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [&](Reading& r) {
    const double t = seconds(r.header.utime);
    if (r.quantity == "imu" && r.header.seq % 50 == 49 && t > 5.0 && t < 8.0) {
      std::array<double, 6> value;
      std::copy(r.value.begin(), r.value.end(), value.begin());
      value[static_cast<std::size_t>(r.header.seq / 50) % 6] = spoilt % 2 == 0 ? std::nan("") : INFINITY;
      r.value = Values(value);
      ++spoilt;
    }
    return true;
  });
  EXPECT_EQ(run.complaints, (std::map<std::string, int>{{"imu: its value is not finite", spoilt}}));
  EXPECT_EQ(run.estimates.back().messages_rejected, spoilt);
  expect_always_sound(run);
  expect_recovered(run, 10.0, 0.5);
}

TEST(BadInput, ImpossibleLatitudeIsRefusedAndNamed) {
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [](Reading& r) {
    if (r.quantity == "gnss" && r.header.seq == 100) r.value = Values(std::array{95.0, r.value[1], r.value[2]});
    return true;
  });
  EXPECT_EQ(run.complaints, (std::map<std::string, int>{{"gnss: its latitude is not from -90 to 90 degrees", 1}}));
  EXPECT_EQ(run.estimates.back().messages_rejected, 1);
  expect_recovered(run, 5.0, 0.5);
}

TEST(BadInput, AFixTenKilometresAwayIsGated) {
  for (const std::string algorithm : {"es_ekf", "ukf"}) {
    SCOPED_TRACE(algorithm);
    const Localised run = localise_simulated(city(), algorithm, "matched", [](Reading& r) {
      if (r.quantity == "gnss" && r.header.seq == 200) r.value = Values(std::array{r.value[0] + 0.09, r.value[1], r.value[2]});
      return true;
    });
    int gated = 0;
    for (const Estimate& e : run.estimates)
      for (std::size_t i = 0; i < e.innovation_of.size(); ++i)
        if (e.gated[i] != 0 && e.innovation_of[i] == "gnss_north_m") {
          ++gated;
          // 0.09 degrees of latitude at 49 degrees north: 111.2 km a degree; a fix of 0.5 s before may be gated by chance, this
          // one is.
          EXPECT_NEAR(e.innovation[i], 0.09 * 111.2e3, 100.0);
        }
    EXPECT_EQ(gated, 1);
    expect_always_sound(run);
    expect_recovered(run, 3.0, 0.5);
  }
}

TEST(BadInput, TimeGoingBackwardsIsRefusedAndNamed) {
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [](Reading& r) {
    if (r.quantity == "imu" && r.header.seq >= 3000 && r.header.seq < 3010) r.header.utime -= 500'000;
    return true;
  });
  EXPECT_EQ(run.complaints, (std::map<std::string, int>{{"imu: its time goes backwards", 10}}));
  expect_always_sound(run);
  expect_recovered(run, 10.0, 0.5);
}

TEST(BadInput, DuplicateStampsAreRefusedAndNamed) {
  std::map<std::string, Utime> last;
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [&](Reading& r) {
    if ((r.quantity == "imu" && r.header.seq == 3000) || (r.quantity == "gnss" && r.header.seq == 100))
      r.header.utime = last[r.quantity];
    last[r.quantity] = r.header.utime;
    return true;
  });
  EXPECT_EQ(run.complaints, (std::map<std::string, int>{{"gnss: one of the same time is there already", 1},
                                                        {"imu: its time is that of the one before", 1}}));
  EXPECT_EQ(run.estimates.back().messages_lost, 0);
  expect_always_sound(run);
  expect_recovered(run, 10.0, 0.5);
}

TEST(BadInput, AMessageThatCameTwiceIsRefused) {
  const Scenario scenario = city({"run.duration_s=2"});
  Delivery delivery;
  delivery.reading = [](RunFollower& follower, Reading& reading) {
    follower.on_reading(reading);
    follower.on_reading(reading);
  };
  const Localised twice = localise(scenario, *make_simulated_drive(scenario), "es_ekf", "matched", delivery);
  const Localised once = localise_simulated(scenario, "es_ekf", "matched");
  EXPECT_EQ(twice.estimates.back().mean, once.estimates.back().mean);
  EXPECT_EQ(twice.estimates.back().covariance, once.estimates.back().covariance);
  EXPECT_EQ(twice.estimates.back().messages_lost, 0);
  for (const auto& [text, count] : twice.complaints)
    EXPECT_TRUE(text.ends_with("one of the same time is there already")) << text;
}

TEST(BadInput, AnImuThatStopsForTwoSeconds) {
  for (const std::string algorithm : {"es_ekf", "ukf"}) {
    SCOPED_TRACE(algorithm);
    const Localised run = localise_simulated(city(), algorithm, "matched", [](Reading& r) {
      const double t = seconds(r.header.utime);
      return r.quantity != "imu" || t < 8.0 || t >= 10.0;
    });
    expect_always_sound(run);
    int fallback = 0;
    for (const Estimate& e : run.estimates)
      if (e.status == EstimateStatus::kFallback) {
        ++fallback;
        EXPECT_GE(seconds(e.header.utime), 8.0);
        EXPECT_LT(seconds(e.header.utime), 10.0);
      }
    EXPECT_GT(fallback, 150);                             // the estimate goes on with the ticks: truth at 100 Hz, 2 s
    EXPECT_EQ(run.estimates.back().messages_lost, 1000);  // 2 s at 500 Hz, and said so
    // Coasting with fixes at 25 and 10 Hz the truth stays inside three standard deviations.
    int inside = 0, total = 0;
    run.each(8.0, 10.0, [&](const Estimate& e, const Eigen::VectorXd& d) {
      inside += Localised::nees(e, d, 0, 3) <= 14.156 ? 1 : 0;  // chi-square, 3 degrees of freedom, 0.9973
      ++total;
    });
    EXPECT_GE(inside, 0.99 * total);
    expect_recovered(run, 12.0, 0.5);
  }
}

TEST(BadInput, AWrongStartIsGivenUpForTheFixes) {
  const Localised run = localise_simulated(city({"tuning.matched.initial_position_m=[500, 0, 0]"}), "es_ekf", "matched");
  bool said = false;
  for (const auto& [text, count] : run.said)
    said =
        said || (text.starts_with("the last ") && text.ends_with(" fixes were all too unlikely: starts again from the fixes"));
  EXPECT_TRUE(said);
  expect_always_sound(run);
  expect_recovered(run, 15.0, 0.5);
}

// A value that is finite and yet no measurement.
TEST(BadInput, WhatNoImuMeasuresIsRefusedAndNamed) {
  for (const std::string tuning : {"matched", "fixes"})
    for (const double value : {2e5, 1e200}) {
      SCOPED_TRACE(tuning);
      const Localised run = localise_simulated(city(), "es_ekf", tuning, [&](Reading& r) {
        if (r.quantity == "imu" && (r.header.seq == 100 || r.header.seq == 4000)) {
          std::array<double, 6> spoilt{value, 0.0, 0.0, 0.0, 0.0, -value};
          r.value = Values(spoilt);
        }
        return true;
      });
      EXPECT_EQ(run.complaints, (std::map<std::string, int>{{"imu: its value is beyond what any IMU measures", 2}}));
      expect_always_sound(run);
      expect_recovered(run, 10.0, 0.5);
    }
}

// A shock that an IMU can measure: 2 ms of 50000 m/s^2 are 100 m/s. The filter is lost for a while, says so and finds itself
// again.
TEST(BadInput, AShockIsSurvived) {
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [&](Reading& r) {
    if (r.quantity == "imu" && r.header.seq == 3000) r.value = Values(std::array{5e4, 0.0, 9.81, 0.0, 0.0, 0.0});
    return true;
  });
  EXPECT_FALSE(run.said.empty());
  expect_always_sound(run);
  expect_recovered(run, 18.0, 0.5);
}

TEST(BadInput, AStampFarAheadIsRefusedAndNamed) {
  for (const std::string quantity : {"imu", "gnss"}) {
    SCOPED_TRACE(quantity);
    const Localised run = localise_simulated(city(), "es_ekf", "matched", [&](Reading& r) {
      if (r.quantity == quantity && r.header.seq == 100) r.header.utime += 1'000'000'000;
      return true;
    });
    EXPECT_EQ(run.complaints, (std::map<std::string, int>{{quantity + ": its time is more than 30 s ahead of the run", 1}}));
    EXPECT_EQ(run.statuses()[EstimateStatus::kFallback], 0);
    expect_recovered(run, 6.0, 0.5);
  }
}

// A sequence number that jumps is a loss, as far as one can tell, and never more than the wire carries.
TEST(BadInput, ASequenceNumberThatJumpsIsSurvived) {
  const Localised run = localise_simulated(city(), "es_ekf", "matched", [&](Reading& r) {
    if (r.header.seq == 100) r.header.seq = std::int64_t{1} << 53;
    return true;
  });
  expect_always_sound(run);
  EXPECT_GE(run.estimates.back().messages_lost, 0);
  EXPECT_LE(run.estimates.back().messages_lost, std::int64_t{1} << 53);
  expect_recovered(run, 6.0, 0.5);
}

TEST(BadInput, ATickFarAheadIsSurvived) {
  const Scenario scenario = city();
  Delivery delivery;
  delivery.tick = [](RunFollower& follower, Utime utime) {
    follower.on_tick(utime);
    if (utime == 5'000'000) follower.on_tick(Utime{1} << 53);
  };
  const Localised run = localise(scenario, *make_simulated_drive(scenario), "es_ekf", "matched", delivery);
  EXPECT_EQ(run.estimates.back().status, EstimateStatus::kValid);
  EXPECT_EQ(run.estimates.back().header.utime, 20'000'000);
}

// Fixes that come later than the scenario says, or twice, while nothing is known yet.
TEST(BadInput, LateAndRepeatedFixesDuringAStart) {
  const Scenario honest = city();
  Scenario believed = honest;  // of the estimator: fixes come at once
  believed.gnss->delay_s = believed.lidar->delay_s = 0.0;
  Delivery delivery;
  delivery.reading = [](RunFollower& follower, Reading& reading) {
    follower.on_reading(reading);
    if (reading.quantity == "gnss") follower.on_reading(reading);
  };
  Localised run = localise(believed, *make_simulated_drive(honest), "es_ekf", "fixes", delivery);
  EXPECT_EQ(run.estimates.back().status, EstimateStatus::kValid);
  EXPECT_GT(run.complaints["gnss: one of the same time is there already"],
            400);  // 25 Hz, 20 s, but for the first few that came too late
  EXPECT_LT(run.complaints["gnss: it comes later than a start waits for"] +
                run.complaints["lidar: it comes later than a start waits for"],
            10);
}

TEST(BadInput, WhoJoinsInTheMiddleStartsFromTheFixes) {
  const Localised run =
      localise_simulated(city(), "es_ekf", "matched", [](Reading& r) { return seconds(r.header.utime) > 6.0; });
  EXPECT_EQ(run.estimates.front().status, EstimateStatus::kInitialising);
  expect_always_sound(run);
  expect_recovered(run, 15.0, 0.5);
  EXPECT_GT(run.statuses()[EstimateStatus::kValid], 4000);  // of the 7000 instants after 6 s
}

}  // namespace
}  // namespace slipstream::test
