#include "monitor/session.hpp"

#include <fmt/format.h>

#include "monitor/text.hpp"

namespace slipstream {
namespace {

// No run lasts 30 years or sends that many messages: beyond this a number is an accident or an attack.
constexpr std::int64_t kMaxCount = 1'000'000'000'000'000;

bool plausible(const Header& header) {
  return header.utime >= 0 && header.utime <= kMaxCount && header.seq >= 0 && header.seq <= kMaxCount;
}

std::string status_text(EstimateStatus status) {
  switch (status) {
    case EstimateStatus::kValid:
      return "valid";
    case EstimateStatus::kInitialising:
      return "initialising";
    case EstimateStatus::kFallback:
      return "fallback";
    case EstimateStatus::kInvalid:
      return "invalid";
  }
  return "?";
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
  if (run_ && run_->info().run_id == m.header.run_id) return;
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
    hooks_.say("the truth of this run is not used: a name in it is not usable");
  }
  if (run_) hooks_.interrupted(*run_);
  run_ = std::make_unique<RunRecord>(std::move(info));
  said_.clear();
  progress_seq_ = 0;
  for (const auto& [name, announcement] : waiting_)
    if (announcement.header.run_id == 0 || announcement.header.run_id == m.header.run_id) run_->add(announcement);
  waiting_.clear();
  hooks_.opened(*run_);
}

void Session::handle(const Tick& m) {
  if (!belongs(m.header)) return;
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
  if (found != run_->estimators().end() && found->second.status)
    say_status(m.name, fmt::format("{} at {:.2f} s", status_text(*found->second.status), seconds(found->second.utime.back())));
}

void Session::handle(const Announcement& m) {
  if (m.role != "estimator") return;
  const bool known = run_ && (m.header.run_id == run_->info().run_id || m.header.run_id == 0);
  if (known) {
    const auto before = run_->estimators().find(m.name);
    const bool is_new = before == run_->estimators().end() || before->second.algorithm.empty();
    const bool had_left = !is_new && before->second.presence == Presence::kLeft;
    run_->add(m);
    if (run_->estimators().count(m.name) == 0) return;
    if (m.presence == Presence::kLeft && !had_left) hooks_.say(fmt::format("{} left", plain_line(m.name)));
    if (m.presence != Presence::kLeft && (is_new || had_left))
      hooks_.say(fmt::format("{} joined: {}, tuning {}, model {}", plain_line(m.name), plain_line(m.algorithm),
                             plain_line(m.tuning), plain_line(m.model)));
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
