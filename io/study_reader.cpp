#include "io/study_reader.hpp"

#include <algorithm>
#include <filesystem>

#include "common/arithmetic.hpp"
#include "common/refusal.hpp"
#include "io/bus.hpp"
#include "io/scenario_reader.hpp"
#include "io/suggest.hpp"
#include "io/text_file.hpp"
#include "io/toml_reader.hpp"
#include "io/toml_text.hpp"

namespace slipstream {
namespace {

constexpr std::int64_t kMostRuns = 10'000'000;
constexpr std::int64_t kLargestSeed = std::int64_t{1} << 53;
constexpr std::size_t kMostPoints = 10'000;

const TextForm kName{is_valid_name, "a name of 1 to 32 characters A-Z a-z 0-9 _ -"};
const TextForm kAnyText{[](const std::string&) { return true; }, "text"};
const TextForm kFile{[](const std::string& s) { return !s.empty(); }, "a scenario file"};
const TextForm kAssignment{[](const std::string& s) { return s.find('=') != std::string::npos && s.front() != '='; },
                           "an assignment like \"run.duration_s=3\""};

std::string key_of(const std::string& assignment) {
  const std::string key = assignment.substr(0, assignment.find('='));
  return key.substr(0, key.find_last_not_of(" \t") + 1);
}
std::vector<std::string> keys_of(const std::vector<std::string>& set) {
  std::vector<std::string> keys;
  for (const std::string& text : set) keys.push_back(key_of(text));
  return keys;
}
bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}
// What belongs to the estimators alone: the drive does not read it.
bool is_belief(const std::string& key) { return key.starts_with("estimator.") || key.starts_with("tuning."); }

const std::string kSeedOfRun = "the seed of each run is the study's: a hash of its `seed` and the run's index";

// Where things stand in the file, for refusals of what only shows when everything is put together.
struct Places {
  std::vector<std::string> scenario, estimator;
  std::string states;
};

struct Sources {
  std::vector<std::string> file;  // of each scenario
  std::vector<std::vector<std::string>> set;
};

// The scenario with these overrides, from wherever it comes.
using Load = std::function<LoadedScenario(std::size_t scenario, const std::vector<std::string>& overrides)>;

void read_scenarios(TomlTable& root, Study& study, Sources& sources, Places& places) {
  root.tables("scenario", [&](TomlTable& t) {
    t.only({"file", "name", "set"});
    t.require("file");
    places.scenario.push_back(t.where("file"));
    StudyScenario scenario;
    std::string file;
    std::vector<std::string> set;
    t.text("name", scenario.name, kName);
    if (t.has("file")) t.text("file", file, kFile);
    t.texts("set", set, kAssignment);
    for (const std::string& key : keys_of(set))
      if (key == "run.seed") t.refuse("set", kSeedOfRun);
    study.scenarios.push_back(scenario);
    sources.file.push_back(file);
    sources.set.push_back(set);
  });
  if (study.scenarios.empty()) root.refuse("scenario", "expected at least one table [[scenario]]");
}

void read_estimators(TomlTable& root, Study& study, Places& places) {
  const std::vector<std::string> names = root.keys_of("estimator");
  if (names.empty()) root.refuse("estimator", "expected at least one table [estimator.NAME]");
  root.table("estimator", [&](TomlTable& all) {
    for (const std::string& name : names) {
      if (!kName.accepts(name)) all.refuse(name, std::string("expected ") + kName.expected);
      places.estimator.push_back(all.where(name));
      all.table(name, [&](TomlTable& t) {
        t.only({"algorithm", "tuning", "set"});
        StudyEstimator e{name, name, "", {}};
        t.text("algorithm", e.algorithm, kName);
        t.text("tuning", e.tuning, kName);
        t.texts("set", e.set, kAssignment);
        for (const std::string& key : keys_of(e.set))
          if (!is_belief(key))
            t.refuse("set", "'" + printable(key) + "' is not the estimator's alone: expected keys in estimator. or tuning.");
        study.estimators.push_back(e);
      });
    }
  });
}

void read_grid(TomlTable& root, Study& study, const Sources& sources) {
  if (!root.has("grid")) return;
  TomlTable::Lists lists;
  root.lists("grid", lists);
  if (lists.empty()) root.refuse("grid", "an empty grid; expected keys of the scenarios with lists of values, or no [grid]");
  std::size_t points = 1;
  for (auto& [key, values] : lists) {
    const auto set_by = [&](const std::vector<std::string>& set, const std::string& who) {
      if (contains(keys_of(set), key)) root.refuse("grid", "'" + printable(key) + "' is also set by " + who);
    };
    if (key == "run.seed") root.refuse("grid", kSeedOfRun);
    for (const auto& set : sources.set) set_by(set, "[[scenario]]");
    for (const StudyEstimator& e : study.estimators) set_by(e.set, "[estimator." + e.name + "]");
    points *= values.size();
    if (points > kMostPoints) root.refuse("grid", "expected at most " + std::to_string(kMostPoints) + " points");
    study.grid.push_back({key, values});
  }
}

void read_pairs(TomlTable& root, Study& study) {
  std::vector<std::string> names;
  for (const StudyEstimator& e : study.estimators) names.push_back(e.name);
  root.tables("compare", [&](TomlTable& t) {
    t.only({"estimator", "against"});
    StudyPair pair;
    for (const auto& [key, field] : {std::pair{"estimator", &pair.estimator}, std::pair{"against", &pair.against}}) {
      t.require(key);
      if (!t.has(key)) continue;
      t.text(key, *field, kAnyText);
      if (!contains(names, *field)) t.refuse(key, "unknown estimator '" + printable(*field) + "'" + suggestion(*field, names));
    }
    if (!pair.estimator.empty() && pair.estimator == pair.against)
      t.refuse("against", "an estimator is not compared with itself");
    study.pairs.push_back(pair);
  });
  if (!study.pairs.empty()) return;
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = i + 1; j < names.size(); ++j) study.pairs.push_back({names[i], names[j]});
}

