// A strapdown filter's view of one run: turns the messages of the bus into predictions and updates, and those into estimates.
//
// What has arrived is processed at every tick, in order of the time of measurement: an IMU's reading predicts, a fix or a speed
// updates. What comes late is put where it belongs (navigation_history.hpp). An estimate is published for every instant that is
// new. Refused, counted and named: what is not finite or impossible, a reading twice, an IMU whose time goes backwards, what
// comes later than tuning.history_s. A fix beyond the tuning's gate is published as gated and left out.
//
// While the IMU is silent the vehicle coasts (navigation_events.hpp) and the estimate says "fallback". A filter that has lost
// the state, because it is not finite or because it has left out every fix for kLost_s, starts again from the fixes.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/geodesy.hpp"
#include "estimators/follower.hpp"
#include "estimators/navigation_history.hpp"
#include "estimators/navigation_start.hpp"

namespace slipstream {

class NavigationSession final : public RunFollower {
 public:
  NavigationSession(std::string name, std::int64_t run_id, const Scenario& scenario, const StrapdownTuning& tuning,
                    std::unique_ptr<NavigationFilter> filter, FollowHooks hooks);

  void on_reading(const Reading& reading) override;
  void on_tick(Utime utime) override;
  void on_rejected() override { ++rejected_; }
  Utime processed_utime() const override { return processed_; }
  ModelNames names() const override;

 private:
  struct Channel {
    NavigationEventKind kind = NavigationEventKind::kClock;
    bool used = true;
    bool seen = false;
    std::int64_t next_seq = 0;
    Utime newest = 0;  // time of measurement
  };

  void refuse(const std::string& quantity, const std::string& reason);
  NavigationEvent event_of(const Channel& channel, const Reading& reading);
  void process(const NavigationEvent& event);
  void start_from_waiting(Utime utime);
  void process_starting(const NavigationEvent& event);
  void process_running(const NavigationEvent& event);
  void start_given(const NavigationEvent& first);
  void begin(const NavigationEntry& entry);
  void watch_gate(const NavigationEntry& entry);
  void start_again(const std::string& why);
  void note(const NavigationEntry& entry);  // its innovation goes into the next estimate
  void publish(double step_time_us);

  std::string name_;
  std::int64_t run_id_;
  StrapdownTuning tuning_;
  std::unique_ptr<NavigationFilter> filter_;
  FollowHooks hooks_;
  LocalFrame world_;
  NavigationFrames frames_;
  double imu_period_s_;
  NavigationProcess process_;
  NavigationHistory history_;
  NavigationStart start_;
  Utime start_lag_ = 0;  // fixes come so late at most: a start waits for them

  NavigationMeasurement gnss_, lidar_, speed_;  // all but z
  Matrix3 lidar_map_ = Matrix3::Identity();
  Vector3 lidar_offset_ = Vector3::Zero();
  NoiseLaw speed_noise_{};
  bool nonholonomic_alone_ = false;  // without a speed sensor: ten times a second
  std::map<std::string, Channel, std::less<>> channels_;

  std::vector<NavigationEvent> pending_;           // arrived, not yet processed
  std::vector<NavigationEvent> waiting_;           // for a start
  std::optional<NavigationEvent> newest_started_;  // the last that a start has processed
  bool running_ = false;
  bool may_start_given_ = false;
  Utime processed_ = -1, published_ = -1;
  std::optional<Utime> gated_since_;  // all position fixes since then
  int gated_ = 0;
  EstimateStatus status_ = EstimateStatus::kInitialising;
  Estimate message_;
  std::int64_t seq_ = 0, lost_ = 0, rejected_ = 0;
  std::vector<NavigationEntry> noted_;
};

}  // namespace slipstream
