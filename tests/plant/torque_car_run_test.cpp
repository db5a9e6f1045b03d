// The torque-driven quarter car in time, against closed forms and its power balance.
#include <gtest/gtest.h>

#include <cmath>

#include "models/vehicles/torque_car.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {
namespace {

constexpr CvodeTolerances kTolerances{1e-8, 1e-10};  // those of the scenarios

template <typename Change>
TorqueCar prepared(const Change& change) {
  TorqueCar c;
  change(c);
  c.prepare();
  return c;
}

// Without grip and rolling resistance J w' = T - b w, so w = w0 e^(-bt/J) + (T/b) (1 - e^(-bt/J)): document 002, eq. 5.1.
TEST(TorqueCarRun, SpinsUpWithoutGrip) {
  VehicleSimulation<TorqueCar> run(prepared([](TorqueCar& c) {
                                     c.quarter = {0.7, 3.2e-3, 0.033, 0.0, 0.01, 1.225, 0.0, 0.0};
                                     c.friction = "constant", c.friction_constant = 0.0;
                                     c.torque_nm = {0.75};
                                     c.initial_wheel_speed_radps = 1.0;
                                   }),
                                   kTolerances);
  for (int k = 1; k <= 200; ++k) {
    const double t = 0.01 * k, decay = std::exp(-0.01 * t / 3.2e-3);
    run.advance(t);
    EXPECT_NEAR(run.state()[0], decay + 75.0 * (1.0 - decay), 1e-6 * 75.0)
        << t;  // tolerance 1e-8 a step, about a hundred steps
    EXPECT_EQ(run.state()[1], 0.033) << "no grip, no drag: the speed stays";
    EXPECT_NEAR(run.state()[2], 0.033 * t, 1e-9);
  }
}

// A constant friction without drag: v = v0 + mu g t, w = w0 + (T - (mu + f_r) m g r) t / J.
TEST(TorqueCarRun, ConstantFrictionAcceleratesUniformly) {
  VehicleSimulation<TorqueCar> run(prepared([](TorqueCar& c) {
                                     c.friction = "constant", c.quarter.drag_coefficient = 0.0;
                                     c.torque_nm = {220.0}, c.initial_wheel_speed_radps = 5.0;
                                   }),
                                   kTolerances);
  run.advance(8.0);
  EXPECT_NEAR(run.state()[1], 1.5 + 0.15 * 9.81 * 8.0, 1e-6);                                 // 1e-8 a step
  EXPECT_NEAR(run.state()[0], 5.0 + (220.0 - 0.165 * 431.0 * 9.81 * 0.3) / 2.1 * 8.0, 1e-5);  // and sgn's 2e-8 of 100 rad/s^2
}

// A step of the command: T_m = T (1 - e^(-(t - t0)/tau)), from the moment of the step.
TEST(TorqueCarRun, MotorLagsAsAFirstOrderStepResponse) {
  VehicleSimulation<TorqueCar> run(prepared([](TorqueCar& c) {
                                     c.torque_time_s = {1.0, 1.0 + 1e-9};  // as good as a step
                                     c.torque_nm = {0.0, 200.0};
                                     c.motor_lag_s = 0.1;
                                   }),
                                   kTolerances);
  run.advance(1.0);
  EXPECT_EQ(run.state()[3], 0.0);
  for (int k = 1; k <= 100; ++k) {
    const double t = 0.01 * k;
    run.advance(1.0 + t);
    EXPECT_NEAR(run.state()[3], 200.0 * (1.0 - std::exp(-t / 0.1)), 2e-4) << t;  // 1e-6 of 200 N m for the integrator
  }
}

TEST(TorqueCarRun, EveryPointIsAnEventAtItsTime) {
  VehicleSimulation<TorqueCar> run(prepared([](TorqueCar& c) {
                                     c.friction = "step", c.step_time_s = 1.7;
                                     c.torque_time_s = {0.0, 0.3, 1.7, 2.9}, c.torque_nm = {150.0, 200.0, 160.0, 350.0};
                                   }),
                                   kTolerances);
  run.advance(4.0);
  const double expected[]{0.3, 1.7, 2.9};  // the torque's and the friction's meet at 1.7: one event
  ASSERT_EQ(run.changes().size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(run.changes()[i].time_s, expected[i], 1e-12);  // CVODE's root: 100 roundings
  EXPECT_NEAR(run.state()[4], 4.0, 1e-12);
}

// Work of the motor = kinetic energy gained + slip + rolling + bearing + drag, each flow integrated beside the state from the
// document's equations.
struct CarWithWork {
  enum Work { kMotor = 5, kSlip, kRolling, kBearing, kDrag, kEnd };
  static constexpr std::string_view kName = "car_with_work";
  static constexpr int kStates = kEnd;
  static constexpr int kEvents = TorqueCar::kEvents;
  static constexpr auto kCrossings = TorqueCar::kCrossings;
  static constexpr auto kTruth = TorqueCar::kTruth;
  static constexpr auto kInputs = TorqueCar::kInputs;
  using Mode = TorqueCar::Mode;
  using State = Vector<double, kStates>;

  TorqueCar car;

  static TorqueCar::State own(const State& x) { return x.head<5>(); }
  State initial_state() const {
    State x = State::Zero();
    x.head<5>() = car.initial_state();
    return x;
  }
  Mode initial_mode() const { return car.initial_mode(); }
  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::atan, std::sin, std::sqrt;
    const T w = x[0], v = x[1];
    const T l = (0.3 * w - v) / sqrt(v * v + 0.01 * 0.01), bl = 5.0 * l;
    const T mu = 0.3 * sin(2.0 * atan(bl - 1.0 * (bl - atan(bl))));
    const T drag = (0.5 * 1.225 * 0.45 * 2.0) * (v * v);  // forward driving
    // N from N = m g + 0.25 (mu N - R_aer).
    const T normal = (431.0 * 9.81 - 0.25 * drag) / (1.0 - 0.25 * mu);
    Vector<T, kStates> rate;
    rate.template head<5>() = car.derivative(Vector<T, 5>(x.template head<5>()), mode);
    rate[kMotor] = x[3] * w;
    rate[kSlip] = mu * normal * (0.3 * w - v);
    rate[kRolling] = (0.015 * 0.3) * (normal * (w * w / sqrt(w * w + 1e-6)));
    rate[kBearing] = 0.4 * (w * w);
    rate[kDrag] = drag * v;
    return rate;
  }
  Vector<double, kEvents> events(const State& x, const Mode& mode) const { return car.events(own(x), mode); }
  Mode after_event(int event, const State& x, const Mode& mode) const { return car.after_event(event, own(x), mode); }
  auto truth(const State& x, const Mode& mode) const { return car.truth(own(x), mode); }
  auto inputs(const State& x, const Mode& mode) const { return car.inputs(own(x), mode); }
};
static_assert(Vehicle<CarWithWork>);

TEST(TorqueCarRun, PowerBalanceCloses) {
  using C = CarWithWork;
  C vehicle;
  vehicle.car = prepared([](TorqueCar& c) {
    c.torque_time_s = {0.5, 2.0, 4.0}, c.torque_nm = {80.0, 380.0, 250.0};
    c.motor_lag_s = 0.2, c.load_transfer = 0.25, c.quarter.viscous_friction_nms = 0.4;
  });
  VehicleSimulation<C> run(vehicle, kTolerances);
  const auto kinetic_j = [&] {
    return 0.5 * 431.0 * run.state()[1] * run.state()[1] + 0.5 * 2.1 * run.state()[0] * run.state()[0];
  };
  const double start_j = kinetic_j();
  for (int k = 1; k <= 60; ++k) {
    run.advance(0.1 * k);
    const C::State x = run.state();
    const double lost = x[C::kSlip] + x[C::kRolling] + x[C::kBearing] + x[C::kDrag];
    EXPECT_NEAR(kinetic_j() - start_j, x[C::kMotor] - lost, 1e-6 * x[C::kMotor] + 1e-6) << 0.1 * k << " s";  // the Unimog's bar
  }
  // Each flow is large enough to be missed if it were left out.
  for (const int i : {C::kMotor, C::kSlip, C::kRolling, C::kBearing, C::kDrag})
    EXPECT_GT(run.state()[i], 1e-4 * run.state()[C::kMotor]) << i;
}

}  // namespace
}  // namespace slipstream
