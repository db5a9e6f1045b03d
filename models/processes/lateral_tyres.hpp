// A car on four tyres whose size is a state: their cornering coefficients and their friction, which only process noise moves.
//
//   v_y' = a_y - w_z v_x,   a_y and w_z' of parts/four_wheels.hpp,   k_1' = k_2' = mu' = b' = 0
//   z = (s a_y + b, w_z),   u = (delta, w, a_x),   v_x = r w,   s = 1 + g phi / a_y
//
// The tyre's shape is given, its slope k (at no slip and static load) and its peak mu are estimated, and with them the whole
// curve: k is seen where the tyres slip a little, mu only where they slip so much that they yield, and before that its variance
// says so. Roll and pitch are what they are in a steady turn at the acceleration w_z v_x (parts/chassis.hpp); s is what the
// lean adds to an accelerometer, and b its constant offset. The longitudinal force follows from the measured a_x and from the
// drag of the steered wheels, F = m a_x + sin(delta) F_y,1, with F_y,1 of a first pass that takes m a_2/L w_z v_x for it. mu_1
// = ratio mu for axles with different tyres. w and a_x are readings: their noise is part of the process noise. After the models
// of Hsu et al., "Estimation of tire slip angle and friction limits using steering torque" (2010), here with load transfer and
// combined slip and without the torque. Range: forward driving on a level road.
#pragma once

#include "models/parts/four_wheels.hpp"
#include "models/process.hpp"

namespace slipstream {

struct LateralTyres {
  static constexpr std::string_view kName = "lateral_tyres";
  static constexpr int kStates = 6;
  static constexpr int kInputs = 3;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{{{"lateral_speed_mps", "m/s"},
                                                              {"yaw_rate_radps", "rad/s"},
                                                              {"front_cornering_prad", "1/rad"},
                                                              {"rear_cornering_prad", "1/rad"},
                                                              {"friction", "1"},
                                                              {"a_y_offset_mps2", "m/s^2"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{
      {{"steering_angle_rad", "rad"}, {"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"a_y_mps2", "m/s^2"}, {"yaw_rate_radps", "rad/s"}}};
  static constexpr std::array<bool, kStates> kLinear{false, false, false, false, false, true};
  static constexpr std::array<bool, kStates> kConstant{false, false, true, true, true, true};

  FourWheels car;
  double front_friction_ratio = 1.0;  // of mu at the front axle, by mu at the rear

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    FourWheels::visit_parameters(p.car, v);
    v.number("front_friction_ratio", p.front_friction_ratio, positive());
  }

  template <typename T>
  FourWheels::Accelerations<T> accelerations(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const Chassis& c = car.chassis;
    const double v_x = c.wheel_radius_m * u[1], a_x = u[2] / (1.0 - kGravity_mps2 * c.pitch_per_mps2());
    const double to_front_n = c.pitch_stiffness_nmprad * c.pitch_per_mps2() * a_x / c.wheelbase_m();
    const T turn_mps2 = v_x * x[1], mu = positive_part(x[4], kLeastFriction);
    const auto wheels = [&](const T& steered_drag_n) {
      return car.wheels<T, double>(
          {v_x, x[0], x[1], u[0], T(c.roll_per_mps2() * turn_mps2), to_front_n, T(c.mass_kg * a_x + steered_drag_n)},
          {x[2], x[3]}, {T(front_friction_ratio * mu), mu});
    };
    const auto roughly = wheels(T((std::sin(u[0]) * c.front_load_n() / kGravity_mps2) * turn_mps2));
    return car.accelerations(wheels(T(std::sin(u[0]) * (roughly[0].aside_n + roughly[1].aside_n))));
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const auto a = accelerations(x, u);
    Vector<T, kStates> rate;
    rate << a.lateral_mps2 - car.chassis.wheel_radius_m * u[1] * x[1], a.yaw_radps2, T(0.0), T(0.0), T(0.0), T(0.0);
    return rate;
  }

  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    return {(1.0 + kGravity_mps2 * car.chassis.roll_per_mps2()) * accelerations(x, u).lateral_mps2 + x[5], x[1]};
  }

  // The fastest rate of x' = f around x, 1/s, at any speed: that of lightly loaded tyres that do not yield, at standstill.
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    using std::abs;
    const Chassis& c = car.chassis;
    const T f = abs(x[2]) * c.front_load_n(), r = abs(x[3]) * c.rear_load_n();
    return ((f + r) / c.mass_kg +
            (c.front_axle_m * c.front_axle_m * f + c.rear_axle_m * c.rear_axle_m * r) / c.yaw_inertia_kgm2) /
           c.slip_speed_eps_mps;
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 1) return false;
    x[1] = z;
    return true;
  }

 private:
  static constexpr double kLeastFriction = 0.02;
};

static_assert(ProcessModel<LateralTyres>);

}  // namespace slipstream
