// The house's one-way arrows, read from the #include lines of every source file.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace slipstream {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>>& arrows() {
  static const std::map<std::string, std::set<std::string>> allowed{
      {"common", {}},
      {"models", {"common"}},
      {"plant", {"common", "models"}},
      {"estimators", {"common", "models"}},
      {"monitor", {"common", "models"}},
      {"io", {"common", "models"}},
      {"studies", {"common", "models", "plant", "estimators", "monitor"}},
      {"reproduce", {"common", "models", "plant", "estimators", "monitor", "studies"}},
  };
  return allowed;
}

// What comes from outside and is named in one place only: the start of the header's name -> who may include it. An owner that
// ends in '/' is a room. A header may have a line for each of several owners.
struct Outsider {
  std::string header;  // regular expression for the whole of its name
  std::string owner;
};
const std::vector<Outsider>& outsiders() {
  static const std::vector<Outsider> all{
      {"(cvode|cvodes|arkode|ida|idas|kinsol|sundials|nvector|sunlinsol|sunmatrix|sunnonlinsol)/.*",
       "plant/cvode_integrator.cpp"},
      {"(coin/|coin-or/)?Ip[A-Z].*\\.hpp", "estimators/ipopt_solver.cpp"},
      {"pagmo/.*", "estimators/identification/particle_swarm.cpp"},
      {"GeographicLib/.*", "common/geodesy.cpp"},
      {"lcm/.*", "io/"},
      {"slipstream/.*", "io/"},  // generated from lcmtypes
      {"toml\\+\\+/.*|toml\\.hpp", "io/toml_reader.cpp"},
      {"CLI/.*", "io/command_line.cpp"},
      {"csv\\.h", "io/csv.cpp"},
      {"nlohmann/.*", "monitor/json_files.cpp"},
      {"nlohmann/.*", "reproduce/files.cpp"},
      {"nlohmann/.*", "studies/json_lines.cpp"},
      {"mpi\\.h", "studies/mpi/main.cpp"},
  };
  return all;
}

std::string room_of(const std::string& path) { return path.substr(0, path.find('/')); }
// Benchmarks lie beside the code and may compare it with anything; no program contains them.
bool is_benchmark(const std::string& path) { return path.ends_with("_benchmark.cpp"); }
bool is_main(const std::string& path) { return fs::path(path).filename() == "main.cpp"; }

// The header that a line includes, empty if it includes none.
std::string included(const std::string& line) {
  static const std::regex include(R"re(\s*#\s*include\s*[<"]([^">]*)[">].*)re");
  std::smatch match;
  return std::regex_match(line, match, include) ? match[1].str() : "";
}

// What is wrong with `file` including `header`; empty if nothing.
std::string verdict(const std::string& file, const std::string& header) {
  const std::string room = room_of(file);
  std::string owners;
  bool owned = false;
  for (const Outsider& o : outsiders()) {
    if (!std::regex_match(header, std::regex(o.header))) continue;
    owners += " " + o.owner;
    owned = owned || (o.owner.back() == '/' ? file.rfind(o.owner, 0) == 0 : file == o.owner);
  }
  if (!owners.empty() && !owned) return file + " includes " + header + ", which only these may:" + owners;
  const std::string target = room_of(header);
  if (header.find("..") != std::string::npos) return file + " includes " + header + " by a relative path";
  if (target == header || (!arrows().contains(target) && target != "tests")) return "";  // from outside the house
  if (target == room || arrows().at(room).contains(target)) return "";
  const bool speaks_to_io =
      room == "plant" || room == "estimators" || room == "monitor" || room == "studies" || room == "reproduce";
  if (target == "io" && speaks_to_io && is_main(file)) return "";
  return file + " includes " + header + ": no arrow from " + room + " to " + target;
}

void for_each_include(const std::function<void(const std::string& file, const std::string& header)>& visit) {
  const fs::path root = SLIPSTREAM_SOURCE_DIR;
  static const std::set<std::string> kinds{".cpp", ".hpp", ".h", ".cc", ".cxx", ".hh", ".inc", ".ipp"};
  for (const auto& [room, targets] : arrows()) {
    ASSERT_TRUE(fs::is_directory(root / room)) << room;
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      if (!entry.is_regular_file() || !kinds.contains(entry.path().extension().string())) continue;
      const std::string file = fs::relative(entry.path(), root).generic_string();
      if (is_benchmark(file)) continue;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);)
        if (const std::string header = included(line); !header.empty()) visit(file, header);
    }
  }
}

