// Who takes part in a run, and how far each has got: the book-keeping of lockstep. Knows no bus and no clock.
//
// A participant counts from its first announcement that carries this run's id, which it sends once it has read the run
// descriptor; it stops counting when it leaves or is dropped, and counts again after a new announcement.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "common/messages.hpp"

namespace slipstream {

class Participants {
 public:
  explicit Participants(std::int64_t run_id) : run_id_(run_id) {}

  // True if the sender does not know the run yet, so that the run descriptor should be published again.
  bool on_announcement(const Announcement& a) {
    if (a.presence == Presence::kLeft) {
      if (a.header.run_id == 0 || a.header.run_id == run_id_) members_.erase(a.name);
      return false;
    }
    if (a.header.run_id == 0) return true;
    if (a.header.run_id != run_id_) return false;  // it follows another plant on this bus
    // Who was dropped comes back with its next sign of life; what it still has to process, it answers for from then on.
    if (!members_.contains(a.name) && members_.size() < kMostMembers) members_[a.name] = last_tick_;
    return false;
  }
  void on_progress(const Progress& p) {
    const auto found = members_.find(p.name);
    if (p.header.run_id == run_id_ && found != members_.end()) found->second = std::max(found->second, p.header.utime);
  }
  void on_tick(Utime utime) { last_tick_ = utime; }

  bool contains(const std::string& name) const { return members_.contains(name); }
  bool empty() const { return members_.empty(); }

  // Who has not yet processed everything up to utime.
  std::vector<std::string> late(Utime utime) const {
    std::vector<std::string> names;
    for (const auto& [name, processed] : members_)
      if (processed < utime) names.push_back(name);
    return names;
  }
  Utime processed(const std::string& name) const { return members_.at(name); }
  void drop(const std::string& name) { members_.erase(name); }

 private:
  static constexpr std::size_t kMostMembers = 64;  // a flood of names shall not stall lockstep

  std::int64_t run_id_;
  Utime last_tick_ = -1;
  std::map<std::string, Utime> members_;  // name -> processed up to
};

}  // namespace slipstream
