// The Unimog's run through the gears (document 002, Figure 40) and its power balance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/vehicles/unimog.hpp"
#include "plant/vehicle_simulation.hpp"

namespace slipstream {
namespace {

constexpr CvodeTolerances kTolerances{1e-8, 1e-10};  // those of the scenarios

Unimog prepared() {
  Unimog u;
  u.prepare();
  return u;
}

TEST(UnimogRun, WheelTorqueOfFigure40) {
  VehicleSimulation<Unimog> run(prepared(), kTolerances);
  const auto torque = [&] { return run.vehicle().inputs(run.state(), run.mode())[0]; };
  EXPECT_NEAR(torque(), 1400.0, 30.0);  // N m; as read from the figure
  double peak = torque();
  for (int k = 1; k <= 1000; ++k) {
    run.advance(0.01 * k);
    peak = std::max(peak, torque());
  }
  EXPECT_NEAR(peak, 2218.0, 20.0);  // N m; the figure's peak, which its search met within 1 %
}

TEST(UnimogRun, UpshiftsOfFigure40) {
  VehicleSimulation<Unimog> run(prepared(), kTolerances);
  run.advance(10.0);
  std::vector<double> upshifts;
  for (const ModeChange& c : run.changes())
    if (c.event == 0) upshifts.push_back(c.time_s);
  ASSERT_EQ(upshifts.size(), 3u);
  const double published_s[]{2.56, 3.73, 7.10};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(upshifts[i], published_s[i], 0.06);  // s; the bar: 7.147 by the reference
  EXPECT_EQ(run.mode().gear, 6);
  EXPECT_FALSE(run.mode().idling);
}

// An independent integration of the same equations, with engine points of its own: upshifts at 2.562, 3.736 and 7.147 s, peak
// slip 1.05 %, peak friction 0.197, 9.1 m/s at the end. Tolerances are half of the last printed digit where nothing else is
// said.
TEST(UnimogRun, ReferenceRunToThePrintedDigit) {
  Unimog u;
  u.engine_speed_rpm = {800, 1000, 1200, 1400, 1600, 1800, 2000, 2200};
  u.engine_torque_nm = {485, 700, 810, 812, 810, 775, 735, 694.5};
  u.prepare();
  VehicleSimulation<Unimog> run(u, kTolerances);
  double friction = 0.0, slip = 0.0;
  for (int k = 1; k <= 10000; ++k) {
    run.advance(0.001 * k);
    const auto truth = run.vehicle().truth(run.state(), run.mode());
    friction = std::max(friction, truth[2]);
    slip = std::max(slip, truth[4]);
  }
  std::vector<double> upshifts;
  for (const ModeChange& c : run.changes())
    if (c.event == 0) upshifts.push_back(c.time_s);
  ASSERT_EQ(upshifts.size(), 3u);
  const double reference_s[]{2.562, 3.736, 7.147};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(upshifts[i], reference_s[i], 0.0005);
  EXPECT_NEAR(slip, 0.0105, 0.00005);
  EXPECT_NEAR(run.state()[1], 9.1, 0.05);
  EXPECT_NEAR(friction, 0.197, 0.0015);  // its engine points are printed as "about": 0.5 % of torque, and half a digit
}

TEST(UnimogRun, ModeChangesAreInOrderAndAtTheirSpeeds) {
  VehicleSimulation<Unimog> run(prepared(), kTolerances);
  double before_s = 0.0;
  std::size_t seen = 0;
  for (int k = 1; k <= 1000; ++k) {
    run.advance(0.01 * k);
    EXPECT_EQ(run.time_s(), 0.01 * k);
    for (; seen < run.changes().size(); ++seen) {
      const double t = run.changes()[seen].time_s;
      EXPECT_GT(t, before_s) << "two changes at once: the clutch chatters";
      EXPECT_LE(t, run.time_s());
      EXPECT_GE(t, 0.01 * (k - 1));
      before_s = t;
    }
  }
  ASSERT_EQ(seen, 4u);  // the clutch closes once, then three upshifts
  EXPECT_EQ(run.changes()[0].event, 1);
  // At the moment of the first upshift the engine turns at 2200 rpm in third gear.
  VehicleSimulation<Unimog> to_shift(prepared(), kTolerances);
  to_shift.advance(run.changes()[1].time_s);
  EXPECT_NEAR(to_shift.state()[0] * 4.375 * 6.94, 2200.0 * kPi / 30.0, 1e-5);  // rad/s; 1e-8 of 230, a few times
}

// Sampling must not disturb what is sampled: not by a bit, by the bar of the next test.
TEST(UnimogRun, SamplesLeaveTheRunAlone) {
  VehicleSimulation<Unimog> sampled(prepared(), kTolerances), alone(prepared(), kTolerances);
  for (int k = 1; k <= 10000; ++k) sampled.advance(k == 10000 ? 10.0 : 0.001 * k);
  alone.advance(10.0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sampled.state()[i], alone.state()[i]) << i;  // who looks when changes no bit
}

// Bar: halving CVODE's tolerances moves no state by more than 1e-6 of its size, at any of the 1000 samples.
TEST(UnimogRun, HalvedTolerancesMoveNoStateByAMillionth) {
  VehicleSimulation<Unimog> run(prepared(), kTolerances),
      halved(prepared(), {0.5 * kTolerances.relative, 0.5 * kTolerances.absolute});
  double worst = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    run.advance(0.01 * k);
    halved.advance(0.01 * k);
    for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(run.state()[i] / halved.state()[i] - 1.0));
  }
  EXPECT_LT(worst, 1e-6);  // the bar
  EXPECT_GT(worst, 0.0);   // they are two integrations
}

