#include "monitor/session.hpp"

#include <fmt/format.h>

#include "monitor/text.hpp"

namespace slipstream {
namespace {

// No run lasts 30 years or sends that many messages: beyond this a number is an accident or an attack.
constexpr std::int64_t kMaxCount = 1'000'000'000'000'000;
constexpr double kAlive_s = 3.0;   // a plant that was heard within this time goes on: three descriptors
constexpr double kSilent_s = 5.0;  // a plant that was not heard for so long is worth a line

bool plausible(const Header& header) {
  return header.utime >= 0 && header.utime <= kMaxCount && header.seq >= 0 && header.seq <= kMaxCount;
}

}  // namespace

Session::Session(std::string own_name, Hooks hooks) : own_name_(std::move(own_name)), hooks_(std::move(hooks)) {}

bool Session::belongs(const Header& header) {
  if (run_ && header.run_id == run_->info().run_id && plausible(header)) {
    ++activity_;
    return true;
  }
  ++ignored_;
  return false;
}

void Session::handle(const RunDescriptor& m) {
  if (run_ && run_->info().run_id == m.header.run_id) {
    if (m.header.seq == 0 && run_->newest_tick_seq() >= 0) start_again();
    heard_plant();
    return;
  }
  if (run_ && !run_->ended() && wall_s_ - plant_heard_s_ < kAlive_s) {
    ++ignored_;
    if (!said_other_plant_)
      hooks_.warn(fmt::format("another plant is on this bus: {}; ignored while {} goes on", plain_line(m.name),
                              plain_line(run_->info().name)));
    said_other_plant_ = true;
    return;
  }
  if (run_)
    hooks_.warn(fmt::format("another run begins: {} is closed, {}", plain_line(run_->info().name),
                            run_->complete() ? "complete" : "incomplete"));
  open(m);
}

void Session::start_again() {
  hooks_.warn(fmt::format("run {} starts again", plain_line(run_->info().name)));
  waiting_.clear();
  for (const auto& [name, announcement] : newest_)
    if (announcement.presence != Presence::kLeft) waiting_.emplace(name, announcement);
  open(RunDescriptor(descriptor_));
}

void Session::heard_plant() {
  plant_heard_s_ = wall_s_;
  if (said_silent_) hooks_.warn("the plant is back");
  said_silent_ = false;
}

void Session::watch() {
  const bool expected = run_ && !run_->ended() && run_->state() != RunState::kPaused;
  if (!expected || said_silent_ || wall_s_ - plant_heard_s_ < kSilent_s) return;
  hooks_.warn(fmt::format("no message from the plant for {:g} s", kSilent_s));
  said_silent_ = true;
}

void Session::open(const RunDescriptor& m) {
  RunInfo info = hooks_.describe(m);
  // Unsafe truth names would reach a plot and a table: such a run has no truth.
  bool usable = m.truth_names.size() == m.truth_units.size() && m.truth_names.size() <= 64;
  for (const std::string& name : m.truth_names) usable = usable && is_safe_name(name);
  info.run_id = m.header.run_id;
  info.name = m.name;
  info.clock = m.clock;
  if (usable) {
    info.truth_names = m.truth_names;
    info.truth_units = m.truth_units;
  } else {
    hooks_.warn("the truth of this run is not used: a name in it is not usable");
  }
  if (run_) hooks_.interrupted(*run_);
  run_ = std::make_unique<RunRecord>(std::move(info));
  descriptor_ = m;
  plant_heard_s_ = wall_s_;
  said_other_plant_ = said_silent_ = false;
  said_.clear();
  newest_.clear();
  joined_.clear();
  conflicts_said_.clear();
  health_.clear();
  progress_seq_ = 0;
  for (const auto& [name, announcement] : waiting_)
    if (announcement.header.run_id == 0 || announcement.header.run_id == m.header.run_id) run_->add(announcement);
  waiting_.clear();
  hooks_.opened(*run_);
}

void Session::handle(const Tick& m) {
  if (!belongs(m.header)) return;
  if (m.header.seq == 0 && run_->newest_tick_seq() > 0) start_again();
  heard_plant();
  run_->add(m);
  if (run_->info().clock == "lockstep")
    hooks_.reply(Progress{{m.header.utime, progress_seq_++, run_->info().run_id}, own_name_});
}

void Session::handle(const Truth& m) {
  if (belongs(m.header)) run_->add(m);
}

void Session::handle(const Reading& m) {
  if (belongs(m.header)) run_->add(m);
}

void Session::handle(const Estimate& m) {
  if (!belongs(m.header)) return;
  run_->add(m);
  const auto found = run_->estimators().find(m.name);
  if (found == run_->estimators().end()) return;
  Health& health = health_[m.name];
  health.update(found->second);
  for (const std::string& line : health.take_news()) hooks_.warn(fmt::format("{}: {}", plain_line(m.name), line));
  if (found->second.status)
    say_status(m.name, fmt::format("{} at {:.2f} s", status_name(*found->second.status), seconds(found->second.utime.back())));
}

void Session::handle(const Announcement& m) {
  if (m.role != "estimator") return;
  const bool known = run_ && (m.header.run_id == run_->info().run_id || m.header.run_id == 0);
  if (known) {
    run_->add(m);
    const auto found = run_->estimators().find(m.name);
    if (found == run_->estimators().end()) return;
    const EstimatorRecord& r = found->second;
    if (!m.state_names.empty() || m.presence == Presence::kLeft) newest_.insert_or_assign(m.name, m);
    if (r.name_conflict && conflicts_said_.insert(m.name).second)
      hooks_.warn(fmt::format("two estimators are named '{}'; names must differ", plain_line(m.name)));
    if (r.presence == Presence::kLeft) {
      if (joined_.erase(m.name) > 0) hooks_.say(fmt::format("{} left", plain_line(m.name)));
    } else if (m.presence != Presence::kLeft && !m.algorithm.empty() && !m.tuning.empty() && !m.state_names.empty()) {
      std::size_t& lives_said = joined_[m.name];  // a new entry is 0, and there is always one life
      if (lives_said < r.lives.size())
        hooks_.say(fmt::format("{} joined: {}, tuning {}, model {}", plain_line(m.name), plain_line(m.algorithm),
                               plain_line(m.tuning), plain_line(m.model)));
      lives_said = r.lives.size();
    }
  } else {
    // Either it waits for a run, or it has read the descriptor of one that has not reached us yet.
    if (m.header.run_id != 0) ++ignored_;
    if (m.presence == Presence::kLeft) {
      waiting_.erase(m.name);
    } else if ((waiting_.size() < 64 || waiting_.contains(m.name)) && waiting_.insert_or_assign(m.name, m).second &&
               m.header.run_id == 0) {
      hooks_.say(fmt::format("{} is waiting for a run", plain_line(m.name)));
    }
  }
}

// Only a change of the status is worth a line.
void Session::say_status(const std::string& name, const std::string& status) {
  std::string& last = said_[name];
  const std::string kind = status.substr(0, status.find(' '));
  if (last == kind) return;
  last = kind;
  hooks_.say(fmt::format("{} is {}", plain_line(name), status));
}

}  // namespace slipstream
