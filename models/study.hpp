// Everything that a study file says, as plain data: scenarios x grid x runs, followed by the same estimators. io/study_reader
// fills it from TOML.
//
// A case is one scenario at one point of the grid, the last axis turning fastest; an item is one run of one case:
//   item = case * runs + run,   0 <= run < runs
// All estimators of an item follow the same drive, and a run has the same seed in every case: common random numbers. The seed
// is a hash of the root seed and the run's index, so nothing depends on who computes an item, or when:
//   seed(run) = first 53 bits of the stream (root seed, run, "study.run")                              (common/random.hpp)
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/random.hpp"
#include "models/scenario.hpp"

namespace slipstream {

struct StudyScenario {
  std::string name;  // unique in the study
  std::string toml;  // what its files and its `set` say, in one text without a base; defaults are not filled in
};

struct StudyEstimator {
  std::string name;  // unique in the study
  std::string algorithm;
  std::string tuning;            // empty: the scenario's choice
  std::vector<std::string> set;  // "tuning.matched.pf_particles=300": what only this estimator believes
};

// A key of the scenarios and its values, as TOML prints them.
struct StudyAxis {
  std::string key;
  std::vector<std::string> values;
};

struct StudyPair {
  std::string estimator, against;
};

struct StudyCase {
  std::size_t scenario = 0;         // of Study::scenarios
  std::vector<std::string> values;  // one per axis
  Scenario drive;
  std::vector<Scenario> beliefs;  // one per estimator: the drive's scenario with its `set`
};

struct Study {
  std::string name;
  std::string description;
  int runs = 100;
  std::uint64_t seed = 1;
  std::vector<std::string> states;  // that are scored; empty: every state of an estimator that has a truth
  bool series = false;              // keep what every sample shows, not only sums over a run
  std::vector<StudyScenario> scenarios;
  std::vector<StudyEstimator> estimators;
  std::vector<StudyAxis> grid;
  std::vector<StudyPair> pairs;  // to be compared
  std::vector<StudyCase> cases;
  std::string resolved_toml;  // reads back to the same study where each scenario lies as scenarios/NAME.toml beside it
  // A hash of everything above and of how this processor computes (common/arithmetic.hpp): two studies that differ in anything,
  // or whose results would differ in a bit, have different keys.
  std::string key;

  std::size_t items() const { return cases.size() * static_cast<std::size_t>(runs); }
  const StudyCase& case_of(std::size_t item) const { return cases[item / static_cast<std::size_t>(runs)]; }
  int run_of(std::size_t item) const { return static_cast<int>(item % static_cast<std::size_t>(runs)); }
  std::uint64_t seed_of(int run) const { return RandomStream(seed, static_cast<std::uint64_t>(run), "study.run").bits() >> 11; }
};

}  // namespace slipstream
