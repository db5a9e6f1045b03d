// Numbered items of work done by processes side by side, each of which does many, one after the other.
//
// An item that throws, or whose process crashes, is told with its reason; the others go on, in a new process if need be. A
// process has orders for about 20 ms in advance and speaks every few milliseconds, so short items cost the parent little, no
// process waits for it, and all of them end together.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "studies/child_process.hpp"

namespace slipstream {

// An item in memory that a child shares with its parent: what the child was doing is known however it ended.
class SharedItem {
 public:
  SharedItem();
  ~SharedItem();
  SharedItem(const SharedItem&) = delete;
  SharedItem& operator=(const SharedItem&) = delete;
  std::atomic<std::size_t>& item() { return *item_; }

 private:
  std::atomic<std::size_t>* item_;
};

class Workers {
 public:
  using Work = std::function<std::string(std::size_t item)>;  // in a child: one line
  struct Hooks {
    std::function<void(std::size_t item, const std::string& line)> finished;
    std::function<void(std::size_t item, const std::string& error)> failed;
  };

  Workers(int jobs, Work work, Hooks hooks);

  std::size_t wanted() const;  // items, to have something to do or to have orders in advance
  bool is_idle() const;        // nothing is under way
  void give(std::size_t item);
  void wait(int most_ms);  // until something is said, or so long; calls the hooks

 private:
  struct Worker {
    std::unique_ptr<ChildProcess> child;
    std::unique_ptr<SharedItem> at;     // what it is doing
    std::deque<std::size_t> under_way;  // in the order in which it does them
    std::size_t unordered = 0;          // the last of them, which it has not been told of yet
    int deaths_between_items = 0;       // of its processes, since one finished an item
  };

  std::size_t depth() const;
  Worker& freest();
  void order(Worker& worker);
  void start(Worker& worker);
  void hear(Worker& worker, const std::string& line);
  void bury(Worker& worker);

  Work work_;
  Hooks hooks_;
  std::vector<Worker> workers_;
  std::size_t finished_ = 0;
  std::chrono::steady_clock::time_point started_;
};

}  // namespace slipstream
