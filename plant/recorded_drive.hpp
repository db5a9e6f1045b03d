// A recorded drive as a drive source: its streams merged in time order. What happens at one microsecond is one epoch, inputs
// before sensors before readings of several numbers; truth is attached to its instant, NaN for the quantities that have no
// sample there. A reading that lags carries the time of its measurement; one that was measured before the start is left out.
//
// Truth of a pose (RecordedStreams::path) is the speed "speed_mps" of plant/path_speed.hpp, whose head states its accuracy.
#pragma once

#include <vector>

#include "models/recorded.hpp"
#include "plant/drive_source.hpp"

namespace slipstream {

class RecordedDrive : public DriveSource {
 public:
  // Plays up to duration_s inclusive; 0: the whole drive. Refuses times that are not from 0 to 1e6 s, that do not increase
  // within a stream by a microsecond, and a drive with nothing in it.
  RecordedDrive(const RecordedStreams& streams, double duration_s);

  const std::vector<std::string>& quantities() const override { return quantities_; }
  const std::vector<std::string>& truth_names() const override { return truth_names_; }
  const std::vector<std::string>& truth_units() const override { return truth_units_; }
  bool next(DriveEpoch& epoch) override;

  double duration_s() const { return seconds(events_.back().utime); }  // of what is played

 private:
  struct Event {
    Utime utime;
    int channel;  // quantities first, then truth
    Values value;
    Utime lag = 0;
  };

  void add(const std::string& quantity, const std::vector<double>& time_s, const auto& value, int channel, double lag_s = 0.0);

  std::vector<std::string> quantities_, truth_names_, truth_units_;
  std::vector<Event> events_;
  std::size_t next_ = 0;
};

}  // namespace slipstream
