// What an estimator believes that dead-reckons with an IMU: the states it publishes, where its sensors sit, and how it is
// tuned. A model of its own kind: the IMU's readings drive the prediction, so there is no x' = f(x, u) of models/process.hpp.
//
//   p' = v,   v' = R (z_f - b_f - noise) - g z,   R' = R [z_w - b_w - noise]x,   b_f', b_w' white       document 001,
//   eqs 3.1-3.4
//
// Published: position, velocity and attitude of the body's reference point in W (east-north-up), attitude as roll, pitch, yaw
// (common/rotation.hpp); the biases in the IMU's own axes.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "common/parameters.hpp"
#include "common/rotation.hpp"
#include "models/vehicle.hpp"

namespace slipstream {

struct Strapdown {
  static constexpr std::string_view kName = "strapdown";
  static constexpr int kStates = 15;
  static constexpr int kStatesWithoutBiases = 9;
  static constexpr std::array<Quantity, kStates> kStateNames{{{"east_m", "m"},
                                                              {"north_m", "m"},
                                                              {"up_m", "m"},
                                                              {"v_east_mps", "m/s"},
                                                              {"v_north_mps", "m/s"},
                                                              {"v_up_mps", "m/s"},
                                                              {"roll_rad", "rad"},
                                                              {"pitch_rad", "rad"},
                                                              {"yaw_rad", "rad"},
                                                              {"accelerometer_bias_x_mps2", "m/s^2"},
                                                              {"accelerometer_bias_y_mps2", "m/s^2"},
                                                              {"accelerometer_bias_z_mps2", "m/s^2"},
                                                              {"gyro_bias_x_radps", "rad/s"},
                                                              {"gyro_bias_y_radps", "rad/s"},
                                                              {"gyro_bias_z_radps", "rad/s"}}};
  // Innovations are published under these names: fixes in W's axes, velocities in B's.
  static constexpr std::array<Quantity, 9> kOutputNames{{{"gnss_east_m", "m"},
                                                         {"gnss_north_m", "m"},
                                                         {"gnss_up_m", "m"},
                                                         {"lidar_east_m", "m"},
                                                         {"lidar_north_m", "m"},
                                                         {"lidar_up_m", "m"},
                                                         {"forward_speed_mps", "m/s"},
                                                         {"nonholonomic_left_mps", "m/s"},
                                                         {"nonholonomic_up_mps", "m/s"}}};

  // Unless the scenario says otherwise these are what its sensors have: SENSOR_KEY is [sensor.SENSOR] KEY.
  double gravity_mps2 = kGravity_mps2;
  Vector3 imu_position_m{0.0, 0.0, 0.0};
  Vector3 imu_rpy_rad{0.0, 0.0, 0.0};
  Vector3 gnss_position_m{0.0, 0.0, 0.0};
  Vector3 lidar_position_m{0.0, 0.0, 0.0};
  Vector3 lidar_map_rpy_rad{0.0, 0.0, 0.0};
  Vector3 lidar_map_offset_m{0.0, 0.0, 0.0};

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    v.number("gravity_mps2", p.gravity_mps2, between(0.0, 100.0));
    v.triple("imu_position_m", p.imu_position_m, between(-100.0, 100.0));
    v.triple("imu_rpy_rad", p.imu_rpy_rad, between(-kPi, kPi));
    v.triple("gnss_position_m", p.gnss_position_m, between(-100.0, 100.0));
    v.triple("lidar_position_m", p.lidar_position_m, between(-100.0, 100.0));
    v.triple("lidar_map_rpy_rad", p.lidar_map_rpy_rad, between(-kPi, kPi));
    v.triple("lidar_map_offset_m", p.lidar_map_offset_m, between(-1e6, 1e6));
  }
};

