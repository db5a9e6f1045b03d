// What an estimator believes of a car in the plane that it tracks by position fixes and a speed sensor.
//
//   (x_e, x_n, v, theta)' as in parts/point_mass_car.hpp,   z = (x_e, x_n, v),   u = (u_a, u_psi)
//
// Document 000, eqs 1 and 2; its process noise is on the two positions only (eq. 21). The heading is observable while the car
// moves. Given v and theta the positions are linear: what a Rao-Blackwellised filter takes out of its particles.
#pragma once

#include "models/parts/point_mass_car.hpp"
#include "models/process.hpp"

namespace slipstream {

struct PointMassMotion {
  static constexpr std::string_view kName = "point_mass_motion";
  static constexpr int kStates = 4;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 3;
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"east_m", "m"}, {"north_m", "m"}, {"speed_mps", "m/s"}, {"heading_rad", "rad"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"accelerator", "1"}, {"steering_angle_rad", "rad"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{
      {{"east_m", "m"}, {"north_m", "m"}, {"forward_speed_mps", "m/s"}}};

  static constexpr std::array<bool, kStates> kLinear{true, true, false, false};

  PointMassCar car;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    PointMassCar::visit_parameters(p.car, v);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    return car.derivative(x[2], x[3], u[0], std::tan(u[1]));
  }
  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], x[1], x[2]};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    return car.fastest_rate_hz(x[2]);
  }

  // A fix or a speed alone says nothing of the rest.
  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    x[output] = z;
    return true;
  }
};

static_assert(ProcessModel<PointMassMotion>);

}  // namespace slipstream
