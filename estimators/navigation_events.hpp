// What happens to a strapdown filter, in order of time, and what it does to the belief: predict to the event with the IMU's
// reading held, then update.
//
//   reading k holds from its time to the next reading's: the step that ends at an event has dt = its time - the one before
//   Q of a step:  sigma^2 T dt,  T = 1 / rate      so that a step divided by a fix between two readings has the same noise
//   silence:      a reading holds for at most kHold periods; beyond, the vehicle coasts: no acceleration,
//                 no rotation, known only to
//                 q_f = (3 m/s^2)^2 s and q_w = (0.3 rad/s)^2 s, white: after one second of unknown driving
//
// Innovations of one instant are computed one after the other, so they are independent of each other.
#pragma once

#include "estimators/navigation.hpp"

namespace slipstream {

// In the order in which those of one instant are processed.
enum class NavigationEventKind : std::uint8_t { kImu, kGnss, kLidar, kSpeed, kClock };

struct NavigationEvent {
  Utime utime = 0;
  NavigationEventKind kind = NavigationEventKind::kClock;
  Inertial reading{};                   // of kImu
  NavigationMeasurement measurement{};  // of the others but kClock
  bool measures = false;                // has a measurement: a kImu may have the non-holonomic one
  int first_output = 0;                 // of the innovation, among Strapdown::kOutputNames

  friend bool operator<(const NavigationEvent& a, const NavigationEvent& b) {
    return a.utime != b.utime ? a.utime < b.utime : a.kind < b.kind;
  }
  friend bool is_same(const NavigationEvent& a, const NavigationEvent& b) { return a.utime == b.utime && a.kind == b.kind; }
};

// The filter after an event.
struct NavigationEntry {
  NavigationEvent event;
  NavigationBelief belief;
  Inertial held{};       // the newest reading
  Utime held_since = 0;  // its time
  NavigationInnovation innovation{};
};

class NavigationProcess {
 public:
  // gates: of a measurement with 1, 2, 3 rows.
  NavigationProcess(const NavigationFilter& filter, const InertialNoise& noise, double imu_period_s, double gravity_mps2,
                    const std::array<double, 3>& gates)
      : filter_(filter), noise_(noise), period_s_(imu_period_s), gravity_mps2_(gravity_mps2), gates_(gates) {}

  // `to` may not be `from`. Its event must not be before from's.
  void advance(const NavigationEntry& from, const NavigationEvent& event, NavigationEntry& to) const;
  // Whether the IMU is silent at an entry's time.
  bool is_coasting(const NavigationEntry& entry) const { return seconds(entry.event.utime - entry.held_since) > hold_s(); }
  double hold_s() const { return kHold * period_s_; }

 private:
  static constexpr double kHold = 5.0;
  void coast(NavigationBelief& belief, double dt_s) const;

  const NavigationFilter& filter_;
  InertialNoise noise_;
  double period_s_, gravity_mps2_;
  std::array<double, 3> gates_;
};

}  // namespace slipstream
