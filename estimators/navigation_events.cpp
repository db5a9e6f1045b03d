#include "estimators/navigation_events.hpp"

#include <algorithm>
#include <cmath>

namespace slipstream {
namespace {

constexpr double kCoast_f = 9.0;              // (m/s^2)^2 s
constexpr double kCoast_w = 0.09;             // (rad/s)^2 s
constexpr double kLongestCoastStep_s = 0.05;  // the unknown acceleration reaches the position within it

}  // namespace

void NavigationProcess::coast(NavigationBelief& belief, double dt_s) const {
  const int steps = static_cast<int>(std::clamp(std::ceil(dt_s / kLongestCoastStep_s), 1.0, 1000.0));
  const double step_s = dt_s / steps;
  InertialNoise noise = noise_;
  noise.f = kCoast_f / step_s;
  noise.w = kCoast_w / step_s;
  for (int i = 0; i < steps; ++i) {
    const Inertial at_rest{belief.x.q_WS.conjugate() * Vector3(0.0, 0.0, gravity_mps2_) + belief.x.b_f, belief.x.b_w};
    filter_.predict(belief, at_rest, noise, step_s);
  }
}

void NavigationProcess::advance(const NavigationEntry& from, const NavigationEvent& event, NavigationEntry& to) const {
  to.event = event;
  to.belief = from.belief;
  to.held = from.held;
  to.held_since = from.held_since;
  const double since_s = seconds(from.event.utime - from.held_since), dt_s = seconds(event.utime - from.event.utime);
  const double held_s = std::clamp(hold_s() - since_s, 0.0, dt_s);
  if (held_s > 0.0) {
    InertialNoise noise = noise_;
    noise.f *= period_s_ / held_s;
    noise.w *= period_s_ / held_s;
    filter_.predict(to.belief, from.held, noise, held_s);
  }
  if (dt_s > held_s) {
    coast(to.belief, dt_s - held_s);
    to.held.w = to.belief.x.b_w;  // as it coasts it does not turn
  }
  if (event.kind == NavigationEventKind::kImu) {
    to.held = event.reading;
    to.held_since = event.utime;
  }
  if (!event.measures) return;
  if (event.measurement.kind == NavigationMeasurement::kBodyVelocity) to.event.measurement.w = to.held.w;
  to.innovation =
      filter_.update(to.belief, to.event.measurement, gates_[static_cast<std::size_t>(to.event.measurement.size - 1)]);
}

}  // namespace slipstream
