// Everything that a scenario file says, as plain data. io/scenario_reader fills it from TOML and prints it resolved.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "models/registry.hpp"
#include "models/sensors/errors.hpp"
#include "models/sensors/fixes.hpp"
#include "models/sensors/imu.hpp"
#include "models/sensors/noise.hpp"
#include "models/strapdown.hpp"
#include "models/world.hpp"

namespace slipstream {

struct RunConfig {
  std::uint64_t seed = 1;
  double duration_s = 10.0;        // of a recorded drive: 0 is the whole drive
  std::string clock = "lockstep";  // "lockstep", "realtime" or "free"
  double realtime_factor = 1.0;
  std::vector<std::string> wait_for;  // participants that must be there before the first tick
  double start_timeout_s = 60.0;      // wall clock, for wait_for
  double late_timeout_s = 10.0;       // wall clock, until a silent participant is named and dropped (lockstep)
  double deadline_s = 0.0;            // for an estimator's step; 0: the shortest sensor period
};

struct SensorConfig {
  std::string type;      // of kSensorTypes
  std::string quantity;  // what it measures
  double rate_hz = 100.0;
  NoiseLaw noise;         // a recorded drive's own noise is in its data: there this is what estimators believe
  SensorErrors errors{};  // of a simulated drive; estimators are not told
};

struct PlantConfig {
  AnyVehicle vehicle;
  double input_rate_hz = 100.0;  // of the drive torque messages
  double truth_rate_hz = 100.0;
  double relative_tolerance = 1e-8;
  double absolute_tolerance = 1e-10;
  // A stochastic plant: at k / process_noise_rate_hz, k = 1, 2 ..., each of these states is pushed by a normal deviate of this
  // standard deviation, before anything is measured there; 0: never. A start is drawn likewise. Keyed by the vehicle's state
  // names.
  double process_noise_rate_hz = 0.0;
  std::map<std::string, double> process_noise;
  std::map<std::string, double> start_deviation;
};

// One column of a recorded drive.
struct RecordedColumn {
  std::string quantity;  // sensor quantity, input, or truth name
  std::string file;      // relative to the data directory
  std::string column;    // numbers, in the unit that `scale` turns into the quantity's
  double scale = 1.0;
  double offset = 0.0;                   // value = scale * number + offset
  std::vector<std::string> mean_with{};  // further columns of the file: the number is the mean of all
  double lead_s = 0.0;                   // the row is about this much after its time: the reading is sent at t + lead
};

// Truth of a planar pose: the speed along the path, from positions that may jump.
struct RecordedPathSpeed {
  std::string file;
  std::string x_column = "p_x_m";
  std::string y_column = "p_y_m";
  std::string yaw_column;        // rad, W to B: gives the speed along the body's x axis, signed; empty: its magnitude
  double window_s = 0.4;         // the speed at t is the least-squares slope of the positions within +- window_s / 2
  double max_residual_m = 0.05;  // where the fit misses the positions by more (rms), the pose jumped: no speed there
};

// Columns of a recorded drive that make one reading of several numbers: common/readings.hpp.
struct RecordedGroup {
  std::string quantity;  // "imu", "gnss" or "lidar"
  std::string file;
  std::vector<std::string> columns;  // as many as the quantity has components; of a fix in metres of W too (frame)
  std::vector<double> scale;         // of each column; empty: 1
  std::string frame = "geodetic";    // of "gnss": the columns are "geodetic", or "enu": metres in W
  double lag_s = 0.0;                // the row is about this much before its time: the reading carries t - lag and is sent at t
};

// The attitude of a recorded drive's truth as a quaternion, turned into roll, pitch and yaw.
struct RecordedAttitude {
  std::string file;
  std::vector<std::string> columns{"qw", "qx", "qy", "qz"};
  std::string axes = "flu";        // of what was recorded: forward-left-up, or "frd": forward-right-down
  Vector3 rpy_rad{0.0, 0.0, 0.0};  // R_BS of what was recorded (forward-left-up), e.g. of a camera that is mounted askew
};

struct RecordedConfig {
  std::string time_column = "t_s";
  std::vector<RecordedGroup> groups;
  std::optional<RecordedAttitude> attitude;  // truth roll_rad, pitch_rad, yaw_rad
  std::vector<RecordedColumn> sensors;       // quantity: of one of the scenario's sensors
  std::vector<RecordedColumn> inputs;        // quantity: "drive_torque_nm"
  std::vector<RecordedColumn> truth;
  std::optional<RecordedPathSpeed> path_speed;  // truth "speed_mps"
};

// A named set of numbers that an estimator believes. Maps are keyed by state or output name.
struct Tuning {
  std::optional<AnyProcess> process;  // the estimator's process model with this tuning's own parameters; empty: as it is
  std::string measurement_noise = "sensors";  // "sensors": each sensor's own law; "given": measurement_variance
  std::map<std::string, double> measurement_variance;
  std::string process_noise = "density";  // "density": variance per second; "step": variance per step
  std::map<std::string, double> process_variance;
  std::map<std::string, double> initial_mean;
  std::map<std::string, double> initial_variance;
  std::string start = "given";  // "given": initial_mean; "measured": the first output that fixes a start

  // Moving horizon
  std::string mhe_form = "multiple_shooting";        // or "single_shooting": document 002, eqs 3.22-3.23
  std::string mhe_solver = "ipopt";                  // or "rti": real-time iteration
  int mhe_window = 4;                                // N: intervals, so N + 1 samples
  std::map<std::string, double> arrival_weight;      // S, single shooting
  std::map<std::string, double> measurement_weight;  // V, single shooting

  StrapdownTuning strapdown;  // of a strapdown model, which reads nothing else of this struct

  // Unscented filters: spread, prior knowledge of the kurtosis (2: Gaussian) and secondary spread of the scaled sigma points
  double ukf_alpha = 1.0;
  double ukf_beta = 2.0;
  double ukf_kappa = 0.0;
  bool ukf_redraw = true;  // sigma points anew after the prediction; false uses those that were predicted, without Q's share

  // Particle filters
  int pf_particles = 1000;                   // N
  std::string pf_resampling = "systematic";  // or "stratified", "residual"
  bool pf_recover = true;                    // draw a set that has lost the state anew
  double pf_resample_below = 0.5;  // resample when the effective number of particles is below this fraction of N; 1: always
};

struct EstimatorConfig {
  AnyProcess process;
  std::optional<Strapdown> strapdown;  // instead of `process`: an IMU drives the prediction
  std::string tuning = "matched";
  std::map<std::string, Tuning> tunings;
  std::map<std::string, double> lower_bound;  // of states; moving horizon only
  std::map<std::string, double> upper_bound;
};

struct Scenario {
  std::string name;
  std::string description;
  RunConfig run;
  World world;
  std::vector<SensorConfig> sensors;  // of one number each
  std::optional<Imu> imu;
  std::optional<Gnss> gnss;
  std::optional<Lidar> lidar;
  PlantConfig plant;                       // simulated
  std::optional<RecordedConfig> recorded;  // instead of the simulated one
  EstimatorConfig estimator;
};

}  // namespace slipstream
