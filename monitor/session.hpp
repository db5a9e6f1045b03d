// Which run a message belongs to: opens a record when a run descriptor arrives, feeds it, answers ticks, closes it. It knows
// neither the bus nor the wall clock; main.cpp connects it to both.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "monitor/run_record.hpp"

namespace slipstream {

class Session {
 public:
  struct Hooks {
    std::function<RunInfo(const RunDescriptor&)> describe;  // reads the scenario
    std::function<void(const RunRecord&)> opened;
    std::function<void(const RunRecord&)> interrupted;  // another run began: this one ends here, incomplete
    std::function<void(const Progress&)> reply;         // to a tick in lockstep
    std::function<void(const std::string& line)> say;   // joined, left, changed its status
  };
  Session(std::string own_name, Hooks hooks);

  void handle(const RunDescriptor& m);
  void handle(const Tick& m);
  void handle(const Truth& m);
  void handle(const Reading& m);
  void handle(const Estimate& m);
  void handle(const Announcement& m);

  const RunRecord* run() const { return run_.get(); }
  std::int64_t ignored() const { return ignored_; }    // of another run, or before any run was known
  std::int64_t activity() const { return activity_; }  // messages of this run so far, announcements aside

 private:
  bool belongs(const Header& header);
  void say_status(const std::string& name, const std::string& status);

  std::string own_name_;
  Hooks hooks_;
  std::unique_ptr<RunRecord> run_;
  std::map<std::string, Announcement> waiting_;  // estimators that announced themselves before the run was known
  std::map<std::string, std::string> said_;      // last status line of each estimator
  std::int64_t ignored_ = 0;
  std::int64_t activity_ = 0;
  std::int64_t progress_seq_ = 0;
};

}  // namespace slipstream
