// As torque_friction, on a road of unknown grade and with an unknown load: both are states, the grade wanders, the mass does
// not.
//
//   w', v', mu' of parts/rolling_wheel.hpp,   q' = 0,   m' = 0,   z = (w, a_x),   a_x = mu g cos a - R_aer(v)/m,   q = tan a
//
// a_x is what an accelerometer feels, which stands on the same slope as the vehicle: the specific force, v' + g sin a. It shows
// mu whatever the mass; the torque that mu needs then shows the mass, and v' against a_x the grade. A gain error of the torque
// looks like a mass that is wrong by the inverse factor. Input as there.
#pragma once

#include "models/parts/rolling_wheel.hpp"
#include "models/process.hpp"

namespace slipstream {

struct TorqueFrictionLoad {
  static constexpr std::string_view kName = "torque_friction_load";
  static constexpr int kStates = 5;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr bool kInputsAtEnd = true;
  static constexpr double kLeastMass_kg = 1.0, kMostMass_kg = 1e6;  // a wild estimate is taken for the nearer of these
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"wheel_speed_radps", "rad/s"}, {"speed_mps", "m/s"}, {"friction", "1"}, {"grade", "1"}, {"mass_kg", "kg"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  static constexpr std::array<bool, kStates> kLinear{false, false, true, false, false};
  static constexpr std::array<bool, kStates> kConstant{false, false, false, true, true};

  RollingWheel rolling;  // its mass_kg is not used

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    RollingWheel::visit_parameters(p.rolling, v);
  }

  template <typename T>
  RollingWheel::Road<T> road(const Vector<T, kStates>& x) const {
    return RollingWheel::road(clamp(x[4], kLeastMass_kg, kMostMass_kg), x[3]);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const Vector<T, 3> rate = rolling.rates(road(x), u[0], x[0], x[1], x[2]);
    Vector<T, kStates> all;
    all << rate, T(0.0), T(0.0);
    return all;
  }
  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], rolling.specific_force_mps2(road(x), x[2], x[1])};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    return 1.0 / rolling.relaxation_s(road(x), x[1]);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = rolling.speed_mps(z, x[2]);
    return true;
  }
};

static_assert(ProcessModel<TorqueFrictionLoad>);

}  // namespace slipstream
