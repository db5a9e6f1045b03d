// A linear process model for comparisons with closed forms: a mass pushed along a line, position and speed measured.
//
//   p' = v,   v' = u - c v,   z = (p, v)
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

static_assert(ProcessModel<LinearModel>);

}  // namespace slipstream::test
