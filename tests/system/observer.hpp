// The test itself on the bus: hears everything, commands the plant, and may take part in lockstep, so that a test decides what
// happens at which instant. And estimates read from a log, to be compared bit by bit.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/messages.hpp"
#include "io/bus.hpp"
#include "tests/system/process.hpp"

namespace slipstream::test {

class Observer {
 public:
  // `name` empty: only listens and commands. Else the plant waits for it at every tick, once it has asked for it.
  explicit Observer(const std::string& url, std::string name = "") : name_(std::move(name)), bus_(url) {
    Handlers h;
    h.run = [this](const RunDescriptor& m) { on_run(m); };
    h.tick = [this](const Tick& m) { on_tick(m); };
    h.truth = [this](const Truth& m) { truth.push_back(m); };
    h.reading = [this](const Reading& m) { readings.push_back(m); };
    h.estimate = [this](const Estimate& m) { estimates[m.name].push_back(m); };
    h.announcement = [this](const Announcement& m) { announcements.push_back(m); };
    bus_.subscribe(h);
    announce(0);
  }

  // Listens until `done`; false if that never comes.
  bool until(const std::function<bool()>& done, double limit_s = kLimit_s) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit_s);
    while (!done()) {
      if (std::chrono::steady_clock::now() > end) return false;
      bus_.poll(20);
    }
    return true;
  }
  bool until_paused(Utime utime) {
    return until(
        [&] { return !ticks.empty() && ticks.back().state == RunState::kPaused && ticks.back().header.utime >= utime; });
  }
  bool until_ended() {
    return until([&] { return !ticks.empty() && is_over(ticks.back().state); });
  }
  // Until somebody of that name follows the run.
  bool until_follows(const std::string& name) {
    const std::size_t from = announcements.size();
    return until([&] {
      for (std::size_t i = from; i < announcements.size(); ++i) {
        const Announcement& a = announcements[i];
        if (a.name == name && run_id != 0 && a.header.run_id == run_id && a.presence != Presence::kLeft) return true;
      }
      return false;
    });
  }
  void send(Command command) { bus_.publish(Control{{0, control_seq_++, 0}, command}); }
  Bus& bus() { return bus_; }

  // Called at each new tick of a running plant, before the reply.
  std::function<void(const Tick&)> at_tick;

  std::int64_t run_id = 0;
  std::vector<Tick> ticks;  // without repetitions
  std::vector<Truth> truth;
  std::vector<Reading> readings;
  std::vector<Announcement> announcements;
  std::map<std::string, std::vector<Estimate>> estimates;

 private:
  void on_run(const RunDescriptor& m) {
    if (m.header.run_id == run_id) return;
    run_id = m.header.run_id;
    is_lockstep_ = m.clock == "lockstep";
    announce(run_id);
  }
  void on_tick(const Tick& m) {
    if (m.header.run_id != run_id) return;
    const bool repeated = !ticks.empty() && ticks.back().header.run_id == run_id && m.header.seq <= ticks.back().header.seq;
    if (!repeated) ticks.push_back(m);
    if (!repeated && m.state == RunState::kRunning && at_tick) at_tick(m);
    if (!name_.empty() && is_lockstep_) bus_.publish(Progress{{m.header.utime, progress_seq_++, run_id}, name_});
  }
  void announce(std::int64_t run) {
    if (name_.empty()) return;
    Announcement a;
    a.header = {0, announce_seq_++, run};
    a.name = name_;
    a.role = "monitor";
    a.presence = run == 0 ? Presence::kJoined : Presence::kAlive;
    bus_.publish(a);
  }

  std::string name_;
  Bus bus_;
  bool is_lockstep_ = false;
  std::int64_t control_seq_ = 0, progress_seq_ = 0, announce_seq_ = 0;
};

// Everything of an estimate but its step time (and, where the bus was disturbed, the count of rejections), bit by bit.
inline std::string bits(const Estimate& e, bool with_rejections = true) {
  std::string result = e.name + " " + std::to_string(static_cast<int>(e.status));
  const auto add = [&](const auto& values) {
    result += " " + std::to_string(values.size()) + ":";
    result.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  add(std::vector<std::int64_t>{e.header.utime, e.header.seq, e.header.run_id, e.messages_lost,
                                with_rejections ? e.messages_rejected : 0});
  for (const auto* values :
       {&e.mean, &e.covariance, &e.interval_low, &e.interval_high, &e.innovation, &e.innovation_covariance})
    add(*values);
  for (const std::string& quantity : e.innovation_of) result += " " + quantity;
  return result;
}

inline std::vector<Estimate> estimates_in(const std::string& log, const std::string& name) {
  std::vector<Estimate> estimates;
  Bus bus("file://" + log + "?speed=0");
  Handlers h;
  h.estimate = [&](const Estimate& e) {
    if (e.name == name) estimates.push_back(e);
  };
  bus.subscribe(h);
  while (bus.poll(0)) {
  }
  return estimates;
}

}  // namespace slipstream::test
