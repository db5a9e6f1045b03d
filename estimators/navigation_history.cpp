#include "estimators/navigation_history.hpp"

#include <algorithm>

#include "common/check.hpp"

namespace slipstream {

NavigationHistory::NavigationHistory(const NavigationProcess& process, std::size_t capacity, Utime span)
    : process_(process), ring_(std::max<std::size_t>(capacity, 4)), span_(span) {}

void NavigationHistory::start(const NavigationEntry& entry) {
  first_ = 0;
  size_ = 1;
  at(0) = entry;
}

void NavigationHistory::make_room() {
  if (size_ < ring_.size()) return;
  first_ = (first_ + 1) % ring_.size();
  --size_;
}

NavigationHistory::Insertion NavigationHistory::insert(const NavigationEvent& event) {
  SLIPSTREAM_CHECK(size_ > 0);
  std::size_t place = size_;  // of the event among the entries
  while (place > 0 && event < at(place - 1).event) --place;
  if (place > 0 && is_same(at(place - 1).event, event)) return Insertion::kRepeated;
  if (place == 0 || newest().event.utime - event.utime > span_) return Insertion::kTooLate;
  const std::size_t full = size_ == ring_.size() ? 1 : 0;
  make_room();
  place -= full;
  if (place == 0) return Insertion::kTooLate;  // the entry before it has just been forgotten
  for (std::size_t i = size_; i > place; --i) at(i).event = at(i - 1).event;
  ++size_;
  at(place).event = event;
  for (std::size_t i = place; i < size_; ++i) process_.advance(at(i - 1), NavigationEvent(at(i).event), at(i));
  inserted_ = place;
  return Insertion::kDone;
}

}  // namespace slipstream
