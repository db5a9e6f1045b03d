// A vehicle of models/ integrated in time: CVODE, its events and its mode. Any struct that satisfies `Vehicle`.
#pragma once

#include <vector>

#include "common/jacobian.hpp"
#include "models/vehicle.hpp"
#include "plant/cvode_integrator.hpp"

namespace slipstream {

struct ModeChange {
  double time_s = 0.0;
  int event = 0;
};

template <Vehicle V>
class VehicleSimulation {
 public:
  static constexpr int kStates = V::kStates;
  using State = Vector<double, kStates>;
  using Mode = typename V::Mode;

  VehicleSimulation(const V& vehicle, CvodeTolerances tolerances)
      : vehicle_(vehicle), mode_(vehicle.initial_mode()), integrator_(system(), tolerances, as_span(vehicle.initial_state())) {}
  VehicleSimulation(const VehicleSimulation&) = delete;
  VehicleSimulation& operator=(const VehicleSimulation&) = delete;

  // Integrates to t_s; at every event the mode changes and the integrator starts afresh there.
  void advance(double t_s) {
    while (const auto event = integrator_.advance(t_s)) {
      mode_ = vehicle_.after_event(*event, state(), mode_);
      changes_.push_back({integrator_.time_s(), *event});
      integrator_.restart(integrator_.state());
    }
  }

  // Adds to the state, now. What nothing depends on is shifted beside the integrator, which then need not start afresh.
  void push(const State& by) {
    State rest = by;
    if constexpr (kHasIgnorable) {
      for (int i = 0; i < kStates; ++i) {
        if (!V::kIgnorable[static_cast<std::size_t>(i)]) continue;
        shift_[i] += by[i];
        rest[i] = 0.0;
      }
    }
    if (rest.isZero(0.0)) return;
    const State x = integrated() + rest;
    integrator_.restart(as_span(x));
  }

  double time_s() const { return integrator_.time_s(); }
  State state() const {
    if constexpr (kHasIgnorable) return integrated() + shift_;
    return integrated();
  }
  const Mode& mode() const { return mode_; }
  RigidMotion motion() const requires MovingVehicle<V> { return vehicle_.motion(state(), mode_); }
  const V& vehicle() const { return vehicle_; }
  const std::vector<ModeChange>& changes() const { return changes_; }

 private:
  static constexpr bool kHasIgnorable = requires { V::kIgnorable; };

  static std::span<const double> as_span(const State& x) { return {x.data(), static_cast<std::size_t>(kStates)}; }

  State integrated() const { return Eigen::Map<const State>(integrator_.state().data()); }

  OdeSystem system() {
    OdeSystem s;
    s.states = kStates;
    s.events = V::kEvents;
    s.derivative = [this](const double* x, double* x_dot) {
      Eigen::Map<State> result(x_dot);
      result = vehicle_.template derivative<double>(State(Eigen::Map<const State>(x)), mode_);
    };
    s.jacobian = [this](const double* x, double* j) {
      State value;
      Matrix<double, kStates> jacobian;
      value_and_jacobian<kStates>([this](const auto& dual) { return vehicle_.derivative(dual, mode_); },
                                  State(Eigen::Map<const State>(x)), value, jacobian);
      Eigen::Map<Matrix<double, kStates>> result(j);
      result = jacobian;
    };
    s.event_values = [this](const double* x, double* g) {
      Eigen::Map<Vector<double, V::kEvents>> result(g);
      result = vehicle_.events(State(Eigen::Map<const State>(x)), mode_);
    };
    for (const Crossing c : V::kCrossings)
      s.crossing_direction.push_back(c == Crossing::kRising ? 1 : c == Crossing::kFalling ? -1 : 0);
    return s;
  }

  V vehicle_;
  Mode mode_;
  CvodeIntegrator integrator_;
  State shift_ = State::Zero();
  std::vector<ModeChange> changes_;
};

}  // namespace slipstream
