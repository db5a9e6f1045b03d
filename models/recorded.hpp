// A recorded drive as plain numbers: io/recorded_files fills it from files, plant/recorded_drive plays it. Times are seconds
// since the start of the drive, at least 0 and strictly increasing in each stream.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/messages.hpp"

namespace slipstream {

struct RecordedStream {
  std::string quantity;  // name with the unit as suffix
  std::string unit;      // for axes
  std::vector<double> time_s;
  std::vector<double> value;  // in the quantity's unit
};

// Readings of several numbers (common/readings.hpp), as they go on the bus.
struct RecordedGroupStream {
  std::string quantity;
  std::vector<double> time_s;  // when they were sent
  std::vector<Values> value;
  double lag_s = 0.0;  // they were measured so much before
};

// A planar pose in W, from which the speed is derived.
struct RecordedPath {
  std::vector<double> time_s, x_m, y_m;
  std::vector<double> yaw_rad;  // of the body's x axis against W's; empty: not known
  double window_s = 0.4;        // as in RecordedPathSpeed of scenario.hpp
  double max_residual_m = 0.05;
};

struct RecordedStreams {
  std::vector<RecordedStream> inputs;
  std::vector<RecordedStream> sensors;
  std::vector<RecordedGroupStream> groups;
  std::vector<RecordedStream> truth;
  std::optional<RecordedPath> path;  // truth "speed_mps"
};

}  // namespace slipstream
