// A stage without a bus: records what the conductor publishes and plays the participants' part.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "plant/conductor.hpp"

namespace slipstream {

inline double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Epochs at 0, dt, 2 dt, ...: an input and a sensor at each, truth at every second one.
class FakeDrive final : public DriveSource {
 public:
  FakeDrive(int epochs, Utime dt) : epochs_(epochs), dt_(dt) {}
  const std::vector<std::string>& quantities() const override { return quantities_; }
  const std::vector<std::string>& truth_names() const override { return truth_names_; }
  const std::vector<std::string>& truth_units() const override { return truth_units_; }
  bool next(DriveEpoch& epoch) override {
    if (k_ == epochs_) return false;
    epoch.utime = k_ * dt_;
    epoch.readings = {{0, 100.0 + k_, epoch.utime}, {1, 200.0 + k_, epoch.utime}};
    epoch.truth.clear();
    if (k_ % 2 == 0) epoch.truth = {300.0 + k_};
    ++k_;
    return true;
  }

 private:
  const std::vector<std::string> quantities_{"drive_torque_nm", "wheel_speed_radps"}, truth_names_{"speed_mps"},
      truth_units_{"m/s"};
  const int epochs_;
  const Utime dt_;
  int k_ = 0;
};

struct Published {
  enum Kind { kDescriptor, kReading, kTruth, kTick } kind;
  Header header;
  std::string quantity;
  RunState state = RunState::kRunning;
  double wall_s = 0.0;
  int polls = 0;  // how often the conductor had polled before
};

class FakeStage final : public Stage {
 public:
  static constexpr std::int64_t kRunId = 77;

  Conductor* conductor = nullptr;
  std::vector<Published> published;
  std::vector<std::string> lines;
  std::map<std::string, Utime> processed;  // what the members of `members` have answered, delivered to the conductor
  std::set<std::string> members;           // answer each running tick, two polls later
  std::function<void(const Tick&)> on_tick;
  std::function<void()> on_poll;
  bool interrupt = false;

  void publish(const RunDescriptor& m) override { record({Published::kDescriptor, m.header, m.name}); }
  void publish(const Reading& m) override { record({Published::kReading, m.header, m.quantity}); }
  void publish(const Truth& m) override { record({Published::kTruth, m.header, ""}); }
  void publish(const Tick& m) override {
    record({Published::kTick, m.header, "", m.state});
    for (const std::string& name : members) later(2, [this, name, utime = m.header.utime] { answer(name, utime); });
    if (on_tick) on_tick(m);
  }
  void poll(int timeout_ms) override {
    ++polls_;
    if (on_poll) on_poll();
    bool idle = true;
    for (std::deque<Pending> due = std::exchange(pending_, {}); !due.empty(); due.pop_front()) {
      if (--due.front().polls > 0) {
        pending_.push_back(std::move(due.front()));
        continue;
      }
      due.front().deliver();
      idle = false;
    }
    if (idle && pending_.empty() && timeout_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void say(const std::string& line) override { lines.push_back(line); }
  bool interrupted() const override { return interrupt; }

  // Delivers at the polls-th poll from now.
  void later(int polls, std::function<void()> deliver) { pending_.push_back({polls, std::move(deliver)}); }
  void answer(const std::string& name, Utime utime) {
    processed[name] = std::max(utime, processed.contains(name) ? processed[name] : utime);
    conductor->on_progress({{utime, 0, kRunId}, name});
  }
  void announce(const std::string& name, Presence presence, std::int64_t run_id = kRunId) {
    Announcement a;
    a.header.run_id = run_id;
    a.name = name;
    a.role = "estimator";
    a.presence = presence;
    conductor->on_announcement(a);
  }
  void join(const std::string& name) {
    announce(name, Presence::kJoined);
    members.insert(name);
  }
  void command(Command c, std::int64_t run_id = kRunId) { conductor->on_control({{0, 0, run_id}, c}); }

  std::vector<Published> of(Published::Kind kind) const {
    std::vector<Published> chosen;
    for (const Published& p : published)
      if (p.kind == kind) chosen.push_back(p);
    return chosen;
  }

 private:
  struct Pending {
    int polls;
    std::function<void()> deliver;
  };

  void record(Published p) {
    p.wall_s = slipstream::wall_s();
    p.polls = polls_;
    published.push_back(std::move(p));
  }

  std::deque<Pending> pending_;
  int polls_ = 0;
};

}  // namespace slipstream
