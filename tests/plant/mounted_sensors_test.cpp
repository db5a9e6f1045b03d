// IMU, GNSS and LIDAR on a moving body: closed forms, noise, delay, outages, and how well an IMU's readings integrate.
#include "plant/mounted_sensors.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/refusal.hpp"
#include "common/rk4.hpp"
#include "models/scenario.hpp"
#include "models/strapdown.hpp"
#include "plant/simulated_drive.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {
namespace {

constexpr double kG = 9.81;

Vector3 triple(const Values& v, std::size_t from) { return {v[from], v[from + 1], v[from + 2]}; }

Imu noise_free() {
  Imu imu;
  imu.noise_mps2 = imu.noise_radps = 0.0;
  return imu;
}

// One reading of 2 ms.
Values read(const Imu& imu, const RigidMotion& first, const RigidMotion& last) {
  return MountedImu(imu, kG, RandomStream(1, 0, "imu")).read(0, first, 2000, last);
}

// A body that turns about its own z axis at w, seen at time t.
RigidMotion spinning(double w, double t) {
  RigidMotion m;
  m.q_WB = rotation_exp({0.0, 0.0, w * t});
  m.w_WB_B = {0.0, 0.0, w};
  return m;
}

// --- Closed forms -----------------------------------------------------------------------------------------------------

// At r in front of the axis the velocity is w r across; over dt it turns by w dt. In the axes at the beginning it gains
// w r (-sin w dt, cos w dt - 1).
TEST(MountedImu, ALeverArmOnASpinningBodyFeelsTheCentripetalForce) {
  const double w = 3.0, r = 0.5, dt = 0.002;
  Imu imu = noise_free();
  imu.position_m = {r, 0.0, 0.0};
  const Values z = read(imu, spinning(w, 1.0), spinning(w, 1.0 + dt));
  const Vector3 f(-w * r * std::sin(w * dt) / dt, w * r * (std::cos(w * dt) - 1.0) / dt, kG);
  EXPECT_LT((triple(z, 0) - f).norm(), 1e-12);  // rounding / dt
  EXPECT_NEAR(z[0], -w * w * r, 1e-4);          // w^2 r (w dt)^2 / 6 = 2.7e-5
  EXPECT_LT((triple(z, 3) - Vector3(0.0, 0.0, w)).norm(), 1e-12);

  imu.rpy_rad = {0.0, 0.0, kPi / 2.0};  // its x axis points to the body's left
  const Values turned = read(imu, spinning(w, 1.0), spinning(w, 1.0 + dt));
  EXPECT_LT((triple(turned, 0) - Vector3(f[1], -f[0], kG)).norm(), 1e-12);
  imu.rpy_rad = {kPi, 0.0, 0.0};  // upside down
  EXPECT_LT((triple(read(imu, spinning(w, 0.0), spinning(w, dt)), 3) - Vector3(0.0, 0.0, -w)).norm(), 1e-12);
}

TEST(MountedImu, ScaleBiasAndSaturation) {
  Imu imu = noise_free();
  imu.accelerometer_scale = {1.0, 1.0, 1.01};
  imu.gyro_scale = {1.0, 1.0, 0.9};
  imu.bias_mps2 = {0.1, -0.2, 0.3};
  imu.bias_radps = {0.01, 0.02, -0.03};
  const Values z = read(imu, spinning(2.0, 0.0), spinning(2.0, 0.002));
  EXPECT_LT((triple(z, 0) - Vector3(0.1, -0.2, 1.01 * kG + 0.3)).norm(), 1e-12);
  EXPECT_LT((triple(z, 3) - Vector3(0.01, 0.02, 0.9 * 2.0 - 0.03)).norm(), 1e-12);
  imu.range_mps2 = 5.0;
  imu.range_radps = 1.5;
  imu.bias_mps2[0] = -7.0;
  const Values full = read(imu, spinning(2.0, 0.0), spinning(2.0, 0.002));
  EXPECT_EQ(triple(full, 0), Vector3(-5.0, -0.2, 5.0));
  EXPECT_EQ(full[5], 1.5);
}

// Free fall while turning: nothing is felt but the turning.
TEST(MountedImu, InFreeFallThereIsNoForce) {
  RigidMotion a = spinning(1.0, 0.0), b = spinning(1.0, 0.002);
  a.v_WB = {3.0, 4.0, 5.0};
  b.v_WB = {3.0, 4.0, 5.0 - kG * 0.002};
  EXPECT_LT(triple(read(noise_free(), a, b), 0).norm(), 1e-12);  // rounding / dt
}

TEST(MountedFixes, AreOfTheirLeverArmInTheirFrame) {
  RandomStream random(1, 0, "fix");
  RigidMotion m;
  m.p_WB = {100.0, 200.0, 3.0};
  m.q_WB = from_rpy({0.0, 0.0, kPi / 2.0});  // nose to the north
  Gnss gnss;
  gnss.noise_m = Vector3::Zero();
  gnss.position_m = {1.0, 0.5, 2.0};
  const LocalFrame world({49.0, 8.0, 110.0});
  const Values at = gnss_reading(gnss, world, m, random);
  EXPECT_LT((world.to_enu({at[0], at[1], at[2]}) - Vector3(100.0 - 0.5, 201.0, 5.0)).norm(), 1e-8);  // rounding of 6.4e6 m
  EXPECT_NEAR(at[0], 49.0 + 201.0 / 111200.0, 1e-6);                                                 // a degree is 111.2 km

  Lidar lidar;
  lidar.noise_m = Vector3::Zero();
  lidar.position_m = {0.0, 0.0, 2.0};
  lidar.map_rpy_rad = {0.05, 0.05, 0.1};
  lidar.map_offset_m = {0.5, 0.1, 0.5};
  Matrix3 c;  // as the course prints it for these angles
  c << 0.99376, -0.09722, 0.05466, 0.09971, 0.99401, -0.04475, -0.04998, 0.04992, 0.9975;
  const Vector3 l = triple(lidar_reading(lidar, m, random), 0);
  EXPECT_LT((c * l + lidar.map_offset_m - Vector3(100.0, 200.0, 5.0)).norm(), 2e-3);  // five digits of 220 m
}

// --- In a drive -------------------------------------------------------------------------------------------------------

Scenario standing(double duration_s) {
  Scenario s;
  s.name = "test";
  s.run.duration_s = duration_s;
  RoadCar car;
  car.speed_time_s = {0.0};
  car.speed_mps = {0.0};
  s.plant.vehicle = car;
  s.imu.emplace();
  s.gnss.emplace();
  s.lidar.emplace();
  return s;
}

struct Sample {
  Utime sent, taken;
  std::vector<double> value;
  friend bool operator==(const Sample&, const Sample&) = default;
};

struct Played {
  std::map<std::string, std::vector<Sample>> of;
  std::map<Utime, std::vector<double>> truth;
  std::vector<std::string> truth_names;
};

Played play(const Scenario& scenario) {
  const auto drive = make_simulated_drive(scenario);
  Played p;
  p.truth_names = drive->truth_names();
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    for (const NamedValue& r : epoch.readings)
      p.of[drive->quantities()[static_cast<std::size_t>(r.channel)]].push_back(
          {epoch.utime, r.utime, {r.value.begin(), r.value.end()}});
    if (!epoch.truth.empty()) p.truth[epoch.utime] = epoch.truth;
  }
  return p;
}

