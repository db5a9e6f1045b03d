// Plays a drive to whoever listens, at the pace of the chosen clock:
//
//   lockstep   after each tick wait until every participant has processed it; as fast as they can
//   realtime   keep simulation time at `realtime_factor` times the wall clock
//   free       wait for nobody once the run has begun
//
// The bus is behind an interface, so that the conductor names no transport. Where nobody is waited for it keeps a short
// distance between two instants, and in real time it catches up after a stall at most at twice the asked pace: never by a burst
// that a logger with a small queue would lose.
#pragma once

#include <functional>
#include <string>

#include "common/messages.hpp"
#include "models/scenario.hpp"
#include "plant/drive_messages.hpp"
#include "plant/drive_source.hpp"
#include "plant/participants.hpp"

namespace slipstream {

// Where a conductor's messages go, and where others' come from.
class Stage : public Sink {
 public:
  // Waits up to timeout_ms for messages and hands them to the conductor.
  virtual void poll(int timeout_ms) = 0;
  // A line for the person at the terminal.
  virtual void say(const std::string& line) = 0;
  virtual bool interrupted() const = 0;
};

struct RunSummary {
  double simulated_s = 0.0;
  double wall_s = 0.0;
  bool complete = false;
};

class Conductor {
 public:
  Conductor(const RunConfig& run, RunDescriptor descriptor, DriveSource& drive, Stage& stage);

  void on_announcement(const Announcement& a);
  void on_progress(const Progress& p) { participants_.on_progress(p); }
  void on_control(const Control& c);

  // Plays the whole drive. Refuses to start without those that run.wait_for names, after run.start_timeout_s.
  RunSummary play();

 private:
  void publish_descriptor();
  void keep_alive();
  void wait_for_participants();
  void publish_tick(RunState state);
  void wait_for_progress();
  void pace(Utime previous);
  void stay_paused();

  const RunConfig run_;
  RunDescriptor descriptor_;
  DriveSource& drive_;
  Stage& stage_;
  Participants participants_;
  const bool lockstep_, realtime_;

  Utime now_ = 0;
  DriveMessages messages_;
  double descriptor_sent_s_ = -1.0;
  double paced_from_s_ = 0.0;  // wall clock at simulation time 0
  double published_s_ = 0.0;   // wall clock of the last tick
  double paused_s_ = 0.0;      // wall clock spent paused
  bool begun_ = false;         // an instant has been published
  bool paused_ = false, step_once_ = false, stopped_ = false;
};

}  // namespace slipstream