std::string list_text(const std::vector<std::string>& items) { return bracketed(joined(items, toml_text)); }

// As it reads back beside scenarios/NAME.toml: the reader's own printing names the files that the study was made from.
std::string resolved_text(const Study& s) {
  std::string text = "name = " + toml_text(s.name) + "\ndescription = " + toml_text(s.description) +
                     "\nruns = " + std::to_string(s.runs) + "\nseed = " + std::to_string(s.seed) +
                     "\nstates = " + list_text(s.states) + "\nseries = " + (s.series ? "true" : "false") + "\n";
  for (const StudyScenario& one : s.scenarios)
    text += "\n[[scenario]]\nname = " + toml_text(one.name) + "\nfile = " + toml_text("scenarios/" + one.name + ".toml") + "\n";
  for (const StudyEstimator& e : s.estimators)
    text += "\n[estimator." + e.name + "]\nalgorithm = " + toml_text(e.algorithm) +
            (e.tuning.empty() ? "" : "\ntuning = " + toml_text(e.tuning)) + "\nset = " + list_text(e.set) + "\n";
  if (!s.grid.empty()) text += "\n[grid]\n";
  for (const StudyAxis& axis : s.grid)
    text += toml_text(axis.key) + " = " + bracketed(joined(axis.values, [](const std::string& v) { return v; })) + "\n";
  for (const StudyPair& pair : s.pairs)
    text += "\n[[compare]]\nestimator = " + toml_text(pair.estimator) + "\nagainst = " + toml_text(pair.against) + "\n";
  return text;
}

// One refusal of many overrides: those of the study say so.
LoadedScenario load_told(const Load& load, std::size_t scenario, const std::vector<std::string>& overrides,
                         const std::string& place) {
  try {
    return load(scenario, overrides);
  } catch (const Refusal& refusal) {
    const std::string line = refusal.what();
    throw Refusal(line.starts_with("override '") || line.find("cannot read") != std::string::npos ? place + line : line);
  }
}