struct Moments {
  double mean = 0.0, variance = 0.0, neighbours = 0.0;
  explicit Moments(const std::vector<double>& x) {
    const auto n = static_cast<double>(x.size());
    for (const double v : x) mean += v / n;
    for (const double v : x) variance += (v - mean) * (v - mean) / n;
    for (std::size_t k = 1; k < x.size(); ++k) neighbours += (x[k] - mean) * (x[k - 1] - mean) / n;
  }
};

std::vector<double> column(const std::vector<Sample>& samples, std::size_t i) {
  std::vector<double> x;
  for (const Sample& s : samples) x.push_back(s.value[i]);
  return x;
}

TEST(MountedSensors, NoiseIsWhiteWithItsDeviationAndIndependent) {
  Scenario s = standing(60.0);
  s.imu->noise_mps2 = 0.05;
  s.imu->noise_radps = 0.004;
  s.lidar->rate_hz = 500.0;
  s.lidar->noise_m = {0.1, 0.2, 0.3};
  s.gnss->rate_hz = 500.0;
  s.gnss->noise_m = {0.4, 0.5, 0.6};
  const Played p = play(s);
  const auto& imu = p.of.at("imu");
  ASSERT_EQ(imu.size(), 30001u);
  std::vector<std::vector<double>> x;
  for (std::size_t i = 0; i < 6; ++i) x.push_back(column(imu, i));
  for (std::size_t i = 0; i < 3; ++i) x.push_back(column(p.of.at("lidar"), i));
  const LocalFrame world(s.world.origin);
  for (int i = 0; i < 3; ++i) {
    auto& last = x.emplace_back();
    for (const Sample& g : p.of.at("gnss")) last.push_back(world.to_enu({g.value[0], g.value[1], g.value[2]})[i]);
  }
  const double sigma[]{0.05, 0.05, 0.05, 0.004, 0.004, 0.004, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const double mean[]{0, 0, kG, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const double error =
      4.5 / std::sqrt(30001.0);  // 4.5 standard errors, 100 checks: one in 1500 would fail by chance; fixed seed
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Moments m(x[i]);
    EXPECT_NEAR((m.mean - mean[i]) / sigma[i], 0.0, error) << i;
    EXPECT_NEAR(m.variance / (sigma[i] * sigma[i]), 1.0, std::sqrt(2.0) * error) << i;
    EXPECT_NEAR(m.neighbours / (sigma[i] * sigma[i]), 0.0, error) << i;
    for (std::size_t j = 0; j < i; ++j) {
      double product = 0.0;
      for (std::size_t k = 0; k < x[i].size(); ++k)
        product += (x[i][k] - mean[i]) * (x[j][k] - mean[j]) / (sigma[i] * sigma[j]);
      EXPECT_NEAR(product / 30001.0, 0.0, error) << i << " with " << j;
    }
  }
}

TEST(MountedSensors, BiasesWalkAndAreTruth) {
  Scenario s = standing(60.0);
  *s.imu = noise_free();
  s.imu->bias_mps2 = {0.1, 0.2, 0.3};
  s.imu->bias_radps = {-0.1, -0.2, -0.3};
  s.imu->bias_walk_mps2 = 0.02;
  s.imu->bias_walk_radps = 0.003;
  s.plant.truth_rate_hz = 500.0;
  const Played p = play(s);
  ASSERT_EQ(p.truth_names.size(), 16u);
  for (std::size_t i = 9; i < Strapdown::kStates; ++i) EXPECT_EQ(p.truth_names[i + 1], Strapdown::kStateNames[i].name);
  EXPECT_EQ(p.truth_names[9], "forward_speed_mps");
  const double start[]{0.1, 0.2, 0.3, -0.1, -0.2, -0.3};
  for (std::size_t i = 0; i < 6; ++i) {
    std::vector<double> steps;
    double before = start[i];
    for (const Sample& x : p.of.at("imu")) {
      const double b = p.truth.at(x.sent)[10 + i];
      EXPECT_NEAR(x.value[i] - (i == 2 ? kG : 0.0), b, 1e-14) << "what it reads at rest";
      steps.push_back(b - before);
      before = b;
    }
    EXPECT_EQ(steps[0], 0.0);
    const Moments m(steps);
    const double variance = 0.002 * (i < 3 ? 0.02 * 0.02 : 0.003 * 0.003), n = 30001.0;
    EXPECT_NEAR(m.variance / variance, 1.0, 4.0 * std::sqrt(2.0 / n));  // 4 standard errors
    EXPECT_NEAR(m.neighbours / variance, 0.0, 4.0 / std::sqrt(n));
  }
}

TEST(MountedSensors, LateFixesCarryTheTimeOfTheirMeasurement) {
  Scenario s = standing(2.0);
  const Played prompt = play(s);
  s.gnss->delay_s = 0.1234;  // one more is on its way when the next is taken
  s.gnss->rate_hz = 10.0;
  const Played p = play(s);
  const auto &now = prompt.of.at("gnss"), &late = p.of.at("gnss");
  ASSERT_EQ(now.size(), 21u);
  ASSERT_EQ(late.size(), 19u);  // those of 1.9 and 2.0 s come after the end
  for (std::size_t k = 0; k < late.size(); ++k) {
    EXPECT_EQ(late[k].taken, 100000 * static_cast<Utime>(k));
    EXPECT_EQ(late[k].sent, late[k].taken + 123400);
    EXPECT_EQ(late[k].value, now[k].value);
  }
  EXPECT_EQ(p.of.at("imu"), prompt.of.at("imu"));
  EXPECT_EQ(p.of.at("lidar"), prompt.of.at("lidar"));
}

TEST(MountedSensors, OutagesDropFixesAndLeaveTheOthersAlone) {
  Scenario s = standing(3.0);
  const Played whole = play(s);
  s.lidar->outages_s = {0.5, 1.0, 2.0, 2.05};
  const Played p = play(s);
  std::vector<Sample> expected;
  for (const Sample& x : whole.of.at("lidar"))
    if (!((x.taken >= 500000 && x.taken < 1000000) || (x.taken >= 2000000 && x.taken < 2050000))) expected.push_back(x);
  EXPECT_EQ(expected.size(), 31u - 6u);
  EXPECT_EQ(p.of.at("lidar"), expected);
  EXPECT_EQ(p.of.at("gnss"), whole.of.at("gnss"));
}

TEST(MountedSensors, EachHasAStreamOfItsOwn) {
  const Played all = play(standing(1.0));
  Scenario s = standing(1.0);
  s.gnss.reset();
  s.imu->rate_hz = 100.0;
  const Played fewer = play(s);
  EXPECT_EQ(fewer.of.at("lidar"), all.of.at("lidar"));
  EXPECT_EQ(fewer.of.at("imu")[1].value, all.of.at("imu")[1].value) << "at rest the same whatever the rate";
  s.run.seed = 2;
  EXPECT_NE(play(s).of.at("lidar")[0].value, all.of.at("lidar")[0].value);
}

TEST(MountedSensors, AreRefusedOnAVehicleWithoutAMotion) {
  Scenario s = standing(1.0);
  s.plant.vehicle = Unimog();
  try {
    make_simulated_drive(s);
    FAIL() << "accepted";
  } catch (const Refusal& r) {
    EXPECT_STREQ(r.what(), "sensor: the vehicle 'unimog' has no motion in three dimensions for an IMU, GNSS or LIDAR");
  }
}

// --- How well readings integrate --------------------------------------------------------------------------------------

// A minute with everything: curves of both hands up to 4 m/s^2, a hill, bumps up to 6 m/s^2.
Scenario minute() {
  Scenario s = standing(60.0);
  RoadCar car;
  car.speed_time_s = {2, 9, 16, 21, 27, 33, 41, 46, 53, 58};
  car.speed_mps = {0, 10, 14, 14, 7, 9, 12, 12, 5, 0};
  car.curvature_distance_m = {50, 65, 105, 120, 195, 215, 255, 270, 285, 300, 325, 340, 395, 410, 470, 485};
  car.curvature_radpm = {0, 0.02, 0.02, 0, 0, -0.03, -0.03, 0, 0, 0.05, 0.05, 0, 0, -0.015, -0.015, 0};
  car.grade_distance_m = {110, 150, 190, 230, 270, 310};
  car.grade = {0, 0.06, 0.06, -0.04, -0.04, 0};
  car.bank_distance_m = {50, 65, 105, 120};
  car.bank_rad = {0, -0.04, -0.04, 0};
  car.bumps = {{275, 360, 440}, {5, 6, 8}, {0.08, 0.05, 0.04}};
  car.initial_yaw_rad = 2.4;
  s.plant.vehicle = car;
  *s.imu = noise_free();
  s.gnss.reset();
  s.lidar.reset();
  s.plant.truth_rate_hz = 500.0;
  s.plant.relative_tolerance = s.plant.absolute_tolerance = 1e-10;  // as shipped
  return s;
}

// Document 001, eqs 3.2-3.5, with the reading held.
struct DeadReckoning {
  Vector3 p{0, 0, 0}, v{0, 0, 0};
  Rotation q = Rotation::Identity();
  void step(const Vector3& f, const Vector3& w, double dt) {
    const Vector3 a = q * f - kG * Vector3::UnitZ();
    p += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
    q = local_plus(q, dt * w);
  }
};

struct Drift {
  double p = 0.0, v = 0.0, attitude = 0.0;  // largest
  void add(const DeadReckoning& d, const RigidMotion& m, const Imu& imu) {
    p = std::max(p, (d.p - m.position_of(imu.position_m)).norm());
    v = std::max(v, (d.v - m.velocity_of(imu.position_m)).norm());
    attitude = std::max(attitude, global_minus(d.q, m.q_WB * from_rpy(imu.rpy_rad)).norm());
  }
};

TEST(MountedImu, ReadingsOfTheIntervalDriftByMicrometresWhereSamplesDriftByDecimetres) {
  Scenario s = minute();
  s.imu->position_m = {0.3, 0.1, 0.4};
  s.imu->rpy_rad = {0.01, -0.02, 0.03};
  RoadCar car = std::get<RoadCar>(s.plant.vehicle);
  car.prepare();
  VehicleSimulation<RoadCar> simulation(car, {1e-10, 1e-12});
  DeadReckoning held, sampled;
  held.q = sampled.q = simulation.motion().q_WB * from_rpy(s.imu->rpy_rad);
  held.p = sampled.p = simulation.motion().position_of(s.imu->position_m);
  Drift of_held, of_sampled;
  const auto imu = play(s).of.at("imu");
  const Rotation q_SB = from_rpy(s.imu->rpy_rad).conjugate();
  for (std::size_t k = 0; k + 1 < imu.size(); ++k) {
    const double dt = 1e-6 * static_cast<double>(imu[k + 1].sent - imu[k].sent);
    const RigidMotion m = simulation.motion();
    held.step({imu[k].value[0], imu[k].value[1], imu[k].value[2]}, {imu[k].value[3], imu[k].value[4], imu[k].value[5]}, dt);
    sampled.step(q_SB * m.specific_force_of(s.imu->position_m, kG), q_SB * m.w_WB_B, dt);
    simulation.advance(seconds(imu[k + 1].sent));
    of_held.add(held, simulation.motion(), *s.imu);
    of_sampled.add(sampled, simulation.motion(), *s.imu);
  }
  // Both drives are integrated to 1e-10 a step: 516 m to 2e-5 m, yaw (through the distance, 0.05 rad/m) to 1e-6 rad.
  EXPECT_LT(of_held.attitude, 1e-6);
  EXPECT_LT(of_held.v, 1.4e-5);  // 14 m/s times that
  EXPECT_LT(of_held.p, 1e-3);    // for a minute
  EXPECT_GT(of_sampled.p, 0.1) << "the reason for not sampling";
}

// With an accurate integrator the readings' error in velocity is what rounding leaves; position has dt^2 / 12 times the change
// of acceleration, here none from stop to stop.
TEST(MountedImu, ReadingsIntegrateExactlyToVelocityAndAttitude) {
  Scenario s = minute();
  s.plant.relative_tolerance = 1e-12;
  s.plant.absolute_tolerance = 1e-13;
  const Played p = play(s);
  const auto& imu = p.of.at("imu");
  DeadReckoning d;
  d.q = from_rpy({0.0, 0.0, 2.4});
  double v = 0.0, position = 0.0, attitude = 0.0;
  for (std::size_t k = 0; k + 1 < imu.size(); ++k) {
    d.step({imu[k].value[0], imu[k].value[1], imu[k].value[2]}, {imu[k].value[3], imu[k].value[4], imu[k].value[5]}, 0.002);
    const auto& truth = p.truth.at(imu[k + 1].sent);
    position = std::max(position, (d.p - Vector3(truth[0], truth[1], truth[2])).norm());
    v = std::max(v, (d.v - Vector3(truth[3], truth[4], truth[5])).norm());
    attitude = std::max(attitude, global_minus(d.q, from_rpy({truth[6], truth[7], truth[8]})).norm());
  }
  EXPECT_LT(attitude, 1e-9);  // 30000 steps' tolerance of 1e-12
  EXPECT_LT(v, 1e-8);
  EXPECT_LT(position, 1e-5);  // dt^2 / 12 of 6 m/s^2 = 2e-6, and the integrated velocity's error
}

// The truth of a whole drive, CVODE against Runge-Kutta with steps of a tenth of a millisecond.
TEST(RoadCarDrive, IsIntegratedToItsTolerance) {
  RoadCar car = std::get<RoadCar>(minute().plant.vehicle);
  car.prepare();
  VehicleSimulation<RoadCar> simulation(car, {1e-10, 1e-10});
  RoadCar::State x = car.initial_state();
  double worst = 0.0;
  for (int ms = 1; ms <= 60000; ++ms) {
    for (int i = 0; i < 5; ++i)
      x = rk4_step([&](const RoadCar::State& y) { return car.derivative(y, RoadCar::Mode{}); }, x, 2e-4);
    simulation.advance(1e-3 * ms);
    worst = std::max(worst, (simulation.state() - x).cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 5e-5);          // 1e-10 of 516 m a step, some hundred to thousand steps
  EXPECT_NEAR(x[4], 516.0, 1e-6);  // means of the speeds times their durations
  EXPECT_NEAR(x[3] - 2.4, 0.02 * 55 - 0.03 * 57.5 + 0.05 * 40 - 0.015 * 75, 1e-6);  // trapezoids of the curvature
  EXPECT_EQ(simulation.changes().size(), 10u + 16u + 6u + 4u + 6u - 5u) << "every point is an event; 5 of the road's coincide";
}

}  // namespace
}  // namespace slipstream
