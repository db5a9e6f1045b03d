// The files of a recorded drive: CSV columns to plain streams.
#pragma once

#include <string>

#include "models/recorded.hpp"
#include "models/scenario.hpp"

namespace slipstream {

// Reads the columns that the scenario, which must be of a recorded drive, names from CSV files below data_dir, scaled to the
// quantities' units; fixes in metres become geodetic about the scenario's world, and those that its outages cover are left out.
// Refuses a missing folder, what io/csv.hpp refuses, times outside 0 ... 1e6 s, values that cannot be, and quaternions that are
// not of unit length within 1 %, with file and line.
RecordedStreams load_recorded(const Scenario& scenario, const std::string& data_dir);

}  // namespace slipstream