// --- Power balance ----------------------------------------------------------------------------------------------------

// The Unimog with the work of each power flow appended to its state, from the document's equations and not from the model's
// parts: only T_m(w_m) and the torque that reaches the wheel are asked from the model.
struct UnimogWithWork {
  enum Work { kEngine = 3, kClutch, kTransmission, kWheel, kSlip, kRolling, kBearing, kDrag, kEnd };
  static constexpr std::string_view kName = "unimog_with_work";
  static constexpr int kStates = kEnd;
  static constexpr int kEvents = Unimog::kEvents;
  static constexpr auto kCrossings = Unimog::kCrossings;
  static constexpr auto kTruth = Unimog::kTruth;
  using Mode = Unimog::Mode;
  using State = Vector<double, kStates>;

  Unimog unimog = prepared();

  static Unimog::State own(const State& x) { return x.head<3>(); }
  State initial_state() const {
    State x = State::Zero();
    x.head<3>() = unimog.initial_state();
    return x;
  }
  Mode initial_mode() const { return unimog.initial_mode(); }

  template <typename T>
  Vector<T, kStates> derivative(const Vector<T, kStates>& x, const Mode& mode) const {
    using std::atan, std::sin, std::sqrt;
    const T w = x[0], v = x[1];
    const double ratio[]{9.57, 6.635, 4.375, 3.219, 2.188, 1.517, 1.0, 0.736};
    const T w_box = (ratio[mode.gear - 1] * 6.94) * w;
    const T w_engine = mode.idling ? T(800.0 * kPi / 30.0) : w_box;
    const T torque = 0.25 * unimog.engine_torque(w, mode);  // the engine's part for this wheel
    const T l = (0.52 * w - v) / sqrt(v * v + 0.01 * 0.01), bl = 10.0 * l;
    const T force = (2000.0 * 9.81) * sin(1.9 * atan(bl - 0.97 * (bl - atan(bl))));
    const double bearing = unimog.quarter.viscous_friction_nms;

    Vector<T, kStates> rate;
    rate.template head<3>() = unimog.derivative(Vector<T, 3>(x.template head<3>()), mode);
    rate[kEngine] = torque * w_engine;
    rate[kClutch] = torque * (w_engine - w_box);
    rate[kTransmission] = (1.0 - 0.9) * (torque * w_box);
    rate[kWheel] = unimog.wheel_torque(w, mode) * w;
    rate[kSlip] = force * (0.52 * w - v);
    rate[kRolling] = (0.02 * 2000.0 * 9.81 * 0.52) * (w * w / sqrt(w * w + 1e-6));
    rate[kBearing] = bearing * (w * w);
    rate[kDrag] = (0.5 * 1.2 * 0.6 * 5.6) * (v * v * v);  // forward driving
    return rate;
  }
  Vector<double, kEvents> events(const State& x, const Mode& mode) const { return unimog.events(own(x), mode); }
  Mode after_event(int event, const State& x, const Mode& mode) const { return unimog.after_event(event, own(x), mode); }
  auto truth(const State& x, const Mode& mode) const { return unimog.truth(own(x), mode); }
  static constexpr auto kInputs = Unimog::kInputs;
  std::array<double, 1> inputs(const State& x, const Mode& mode) const { return unimog.inputs(own(x), mode); }
};
static_assert(Vehicle<UnimogWithWork>);

double kinetic_j(const UnimogWithWork::State& x) { return 0.5 * 2000.0 * x[1] * x[1] + 0.5 * 11.5 * x[0] * x[0]; }

void expect_balance(const UnimogWithWork& vehicle) {
  using W = UnimogWithWork;
  VehicleSimulation<W> run(vehicle, kTolerances);
  const double start_j = kinetic_j(run.state());
  for (int k = 1; k <= 100; ++k) {
    run.advance(0.1 * k);
    const W::State x = run.state();
    const double bar = 1e-6 * x[W::kEngine];  // of the engine's work: the bar
    const double gained = kinetic_j(x) - start_j;
    EXPECT_NEAR(gained, x[W::kWheel] - x[W::kSlip] - x[W::kRolling] - x[W::kBearing] - x[W::kDrag], bar) << 0.1 * k << " s";
    EXPECT_NEAR(x[W::kWheel], x[W::kEngine] - x[W::kClutch] - x[W::kTransmission], bar) << 0.1 * k << " s";
    for (int i = W::kEngine; i < W::kEnd; ++i) EXPECT_GE(x[i], 0.0) << i << ": no flow runs backwards in this run";
  }
  // Each flow is large enough to be missed if it were left out: at least ten times the bar.
  const W::State x = run.state();
  for (const int i : {W::kEngine, W::kClutch, W::kTransmission, W::kWheel, W::kSlip, W::kRolling, W::kDrag})
    EXPECT_GT(x[i], 1e-5 * x[W::kEngine]) << i;
  EXPECT_GT(x[W::kEngine], 1e5);  // 9 m/s are 81 kJ of 2000 kg alone, and 10 % are lost on the way
}

TEST(UnimogRun, PowerBalanceCloses) { expect_balance({}); }

TEST(UnimogRun, PowerBalanceClosesWithBearingFriction) {
  UnimogWithWork vehicle;
  vehicle.unimog.quarter.viscous_friction_nms = 5.0;
  expect_balance(vehicle);
}

}  // namespace
}  // namespace slipstream
