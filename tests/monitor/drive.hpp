// A drive for the tests of what the monitor says of sensors: truth, fixes and the estimates of a small consistent filter, said
// message by message to a Session.
//
// The car stands at the origin until 3 s, then drives circles of 201 m, 10 m/s from 5 s on. The filter knows the motion but for
// a random walk of the position, and is the Kalman filter of that on each axis: p^ += dp + N(0, walk^2 dt), fixes one after
// another.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/random.hpp"
#include "common/rotation.hpp"
#include "models/strapdown.hpp"
#include "tests/monitor/fixture.hpp"

namespace slipstream {

struct TestFixes {
  double rate_hz = 10.0, sigma_m = 0.1;
  std::function<Vector3(double t_s, const Vector3& p, const Matrix3& R_WB)> error{};  // beyond the noise
  double out_from_s = 0.0, out_until_s = 0.0;
};

struct DriveSetup {
  double duration_s = 30.0;
  double rate_hz = 50.0;   // of the estimates
  int states = 9;          // or 15
  double walk = 0.1;       // m/sqrt(s)
  double gate = INFINITY;  // of NIS
  TestFixes gnss{}, lidar{10.0, 0.2};
  bool has_lidar = true;
  double speed_scale = 1.0;  // forward speed, sigma 0.1 m/s, at every fifth estimate
  std::uint64_t seed = 1;
  bool with_readings = false;
  std::vector<std::string> estimators{"es_ekf"};
};

class TestDrive : public TestRun {
 public:
  explicit TestDrive(const DriveSetup& setup) : setup_(setup), random_(setup.seed, 0, "drive") {
    descriptor.truth_names.clear();
    descriptor.truth_units.clear();
    announcement.state_names.clear();
    announcement.state_units.clear();
    for (int i = 0; i < setup.states; ++i) {
      const Quantity& q = Strapdown::kStateNames[static_cast<std::size_t>(i)];
      announcement.state_names.emplace_back(q.name);
      announcement.state_units.emplace_back(q.unit);
    }
    descriptor.truth_names = announcement.state_names;
    descriptor.truth_units = announcement.state_units;
    announcement.model = "strapdown";
    announcement.algorithm = "es_ekf";
    session.handle(descriptor);
    for (const std::string& name : setup.estimators) {
      announcement.name = name;
      session.handle(announcement);
    }
  }

  void play() {
    const auto steps = static_cast<int>(setup_.duration_s * setup_.rate_hz);
    const double dt = 1.0 / setup_.rate_hz;
    Vector3 at = position(0.0);
    Vector3 estimate = at;
    double P = 1e-4;
    for (int i = 0; i <= steps; ++i) {
      const double t = i * dt;
      header_ = {utime_of(t), i, kRun};
      const Vector3 p = position(t);
      if (i > 0) {
        estimate += p - at + setup_.walk * std::sqrt(dt) * noise();
        P += setup_.walk * setup_.walk * dt;
      }
      at = p;
      Estimate m;
      fix("gnss", setup_.gnss, t, i, p, estimate, P, m);
      if (setup_.has_lidar) fix("lidar", setup_.lidar, t, i, p, estimate, P, m);
      if (i % 5 == 0) {
        const double v = speed(t);
        m.innovation_of.emplace_back("forward_speed_mps");
        m.innovation.push_back((setup_.speed_scale - 1.0) * v + 0.1 * random_.normal());
        variance_.push_back(0.01);
        m.gated.push_back(0);
      }
      publish(m, t, estimate, P, p, i == steps);
    }
  }

  std::vector<std::string> warnings() const {  // what was said live of sensors
    std::vector<std::string> lines;
    for (const std::string& line : said)
      if (line.find(": ") != std::string::npos && line.find("joined") == std::string::npos) lines.push_back(line);
    return lines;
  }

  static constexpr double kRadius_m = 32.0;
  static double distance(double t) { return t < 3.0 ? 0.0 : t < 5.0 ? 2.5 * (t - 3.0) * (t - 3.0) : 10.0 + 10.0 * (t - 5.0); }
  static double speed(double t) { return t < 3.0 ? 0.0 : std::min(5.0 * (t - 3.0), 10.0); }
  static double yaw(double t) { return distance(t) / kRadius_m; }
  static Vector3 position(double t) { return {kRadius_m * std::sin(yaw(t)), kRadius_m * (1.0 - std::cos(yaw(t))), 0.0}; }

 private:
  Vector3 noise() { return {random_.normal(), random_.normal(), random_.normal()}; }

  void fix(const std::string& sensor, const TestFixes& s, double t, int i, const Vector3& p, Vector3& estimate, double& P,
           Estimate& m) {
    const int every = static_cast<int>(std::lround(setup_.rate_hz / s.rate_hz));
    if (i == 0 || i % every != 0 || (t >= s.out_from_s && t < s.out_until_s)) return;
    Vector3 z = p + s.sigma_m * noise();
    if (s.error) z += s.error(t, p, from_rpy({0.0, 0.0, yaw(t)}).toRotationMatrix());
    const double S = P + s.sigma_m * s.sigma_m;
    const Vector3 nu = z - estimate;
    const bool gated = nu.squaredNorm() / S > setup_.gate;
    for (int axis = 0; axis < 3; ++axis) {
      m.innovation_of.push_back(sensor + (axis == 0 ? "_east_m" : axis == 1 ? "_north_m" : "_up_m"));
      m.innovation.push_back(nu[axis]);
      variance_.push_back(S);
      m.gated.push_back(gated ? 1 : 0);
    }
    if (gated) return;
    estimate += P / S * nu;
    P -= P / S * P;
  }

  void publish(Estimate& m, double t, const Vector3& estimate, double P, const Vector3& p, bool is_last) {
    const auto n = static_cast<std::size_t>(setup_.states);
    m.header = header_;
    m.status = EstimateStatus::kValid;
    std::vector<double> truth(n, 0.0);
    const double v = speed(t), angle = yaw(t);
    for (int i = 0; i < 3; ++i) truth[static_cast<std::size_t>(i)] = p[i];
    truth[3] = v * std::cos(angle);
    truth[4] = v * std::sin(angle);
    truth[8] = wrap_angle(angle);
    m.mean = truth;
    for (int i = 0; i < 3; ++i) m.mean[static_cast<std::size_t>(i)] = estimate[i];
    for (std::size_t i = 3; i < n; ++i) m.mean[i] += 0.01 * random_.normal();
    m.mean[8] = wrap_angle(m.mean[8]);
    m.covariance.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) m.covariance[i * n + i] = i < 3 ? P : 1e-4;
    const std::size_t measured = m.innovation.size();
    m.innovation_covariance.assign(measured * measured, 0.0);
    for (std::size_t i = 0; i < measured; ++i) m.innovation_covariance[i * measured + i] = variance_[i];
    variance_.clear();
    m.step_time_us = 1.0;
    if (setup_.with_readings)
      session.handle(Reading{header_, "imu", Values(std::array{0.1 * random_.normal(), 0.0, 9.81, 0.0, 0.0, v / kRadius_m})});
    session.handle(Truth{header_, truth});
    for (const std::string& name : setup_.estimators) {
      m.name = name;
      session.handle(m);
    }
    session.handle(Tick{header_, is_last ? RunState::kEnded : RunState::kRunning});
  }

  DriveSetup setup_;
  RandomStream random_;
  Header header_;
  std::vector<double> variance_;  // of the innovations
};

}  // namespace slipstream
