// One item of a study, played: a drive, every estimator on it, and the sums of what they got wrong.
#pragma once

#include "models/study.hpp"
#include "studies/run_line.hpp"

namespace slipstream {

// Throws what a vehicle or an estimator throws.
RunLine run_item(const Study& study, std::size_t item);

// Constructs drive and estimator: refuses what does not go together, and a scored state that the estimator or the truth lacks.
// A StudyCheck of io/study_reader.hpp.
void require_playable(const Study& study, const StudyCase& one, std::size_t estimator);

}  // namespace slipstream
