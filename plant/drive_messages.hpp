// A drive as the messages of one run, each channel with its own sequence numbers.
#pragma once

#include <string>
#include <vector>

#include "common/messages.hpp"
#include "plant/drive_source.hpp"

namespace slipstream {

// Where messages go.
class Sink {
 public:
  virtual ~Sink() = default;
  virtual void publish(const RunDescriptor& m) = 0;
  virtual void publish(const Reading& m) = 0;
  virtual void publish(const Truth& m) = 0;
  virtual void publish(const Tick& m) = 0;
};

class DriveMessages {
 public:
  DriveMessages(const std::vector<std::string>& quantities, std::int64_t run_id);

  // Everything that happens at an instant, but for the tick that says so.
  void publish(const DriveEpoch& epoch, Sink& sink);
  // Everything up to the newest epoch has been published.
  void publish_tick(RunState state, Sink& sink);
  Tick newest_tick() const;  // the one published last

 private:
  const std::vector<std::string>& quantities_;
  std::vector<std::int64_t> channel_seq_;
  Tick tick_;
  Truth truth_;
  Reading reading_;
};

// The first message of a run. `name` identifies the experiment, `scenario_toml` is resolved.
RunDescriptor descriptor_of(const DriveSource& drive, std::int64_t run_id, const std::string& name,
                            const std::string& scenario_toml, const std::string& clock);

// The whole drive at once, for a log: the descriptor, every instant with its tick, and the end. Returns the time of the last
// one.
Utime publish_whole(DriveSource& drive, const RunDescriptor& descriptor, Sink& sink);

}  // namespace slipstream