// [tuning.NAME] of a strapdown model. Standard deviations, not variances.
struct StrapdownTuning {
  std::string orientation_error = "global";              // "global": document 001, eq. 3.26; or "local"
  bool biases = true;                                    // false: the nine error states of document 001, eq. 3.8
  std::string noise = "sensors";                         // "sensors": each sensor's own; "given": the next five
  double accelerometer_mps2 = 0.05, gyro_radps = 0.005;  // of a sample
  Vector3 gnss_m{0.1, 0.1, 0.1}, lidar_m{0.5, 0.5, 0.5};
  double forward_speed_mps = 0.1;
  double accelerometer_bias_walk_mps2 = 0.0, gyro_bias_walk_radps = 0.0;  // after one second
  bool use_gnss = true, use_lidar = true, use_forward_speed = true;
  bool nonholonomic = false;      // the body's reference point moves neither sideways nor upwards in B ...
  double nonholonomic_mps = 0.1;  // ... but for this
  double gate = 0.0;              // a measurement beyond this quantile of chi-square is left out; 0: none is
  double history_s = 1.0;         // measurements may arrive so late and are still used exactly
  std::string start = "given";    // "given": what follows; "fixes": the first fixes and gravity
  Vector3 initial_position_m{0.0, 0.0, 0.0}, initial_velocity_mps{0.0, 0.0, 0.0}, initial_rpy_rad{0.0, 0.0, 0.0};
  Vector3 position_deviation_m{0.0, 0.0, 0.0}, velocity_deviation_mps{0.0, 0.0, 0.0}, rpy_deviation_rad{0.0, 0.0, 0.0};
  double accelerometer_bias_deviation_mps2 = 0.0, gyro_bias_deviation_radps = 0.0;
  double ukf_alpha = 0.1, ukf_beta = 2.0, ukf_kappa = 0.0;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    const Range deviation = between(0.0, 1e6);
    v.choice("orientation_error", p.orientation_error, {"global", "local"});
    v.flag("biases", p.biases);
    v.choice("noise", p.noise, {"sensors", "given"});
    v.number("accelerometer_mps2", p.accelerometer_mps2, deviation);
    v.number("gyro_radps", p.gyro_radps, deviation);
    v.triple("gnss_m", p.gnss_m, Range{0.0, 1e6, true});
    v.triple("lidar_m", p.lidar_m, Range{0.0, 1e6, true});
    v.number("forward_speed_mps", p.forward_speed_mps, Range{0.0, 1e6, true});
    v.number("accelerometer_bias_walk_mps2", p.accelerometer_bias_walk_mps2, deviation);
    v.number("gyro_bias_walk_radps", p.gyro_bias_walk_radps, deviation);
    v.flag("use_gnss", p.use_gnss);
    v.flag("use_lidar", p.use_lidar);
    v.flag("use_forward_speed", p.use_forward_speed);
    v.flag("nonholonomic", p.nonholonomic);
    v.number("nonholonomic_mps", p.nonholonomic_mps, Range{0.0, 1e6, true});
    v.number("gate", p.gate, between(0.0, 1.0 - 1e-12));
    v.number("history_s", p.history_s, between(0.0, 10.0));
    v.choice("start", p.start, {"given", "fixes"});
    v.triple("initial_position_m", p.initial_position_m, between(-1e7, 1e7));
    v.triple("initial_velocity_mps", p.initial_velocity_mps, between(-1e3, 1e3));
    v.triple("initial_rpy_rad", p.initial_rpy_rad, between(-2.0 * kPi, 2.0 * kPi));
    v.triple("position_deviation_m", p.position_deviation_m, deviation);
    v.triple("velocity_deviation_mps", p.velocity_deviation_mps, deviation);
    v.triple("rpy_deviation_rad", p.rpy_deviation_rad, deviation);
    v.number("accelerometer_bias_deviation_mps2", p.accelerometer_bias_deviation_mps2, deviation);
    v.number("gyro_bias_deviation_radps", p.gyro_bias_deviation_radps, deviation);
    v.number("ukf_alpha", p.ukf_alpha, Range{0.0, 1.0, true});
    v.number("ukf_beta", p.ukf_beta, between(0.0, 10.0));
    v.number("ukf_kappa", p.ukf_kappa, between(-12.0, 100.0));
  }
};

}  // namespace slipstream
