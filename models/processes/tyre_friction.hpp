// Wheel and vehicle with a tyre on a road whose peak friction is not known: how much friction is used, and how much there is.
//
//   J w' = T - b w - (mu + f_r sgn w) m g r,   m v' = mu m g - R_aer(v),   D' = 0,   mu = mu(l; D) of parts/surface_family.hpp
//   z = (w, a_x),   a_x = v',   l = (r w - v) / sqrt(v^2 + v_eps^2)
//
// D is the available friction. Algorithms that keep one estimate let it wander (process noise); the bank of models (imm) keeps
// one per surface of Table 1, with D at its value, and the probabilities that the road is each: kRegimeNames. The road changes
// from a surface to any other, all alike, at the rate regime_rate_hz. While mu is a small part of D the curves differ by the
// slip that they need for it, and at 5 % noise that is not seen. v_eps bounds the tyre's rate at low speed, which is B C D m g
// r^2 / (J v). Input: T, the torque at this wheel. Source: document 002, eqs 3.1-3.15.
#pragma once

#include "models/parts/driven_wheel.hpp"
#include "models/parts/surface_family.hpp"
#include "models/process.hpp"

namespace slipstream {

struct TyreFriction {
  static constexpr std::string_view kName = "tyre_friction";
  static constexpr int kStates = 3;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, kStates> kStateNames{
      {{"wheel_speed_radps", "rad/s"}, {"speed_mps", "m/s"}, {"available_friction", "1"}}};
  static constexpr std::array<Quantity, kInputs> kInputNames{{{"drive_torque_nm", "N m"}}};
  static constexpr std::array<Quantity, kOutputs> kOutputNames{{{"wheel_speed_radps", "rad/s"}, {"a_x_mps2", "m/s^2"}}};

  static constexpr std::array<bool, kStates> kLinear{false, false, true};  // in D at a surface; between them nearly
  static constexpr std::array<bool, kStates> kConstant{false, false, true};

  // The road is one of these: kRegimeState then has a value of its own.
  static constexpr int kRegimeState = 2;
  static constexpr std::array<Quantity, 4> kRegimeNames{
      {{"probability_dry", "1"}, {"probability_wet", "1"}, {"probability_snow", "1"}, {"probability_ice", "1"}}};
  static double regime_value(std::size_t regime) { return kSurfaces[regime].tyre.d; }
  // What Table 1 leaves open of it: D is printed to 0.01, and everything that rounds to it is as likely.
  static constexpr double kRegimeVariance = 0.01 * 0.01 / 12.0;

  DrivenWheel wheel;
  double slip_speed_eps_mps = 0.01;
  double regime_rate_hz = 0.1;

  template <typename Self, typename V>
  static void visit_parameters(Self& p, V& v) {
    DrivenWheel::visit_parameters(p.wheel, v);
    v.number("slip_speed_eps_mps", p.slip_speed_eps_mps, positive());
    v.number("regime_rate_hz", p.regime_rate_hz, non_negative());
  }

  template <typename T>
  T friction(const Vector<T, kStates>& x) const {
    return SurfaceFamily::friction(longitudinal_slip(x[0], x[1], wheel.quarter.wheel_radius_m, slip_speed_eps_mps), x[2]);
  }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Vector<double, kInputs>& u) const {
    const T mu = friction(x);
    return {wheel.acceleration_radps2(u[0], x[0], mu), wheel.quarter.acceleration_mps2(mu, x[1]), T(0.0)};
  }
  template <typename T>
  Vector<T, kOutputs> output(const Vector<T, kStates>& x, const Vector<double, kInputs>&) const {
    return {x[0], wheel.quarter.acceleration_mps2(friction(x), x[1])};
  }
  // The steepest curve's, at no slip.
  template <typename T>
  T fastest_rate_hz(const Vector<T, kStates>& x) const {
    using std::sqrt;
    constexpr double kSteepest = 12.0 * 2.3 * 0.82;  // wet
    const double r = wheel.quarter.wheel_radius_m;
    const double stiffness = kSteepest * wheel.quarter.normal_force_n() * r * r / wheel.quarter.wheel_inertia_kgm2;  // m/s^2
    return stiffness / sqrt(x[1] * x[1] + slip_speed_eps_mps * slip_speed_eps_mps) + wheel.fastest_rate_hz(x[0]);
  }

  bool start_from(int output, double z, Vector<double, kStates>& x) const {
    if (output != 0) return false;
    x[0] = z;
    x[1] = z * wheel.quarter.wheel_radius_m;
    return true;
  }
};

static_assert(ProcessModel<TyreFriction>);

}  // namespace slipstream
