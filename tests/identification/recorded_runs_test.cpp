#include "estimators/identification/recorded_runs.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/random.hpp"
#include "common/refusal.hpp"
#include "io/csv.hpp"

namespace slipstream {
namespace {

const std::string kData = SLIPSTREAM_DATA_DIR;

// --- Synthetic: closed forms, with noise ------------------------------------------------------------------------------

TEST(RecordedRuns, SteadyLineIsFound) {
  RandomStream random(1001, 0, "steady_line");
  std::vector<double> u, v;
  for (int k = 0; k <= 60; ++k) {
    u.push_back(0.005 * k);
    v.push_back(std::min(12.0 * std::max(u.back() - 0.02, 0.0), 2.5) + 0.01 * random.normal());
  }
  const SteadyLine line = identify_steady_line(u, v);
  EXPECT_TRUE(line.gain.contains(12.0));
  EXPECT_TRUE(line.dead_band.contains(0.02));
  EXPECT_TRUE(line.limit.contains(2.5));
  EXPECT_LT(line.gain.half_width,
            0.2);             // 0.01 over some 40 points that span 0.2: 1.96 * 0.01 / (0.06 sqrt 40) = 0.05, few lags
  EXPECT_GT(line.r2, 0.999);  // 1 - 0.01^2 / 0.9^2
}

std::vector<DriveRun> first_order_runs(double noise) {
  RandomStream random(1001, 0, "first_order");
  std::vector<DriveRun> runs;
  for (const double u : {0.01, 0.04, 0.06, 0.08, 0.1}) {
    DriveRun run;
    for (int k = 0; k < 80; ++k) {
      run.utime.push_back(66'000 * k + (k % 3) * 5'000);  // a logger's jitter
      run.input.push_back(u);
      run.speed.push_back(14.0 * std::max(u - 0.03, 0.0) * -std::expm1(-seconds(run.utime.back()) / 0.4) +
                          (k > 0 ? noise * random.normal() : 0.0));
    }
    runs.push_back(run);
  }
  return runs;
}

TEST(RecordedRuns, FirstOrderIsFound) {
  const FirstOrder clean = identify_first_order(first_order_runs(0.0));
  EXPECT_NEAR(clean.time_constant_s.value, 0.4, 1e-3);  // the swarm's tolerance, 1e-6 of 1 - R2, is a thousandth of a parameter
  EXPECT_NEAR(clean.gain.value, 14.0, 14e-3);
  EXPECT_NEAR(clean.dead_band.value, 0.03, 3e-5);
  const FirstOrder noisy = identify_first_order(first_order_runs(0.01));
  EXPECT_TRUE(noisy.time_constant_s.contains(0.4));
  EXPECT_TRUE(noisy.gain.contains(14.0));
  EXPECT_TRUE(noisy.dead_band.contains(0.03));
  EXPECT_EQ(noisy.simulated.size(), noisy.measured.size());
}

TEST(RecordedRuns, RollingDriveIsFound) {
  RandomStream random(1001, 0, "rolling");
  std::vector<DriveRun> runs;
  for (const double direction : {1.0, -1.0}) {  // i constant by halves: w' = (k i - c)/J - b w / J each
    DriveRun run;
    double start = 15.0;
    for (int k = 0; k < 400; ++k) {
      const int half = k % 200;
      const double i = k < 200 ? 20.0 : 5.0, limit = (0.03 * i - 0.1) / 0.008;
      if (k == 200)
        start = (0.03 * 20.0 - 0.1) / 0.008 + (15.0 - (0.03 * 20.0 - 0.1) / 0.008) * std::exp(-200 * 0.01 * 0.008 / 0.01);
      run.utime.push_back(10'000 * k);
      run.input.push_back(direction * i);
      run.speed.push_back(direction * (limit + (start - limit) * std::exp(-half * 0.01 * 0.008 / 0.01)) +
                          0.2 * random.normal());
    }
    runs.push_back(run);
  }
  const RollingDrive r = identify_rolling_drive(runs, 0.03);
  // The current falls at a sample, the response takes it as a slope before that sample: 5 ms of 1.25 s early.
  EXPECT_NEAR(r.inertia_kgm2.value, 0.01, 1e-4 + r.inertia_kgm2.half_width);
  EXPECT_NEAR(r.friction_nms.value, 0.008, 1e-4 + r.friction_nms.half_width);
  EXPECT_NEAR(r.friction_torque_nm.value, 0.1, 1e-3 + r.friction_torque_nm.half_width);
  EXPECT_LT(r.inertia_kgm2.half_width, 1e-3);  // informative: 10 %
  EXPECT_GT(r.r2, 0.999);                      // 1 - 0.2^2 / 20^2, both directions
}

TEST(RecordedRuns, Splitting) {
  const std::vector<double> t{0, 1, 2, 3, 10, 11, 12, 13, 14, 15}, u{0, 1, 2, 3, 4, 5, 6, 7, 8, 9},
      v{5, 5, 5, 5, 5, 5, 0.1, -5, -5, 5};
  const auto by_gap = split_into_runs(t, u, v, 2.0, 0.0, 2);
  ASSERT_EQ(by_gap.size(), 2u);
  EXPECT_EQ(by_gap[0].input, (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(by_gap[1].utime.front(), 10'000'000);
  const auto by_speed = split_into_runs(t, u, v, 2.0, 1.0, 2);
  ASSERT_EQ(by_speed.size(), 3u);
  EXPECT_EQ(by_speed[1].input, (std::vector<double>{4, 5}));
  EXPECT_EQ(by_speed[2].input, (std::vector<double>{7, 8})) << "the last sample turns back and is alone";
}

template <typename F>
std::string message(const F& f) {
  try {
    f();
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return "(accepted)";
}

TEST(RecordedRuns, Refusals) {
  EXPECT_EQ(message([] {
              split_into_runs({0, 1}, {0}, {0, 1}, 1.0);
            }),
            "identification: 2 and 1 times and inputs, expected as many");
  EXPECT_EQ(message([] {
              split_into_runs({0, 1}, {0, 1}, {0}, 1.0);
            }),
            "identification: 2 and 1 times and speeds, expected as many");
  EXPECT_EQ(message([] {
              split_into_runs({0, 1, 1}, {0, 1, 2}, {0, 1, 2}, 1.0);
            }),
            "identification: time 1 s after 1 s, expected growing times");
  EXPECT_EQ(message([] {
              identify_steady_line({0, 1}, {0});
            }),
            "identification: 2 and 1 commands and speeds, expected as many");
  EXPECT_EQ(message([] {
              identify_steady_line({0, 1}, {0, 1});
            }),
            "identification: 2 samples, expected at least 10 for each of 3 parameters");
  EXPECT_EQ(message([] { identify_steady_line({0, 0}, {0, 1}); }), "identification: expected commands and speeds above 0");
  EXPECT_EQ(message([] { identify_first_order({}); }), "identification: no run, expected at least 1");
}

// --- Recorded ----------------------------------------------------------------------------------------------------------

void show(const char* name, const Interval& i) {
  ::testing::Test::RecordProperty(name, std::to_string(i.value) + " +- " + std::to_string(i.half_width));
}

TEST(RecordedRuns, QcarOnTheStand) {
  if (!std::filesystem::is_directory(kData + "/qcar_speed")) GTEST_SKIP() << "no recorded data";
  const CsvTable t = read_csv(kData + "/qcar_speed/stand_sweep.csv", {"cmd_pwm", "v_mean_mps"});
  const SteadyLine line = identify_steady_line(t["cmd_pwm"], t["v_mean_mps"]);
  show("gain", line.gain), show("dead_band", line.dead_band), show("limit", line.limit);
  // The data's README, by another fit: "about 14.8 (cmd - 0.016), flat at 2.75"; half of its last digits beside the interval.
  EXPECT_NEAR(line.gain.value, 14.8, 0.05 + line.gain.half_width);
  EXPECT_NEAR(line.dead_band.value, 0.016, 0.0005 + line.dead_band.half_width);
  EXPECT_NEAR(line.limit.value, 2.75, 0.005 + line.limit.half_width);
  EXPECT_LT(line.dead_band.half_width, 0.005);  // one step of the sweep: first motion is between 0.015 and 0.020
  EXPECT_GT(line.r2, 0.999);                    // measured 0.9993
}

TEST(RecordedRuns, QcarOnTheFloor) {
  if (!std::filesystem::is_directory(kData + "/qcar_speed")) GTEST_SKIP() << "no recorded data";
  const CsvTable t = read_csv(kData + "/qcar_speed/ground_runs.csv", {"t_s", "cmd_pwm", "v_enc_mps"}, "t_s");
  const auto runs = split_into_runs(t["t_s"], t["cmd_pwm"], t["v_enc_mps"], 0.5);
  EXPECT_EQ(runs.size(), 18u);
  const FirstOrder f = identify_first_order(runs);
  show("time_constant_s", f.time_constant_s), show("gain", f.gain), show("dead_band", f.dead_band);
  // The README: steady speed "about 13.4 (cmd - 0.0285)", first motion between 0.030 and 0.035.
  EXPECT_NEAR(f.gain.value, 13.4, 0.05 + f.gain.half_width);
  EXPECT_NEAR(f.dead_band.value, 0.0285, 0.00005 + f.dead_band.half_width);
  EXPECT_GT(f.time_constant_s.value, f.time_constant_s.half_width);
  EXPECT_GT(f.r2, 0.97);  // measured 0.980
}

TEST(RecordedRuns, F1tenthOnTheFloor) {
  if (!std::filesystem::is_directory(kData + "/f1tenth_friction/ds5a")) GTEST_SKIP() << "no recorded data";
  const CsvTable t = read_csv(kData + "/f1tenth_friction/ds5a/motor.csv", {"t_s", "i_motor_A", "erpm_fwd"}, "t_s");
  const double radius_m = 0.319 / (2.0 * kPi);  // the README's circumference, speed = erpm / 7459
  std::vector<double> wheel_radps;
  for (const double erpm : t["erpm_fwd"]) wheel_radps.push_back(erpm / 7459.0 / radius_m);
  const auto runs = split_into_runs(t["t_s"], t["i_motor_A"], wheel_radps, 0.3, 10.0);
  const RollingDrive r = identify_rolling_drive(runs, 0.0027 * 11.85);
  show("inertia_kgm2", r.inertia_kgm2), show("friction_nms", r.friction_nms), show("friction_torque_nm", r.friction_torque_nm);
  RecordProperty("r2", std::to_string(r.r2));
  // All that moves is at least the car's mass, 3.33 kg: m r^2 = 8.6e-3 kg m^2. Wheels and rotor come on top, some 2e-3.
  EXPECT_GT(r.inertia_kgm2.value + r.inertia_kgm2.half_width, 8.6e-3);
  EXPECT_LT(r.inertia_kgm2.value - r.inertia_kgm2.half_width, 8.6e-3 + 2e-3);
  EXPECT_GT(r.r2, 0.8);  // measured 0.84: the current is sampled at 18 Hz and changes faster
}

}  // namespace
}  // namespace slipstream
