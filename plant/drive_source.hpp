// A drive, simulated or recorded, as a time-ordered sequence of epochs: everything that happens at one instant.
#pragma once

#include <string>
#include <vector>

#include "common/messages.hpp"

namespace slipstream {

struct NamedValue {
  int channel = 0;  // index into DriveSource::quantities()
  Values value = 0.0;
  Utime utime = 0;  // of the measurement: the epoch's, or before it where a reading comes late
};

struct DriveEpoch {
  Utime utime = 0;
  std::vector<NamedValue> readings;  // inputs first, then sensors, in the order of the scenario
  std::vector<double> truth;         // of truth_names(); empty when no truth belongs to this instant
};

class DriveSource {
 public:
  virtual ~DriveSource() = default;
  virtual const std::vector<std::string>& quantities() const = 0;  // names of what `readings` carry
  virtual const std::vector<std::string>& truth_names() const = 0;
  virtual const std::vector<std::string>& truth_units() const = 0;
  // The next epoch, reusing its storage; false at the end of the drive.
  virtual bool next(DriveEpoch& epoch) = 0;
};

}  // namespace slipstream
