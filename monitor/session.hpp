// Which run a message belongs to: opens a record when a run descriptor arrives, feeds it, answers ticks, closes it. It knows
// neither the bus nor the wall clock; main.cpp connects it to both.
//
// A run gives way to another one when it is over, or when its plant has sent neither tick nor descriptor for 3 s; until then
// the other plant is ignored. (A paused plant, or one that waits for participants, repeats its descriptor once a second.) It
// gives way to itself when it starts again, as a replay that is broken off and repeated does: its ticks or its descriptors
// count from 0 again.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "monitor/health.hpp"
#include "monitor/run_record.hpp"

namespace slipstream {

class Session {
 public:
  struct Hooks {
    std::function<RunInfo(const RunDescriptor&)> describe;  // reads the scenario
    std::function<void(const RunRecord&)> opened;
    std::function<void(const RunRecord&)> interrupted;  // another run begins, or this one anew: it ends here
    std::function<void(const Progress&)> reply;         // to a tick in lockstep
    std::function<void(const std::string& line)> say;   // joined, left, changed its status: the live table shows it too
    std::function<void(const std::string& line)> warn;  // what no table shows
  };
  Session(std::string own_name, Hooks hooks);

  // The wall clock, from any zero: to be set before what arrives then is handled.
  void set_wall_s(double now_s) { wall_s_ = now_s; }
  // To be called now and then on a live bus: says that the plant has fallen silent.
  void watch();

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
  void open(const RunDescriptor& m);
  void start_again();
  void heard_plant();
  void say_status(const std::string& name, const std::string& status);

  std::string own_name_;
  Hooks hooks_;
  std::unique_ptr<RunRecord> run_;
  RunDescriptor descriptor_;    // of the present run
  double wall_s_ = 0.0;         // now
  double plant_heard_s_ = 0.0;  // the newest tick or descriptor of the present run
  bool said_other_plant_ = false;
  bool said_silent_ = false;
  std::map<std::string, Announcement> waiting_;  // estimators that announced themselves before the run was known
  std::map<std::string, Announcement> newest_;   // of each estimator in the run: a run that starts again begins with them
  std::map<std::string, std::string> said_;      // last status line of each estimator
  std::map<std::string, std::size_t> joined_;    // of how many lives of each estimator it was said that they joined
  std::set<std::string> conflicts_said_;
  std::map<std::string, Health> health_;  // of each estimator's sensors
  std::int64_t ignored_ = 0;
  std::int64_t activity_ = 0;
  std::int64_t progress_seq_ = 0;
};

}  // namespace slipstream