TEST(Rooms, EveryIncludeFollowsAnArrow) {
  std::map<std::string, int> seen;
  for_each_include([&](const std::string& file, const std::string& header) {
    ++seen[room_of(file)];
    EXPECT_EQ(verdict(file, header), "");
  });
  for (const auto& [room, targets] : arrows()) EXPECT_GT(seen[room], 0) << room << ": nothing was read";
}

// A renamed owner would make its rule empty.
TEST(Rooms, EveryOutsiderIsMetWhereItsRuleSays) {
  for (const Outsider& o : outsiders()) {
    bool met = false;
    for_each_include([&](const std::string& file, const std::string& header) {
      met = met || (file.rfind(o.owner, 0) == 0 && std::regex_match(header, std::regex(o.header)));
    });
    EXPECT_TRUE(met) << o.owner << " includes no " << o.header;
  }
}

TEST(Rooms, WhatIsForbiddenIsFound) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"common/types.hpp", "models/vehicle.hpp"},
      {"models/process.hpp", "plant/drive_source.hpp"},
      {"models/vehicle.hpp", "io/bus.hpp"},
      {"plant/conductor.cpp", "estimators/ekf.hpp"},
      {"plant/main.cpp", "estimators/ekf.hpp"},
      {"estimators/ekf.cpp", "plant/drive_source.hpp"},
      {"estimators/main.cpp", "plant/conductor.hpp"},
      {"monitor/scores.cpp", "plant/drive_source.hpp"},
      {"monitor/main.cpp", "estimators/ekf.hpp"},
      {"monitor/bound.cpp", "estimators/kalman.hpp"},
      {"plant/conductor.cpp", "io/bus.hpp"},
      {"monitor/session.cpp", "io/log_writer.hpp"},
      {"io/bus.cpp", "plant/conductor.hpp"},
      {"common/main.cpp", "io/bus.hpp"},
      {"models/vehicle.hpp", "tests/common/fake.hpp"},
      {"plant/vehicle_simulation.hpp", "cvode/cvode.h"},
      {"plant/main.cpp", "sunlinsol/sunlinsol_dense.h"},
      {"estimators/mhe.cpp", "IpTNLP.hpp"},
      {"estimators/mhe.cpp", "coin/IpTNLP.hpp"},
      {"estimators/identification/stand.cpp", "pagmo/problem.hpp"},
      {"estimators/identification/stand.cpp", "plant/drive_source.hpp"},
      {"plant/main.cpp", "lcm/lcm-cpp.hpp"},
      {"monitor/main.cpp", "slipstream/truth.hpp"},
      {"io/scenario_reader.cpp", "toml++/toml.h"},
      {"plant/main.cpp", "CLI/CLI.hpp"},
      {"monitor/report.cpp", "nlohmann/json.hpp"},
      {"io/recorded_files.cpp", "csv.h"},
      {"models/vehicle.hpp", "../plant/conductor.hpp"},
      {"reproduce/snow.cpp", "io/scenario_reader.hpp"},
      {"plant/main.cpp", "studies/play.hpp"},
  };
  for (const auto& [file, header] : wrong) EXPECT_NE(verdict(file, header), "") << file << " " << header;
  const std::vector<std::pair<std::string, std::string>> right{
      {"common/dual.hpp", "common/lanes.hpp"},    {"common/types.hpp", "Eigen/Core"},
      {"models/vehicle.hpp", "common/types.hpp"}, {"plant/main.cpp", "io/bus.hpp"},
      {"monitor/main.cpp", "io/bus.hpp"},         {"estimators/main.cpp", "io/bus.hpp"},
      {"io/bus.cpp", "lcm/lcm-cpp.hpp"},          {"io/bus.cpp", "slipstream/tick.hpp"},
      {"plant/conductor.cpp", "fmt/format.h"},    {"monitor/gnuplot.cpp", "vector"},
  };
  for (const auto& [file, header] : right) EXPECT_EQ(verdict(file, header), "");
}

TEST(Rooms, IncludeLinesAreRecognised) {
  EXPECT_EQ(included("#include \"common/dual.hpp\""), "common/dual.hpp");
  EXPECT_EQ(included("#include <vector>  // why"), "vector");
  EXPECT_EQ(included("  #  include\t<lcm/lcm-cpp.hpp>"), "lcm/lcm-cpp.hpp");
  EXPECT_EQ(included("// #include <vector>"), "");
  EXPECT_EQ(included("#pragma once"), "");
}

}  // namespace
}  // namespace slipstream