void make_cases(Study& study, const Sources& sources, const Places& places, const std::string& source, const Load& load,
                const StudyCheck& check) {
  std::size_t points = 1;
  for (const StudyAxis& axis : study.grid) points *= axis.values.size();
  std::uint64_t hash = hash64(study.resolved_toml);
  for (std::size_t i = 0; i < study.scenarios.size(); ++i) {
    hash = hash64(study.scenarios[i].toml, hash);
    for (std::size_t point = 0; point < points; ++point) {
      StudyCase one{i, {}, {}, {}};
      std::vector<std::string> overrides = sources.set[i];
      std::size_t left = points, at = point;
      for (const StudyAxis& axis : study.grid) {
        left /= axis.values.size();
        one.values.push_back(axis.values[at / left]);
        at %= left;
        overrides.push_back(axis.key + "=" + one.values.back());
      }
      const LoadedScenario drive = load_told(load, i, overrides, source + ": ");
      if (drive.scenario.recorded)
        throw Refusal(places.scenario[i] + "a study simulates; this scenario plays a recorded drive");
      one.drive = drive.scenario;
      for (const StudyEstimator& e : study.estimators) {
        std::vector<std::string> own = overrides;
        own.insert(own.end(), e.set.begin(), e.set.end());
        const LoadedScenario belief =
            e.set.empty() ? drive : load_told(load, i, own, source + ": estimator." + e.name + ".set: ");
        hash = hash64(belief.resolved_toml, hash);
        one.beliefs.push_back(belief.scenario);
      }
      for (std::size_t k = 0; k < study.estimators.size(); ++k) {
        try {
          check(study, one, k);
        } catch (const Refusal& refusal) {
          throw Refusal(places.estimator[k] + refusal.what());
        }
      }
      study.cases.push_back(std::move(one));
    }
  }
  hash = mix64(hash ^ arithmetic_fingerprint());
  char key[20];
  std::snprintf(key, sizeof key, "%016llx", static_cast<unsigned long long>(hash));
  study.key = key;
}

// The scenario's own name, and its text.
using Open = std::function<LoadedScenario(const std::string& file, const std::vector<std::string>& overrides)>;
using Flatten = std::function<std::string(const std::string& file, const std::vector<std::string>& set)>;

Study read_study(const std::string& toml, const std::string& source, const Open& open, const Flatten& flatten,
                 const StudyCheck& check) {
  Study study;
  Sources sources;
  Places places;
  TomlDocument(toml, source).read([&](TomlTable& root) {
    root.only({"name", "description", "runs", "seed", "states", "series", "scenario", "estimator", "grid", "compare"});
    if (!root.has("name")) throw Refusal(source + ": missing key 'name'");
    root.text("name", study.name, kName);
    root.text("description", study.description, kAnyText);
    root.integer("runs", study.runs, 1, kMostRuns);
    root.integer("seed", study.seed, 0, kLargestSeed);
    root.texts("states", study.states, kName);
    root.flag("series", study.series);
    read_scenarios(root, study, sources, places);
    read_estimators(root, study, places);
    read_grid(root, study, sources);
    read_pairs(root, study);
  });
  const Load load = [&](std::size_t i, const std::vector<std::string>& overrides) { return open(sources.file[i], overrides); };
  for (std::size_t i = 0; i < study.scenarios.size(); ++i) {
    StudyScenario& scenario = study.scenarios[i];
    const LoadedScenario loaded = load_told(load, i, sources.set[i], places.scenario[i]);
    if (scenario.name.empty()) scenario.name = loaded.scenario.name;
    for (std::size_t j = 0; j < i; ++j)
      if (study.scenarios[j].name == scenario.name)
        throw Refusal(places.scenario[i] + "two scenarios are called '" + scenario.name + "'; give one of them a `name`");
    if (loaded.scenario.recorded) throw Refusal(places.scenario[i] + "a study simulates; this scenario plays a recorded drive");
    scenario.toml = flatten(sources.file[i], sources.set[i]);
  }
  study.resolved_toml = resolved_text(study);
  make_cases(study, sources, places, source, load, check);
  return study;
}

}  // namespace

Study load_study_file(const std::string& path, const StudyCheck& check) {
  const auto beside = [&](const std::string& file) {
    return (std::filesystem::path(path).parent_path() / file).lexically_normal().string();
  };
  return read_study(
      read_text_file(path), path,
      [&](const std::string& file, const std::vector<std::string>& o) { return load_scenario_file(beside(file), o); },
      [&](const std::string& file, const std::vector<std::string>& o) { return flat_scenario_file(beside(file), o); }, check);
}

Study load_study_text(const std::string& toml, const std::map<std::string, std::string>& scenarios, const std::string& source,
                      const StudyCheck& check) {
  const auto text_of = [&](const std::string& file) -> const std::string& {
    const auto found = scenarios.find(std::filesystem::path(file).stem().string());
    if (found == scenarios.end()) throw Refusal(source + ": no scenario '" + printable(file) + "'");
    return found->second;
  };
  return read_study(
      toml, source,
      [&](const std::string& file, const std::vector<std::string>& o) { return load_scenario_text(text_of(file), file, o); },
      [&](const std::string& file, const std::vector<std::string>&) { return text_of(file); }, check);
}

}  // namespace slipstream
