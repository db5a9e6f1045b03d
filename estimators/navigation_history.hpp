// The recent past of a strapdown filter: every event with the belief after it, so that one that comes late is put where it
// belongs and everything after it is done again. The result is, to the bit, that of the events in order.
//
// A ring of fixed size: nothing is allocated after construction. What is older than `span` before the newest event is
// forgotten.
#pragma once

#include <vector>

#include "estimators/navigation_events.hpp"

namespace slipstream {

class NavigationHistory {
 public:
  enum class Insertion { kDone, kTooLate, kRepeated };

  // `capacity`: events that fit; fewer than happen in `span` shorten what may come late.
  NavigationHistory(const NavigationProcess& process, std::size_t capacity, Utime span);

  void start(const NavigationEntry& entry);
  // An event later than the newest is simply the next.
  Insertion insert(const NavigationEvent& event);
  const NavigationEntry& newest() const { return at(size_ - 1); }
  // The entry of an event just inserted.
  const NavigationEntry& inserted() const { return at(inserted_); }
  void clear() { size_ = 0; }

 private:
  const NavigationEntry& at(std::size_t i) const { return ring_[(first_ + i) % ring_.size()]; }
  NavigationEntry& at(std::size_t i) { return ring_[(first_ + i) % ring_.size()]; }
  void make_room();

  const NavigationProcess& process_;
  std::vector<NavigationEntry> ring_;
  Utime span_;
  std::size_t first_ = 0, size_ = 0, inserted_ = 0;
};

}  // namespace slipstream
