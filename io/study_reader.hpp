// Study files: TOML to models/study.hpp, strictly. scenarios/studies/pf_against_ukf.toml explains every key.
//
// Every scenario is read at every point of the grid and with every estimator's own `set`, so nothing of a study is refused
// after its first run. Refusals are one line, as io/scenario_reader.hpp has them.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "models/study.hpp"

namespace slipstream {

// Refuses what only the estimators know: algorithm `e` on the case's k-th belief. Called for each estimator of each case.
using StudyCheck = std::function<void(const Study& study, const StudyCase& one, std::size_t estimator)>;

// The scenarios' files are relative to the study's.
Study load_study_file(const std::string& path, const StudyCheck& check);

// A resolved study without a file system: `scenarios` by name. `source` stands for the file in error lines.
Study load_study_text(const std::string& toml, const std::map<std::string, std::string>& scenarios, const std::string& source,
                      const StudyCheck& check);

}  // namespace slipstream
