#include "plant/conductor.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "common/refusal.hpp"

namespace slipstream {

namespace {

constexpr double kDescriptorPeriod_s = 1.0;
constexpr double kAskAgain_s = 0.2;       // a tick whose answer is missing is sent again: the first may have been lost
constexpr double kReportMissing_s = 2.0;  // between lines that say who is still missing
constexpr double kMostCatchUp = 2.0;      // after a stall, at most so many times the asked pace
constexpr double kSpacing_s = 0.0002;     // at least, between two instants for which nobody is waited

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

Conductor::Conductor(const RunConfig& run, RunDescriptor descriptor, DriveSource& drive, Stage& stage)
    : run_(run),
      descriptor_(std::move(descriptor)),
      drive_(drive),
      stage_(stage),
      participants_(descriptor_.header.run_id),
      lockstep_(run.clock == "lockstep"),
      realtime_(run.clock == "realtime"),
      messages_(drive.quantities(), descriptor_.header.run_id) {}

void Conductor::on_announcement(const Announcement& a) {
  const bool known = participants_.contains(a.name);
  if (participants_.on_announcement(a)) publish_descriptor();
  if (!known && participants_.contains(a.name))
    stage_.say(fmt::format("{} '{}' takes part{}", a.role, a.name,
                           a.algorithm.empty() ? "" : fmt::format(" ({}, {})", a.algorithm, a.tuning)));
  if (known && a.presence == Presence::kLeft) stage_.say(fmt::format("'{}' has left", a.name));
}

void Conductor::on_control(const Control& c) {
  if (c.header.run_id != 0 && c.header.run_id != descriptor_.header.run_id) return;
  switch (c.command) {
    case Command::kRun:
      paused_ = false;
      break;
    case Command::kPause:
      paused_ = true;
      break;
    case Command::kStep:
      paused_ = true;
      step_once_ = true;
      break;
    case Command::kStop:
      stopped_ = true;
      break;
  }
}

void Conductor::publish_descriptor() {
  descriptor_.header.utime = now_;
  stage_.publish(descriptor_);
  ++descriptor_.header.seq;
  descriptor_sent_s_ = wall_s();
}

void Conductor::keep_alive() {
  if (wall_s() - descriptor_sent_s_ >= kDescriptorPeriod_s) publish_descriptor();
}

void Conductor::wait_for_participants() {
  const double start = wall_s();
  double reported = start;
  while (!stage_.interrupted() && !stopped_) {
    std::vector<std::string> missing;
    for (const std::string& name : run_.wait_for)
      if (!participants_.contains(name)) missing.push_back(name);
    if (missing.empty()) return;
    const double waited = wall_s() - start;
    if (waited > run_.start_timeout_s) {
      publish_tick(RunState::kStopped);  // for those who came
      throw Refusal(
          fmt::format("after {:.0f} s nobody has announced itself as '{}'; start it, or choose others with --wait-for", waited,
                      fmt::join(missing, "', '")));
    }
    if (wall_s() - reported > kReportMissing_s) {
      stage_.say(fmt::format("waiting for {} (--wait-for chooses others)", fmt::join(missing, ", ")));
      reported = wall_s();
    }
    keep_alive();
    stage_.poll(50);
  }
}

void Conductor::publish_tick(RunState state) {
  messages_.publish_tick(state, stage_);
  participants_.on_tick(now_);
  published_s_ = wall_s();
}

void Conductor::wait_for_progress() {
  const double asked = wall_s();
  double asked_again = asked;
  while (!stage_.interrupted() && !stopped_) {
    const std::vector<std::string> late = participants_.late(now_);
    if (late.empty()) return;
    const double wall = wall_s();
    if (wall - asked > run_.late_timeout_s) {
      for (const std::string& name : late) {
        stage_.say(fmt::format("'{}' is late: nothing from it for {:.1f} s after t = {:.3f} s; going on without it", name,
                               wall - asked, seconds(std::max<Utime>(participants_.processed(name), 0))));
        participants_.drop(name);
      }
      return;
    }
    if (wall - asked_again > kAskAgain_s) {
      stage_.publish(messages_.newest_tick());
      asked_again = wall;
    }
    keep_alive();
    stage_.poll(20);
  }
}

void Conductor::pace(Utime previous) {
  const double interval_s = realtime_ ? seconds(now_ - previous) / run_.realtime_factor : 0.0;
  double target = published_s_ + std::max(interval_s / kMostCatchUp, kSpacing_s);
  if (realtime_) target = std::max(target, paced_from_s_ + paused_s_ + seconds(now_) / run_.realtime_factor);
  while (!stage_.interrupted() && !stopped_) {
    const double left = target - wall_s();
    if (left <= 0.0) break;
    if (left > 0.002) {
      stage_.poll(std::max(1, std::min(50, static_cast<int>(left * 1000.0) - 1)));
    } else {
      std::this_thread::sleep_for(std::chrono::duration<double>(left));
    }
    keep_alive();
  }
  stage_.poll(0);
}

void Conductor::stay_paused() {
  if (!paused_ || step_once_) {
    step_once_ = false;
    return;
  }
  const double from = wall_s();
  if (begun_) publish_tick(RunState::kPaused);  // before the first instant nothing can be claimed
  stage_.say(fmt::format("paused at t = {:.3f} s", seconds(now_)));
  while (paused_ && !step_once_ && !stopped_ && !stage_.interrupted()) {
    keep_alive();
    stage_.poll(50);
  }
  step_once_ = false;
  paused_s_ += wall_s() - from;
}

RunSummary Conductor::play() {
  publish_descriptor();
  wait_for_participants();
  const double start = wall_s();
  paced_from_s_ = start;
  published_s_ = start;
  RunSummary summary;
  DriveEpoch epoch;
  while (!stopped_ && !stage_.interrupted()) {
    if (!drive_.next(epoch)) {
      summary.complete = true;
      break;
    }
    stay_paused();
    if (stopped_ || stage_.interrupted()) break;
    if (!lockstep_ || participants_.empty()) {
      const Utime previous = std::exchange(now_, epoch.utime);
      pace(previous);
    }
    now_ = epoch.utime;
    messages_.publish(epoch, stage_);
    begun_ = true;
    publish_tick(RunState::kRunning);
    keep_alive();
    stage_.poll(0);
    if (lockstep_) wait_for_progress();
  }
  summary.simulated_s = seconds(now_);
  summary.wall_s = wall_s() - start - paused_s_;
  publish_tick(summary.complete ? RunState::kEnded : RunState::kStopped);
  // Nobody answers for the end of the run; whoever missed it gets it again.
  for (int i = 0; i < 2; ++i) {
    stage_.poll(20);
    stage_.publish(messages_.newest_tick());
  }
  return summary;
}

}  // namespace slipstream
