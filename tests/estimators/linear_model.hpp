// Linear process models for comparisons with closed forms. A mass pushed along a line, position and speed measured; and one
// that moves in the plane with a constant velocity, its position measured.
//
//   p' = v,   v' = u - c v,   z = (p, v)
//   p' = v,   v' = u,         z = p,   p and v in the plane
#pragma once

#include "models/process.hpp"

namespace slipstream::test {

struct LinearModel {
  static constexpr std::string_view kName = "linear";
  static constexpr int kStates = 2;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, 2> kStateNames{{{"p_m", "m"}, {"v_mps", "m/s"}}};
  static constexpr std::array<Quantity, 1> kInputNames{{{"u_mps2", "m/s^2"}}};
  static constexpr std::array<Quantity, 2> kOutputNames{{{"p_m", "m"}, {"v_mps", "m/s"}}};
  static constexpr std::array<bool, kStates> kLinear{true, true};

  double c = 0.5;

  template <typename T>
  Vector<T, 2> derivative(const Vector<T, 2>& x, const Vector<double, 1>& u) const {
    return {x[1], u[0] - c * x[1]};
  }
  template <typename T>
  Vector<T, 2> output(const Vector<T, 2>& x, const Vector<double, 1>&) const {
    return x;
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, 2>&) const {
    return c;
  }
  bool start_from(int output, double z, Vector<double, 2>& x) const {
    x[output] = z;
    return true;
  }
};

struct PlaneModel {
  static constexpr std::string_view kName = "plane";
  static constexpr int kStates = 4;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 2;
  static constexpr std::array<Quantity, 4> kStateNames{{{"x_m", "m"}, {"y_m", "m"}, {"v_x_mps", "m/s"}, {"v_y_mps", "m/s"}}};
  static constexpr std::array<Quantity, 2> kInputNames{{{"u_x_mps2", "m/s^2"}, {"u_y_mps2", "m/s^2"}}};
  static constexpr std::array<Quantity, 2> kOutputNames{{{"x_m", "m"}, {"y_m", "m"}}};
  static constexpr std::array<bool, kStates> kLinear{true, true, true, true};

  template <typename T>
  Vector<T, 4> derivative(const Vector<T, 4>& x, const Vector<double, 2>& u) const {
    return {x[2], x[3], T(u[0]), T(u[1])};
  }
  template <typename T>
  Vector<T, 2> output(const Vector<T, 4>& x, const Vector<double, 2>&) const {
    return {x[0], x[1]};
  }
  template <typename T>
  T fastest_rate_hz(const Vector<T, 4>&) const {
    return 0.0;
  }
  bool start_from(int output, double z, Vector<double, 4>& x) const {
    x[output] = z;
    return true;
  }
};

static_assert(ProcessModel<LinearModel>);
static_assert(ProcessModel<PlaneModel>);

}  // namespace slipstream::test
