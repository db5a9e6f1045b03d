// The files of a recorded drive: CSV columns to plain streams.
#pragma once

#include <string>

#include "models/recorded.hpp"
#include "models/scenario.hpp"

namespace slipstream {

// Reads the columns that the scenario names from CSV files below data_dir, scaled to the quantities' units. Refuses a missing
// folder, what io/csv.hpp refuses, and times outside 0 ... 1e6 s, with file and line.
RecordedStreams load_recorded(const RecordedConfig& recorded, const std::string& data_dir);

}  // namespace slipstream
