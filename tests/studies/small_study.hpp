// A study of a point mass that takes milliseconds, read as a user's is.
#pragma once

#include <string>

#include "io/study_reader.hpp"
#include "studies/item.hpp"
#include "tests/io/temporary_folder.hpp"

namespace slipstream {

inline const std::string kPointMass = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/point_mass.toml";

// Lines are counted in the tests of refusals: [[scenario]] is line 4, [estimator.ekf] line 8.
inline std::string small_study(const std::string& more = "", const std::string& head = "seed = 7") {
  return "name = \"small\"\nruns = 3\n" + head + "\n[[scenario]]\nfile = \"" + kPointMass +
         "\"\nset = [\"run.duration_s=0.5\"]\n\n[estimator.ekf]\n[estimator.few]\nalgorithm = \"pf\"\n"
         "set = [\"tuning.matched.pf_particles=50\"]\n" +
         more;
}

inline Study read_small(const TemporaryFolder& folder, const std::string& toml) {
  return load_study_file(folder.write("study.toml", toml), require_playable);
}

}  // namespace slipstream
