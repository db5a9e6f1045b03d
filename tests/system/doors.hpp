// How a program refuses: one line on stderr, exit code 1, nothing on stdout, nothing written.
#pragma once

#include "tests/system/bench.hpp"

namespace slipstream::test {

// The names of all files and folders of the bench, but for what the programs said.
inline std::vector<std::string> files_of(const Bench& bench) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(bench.folder.path()))
    if (const std::string path = entry.path().string(); path.find("/said/") == std::string::npos) files.push_back(path);
  std::sort(files.begin(), files.end());
  return files;
}

// The command's own line on stderr, after it was refused.
inline std::string refused_line(Bench& bench, const Arguments& command) {
  const std::vector<std::string> before = files_of(bench);
  Process p = bench.run(command);
  EXPECT_EQ(p.wait(), 1) << p.out() << p.err();
  EXPECT_EQ(files_of(bench), before) << "something was written";
  const std::string line = p.err();
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
  return line;
}

inline void expect_refused(Bench& bench, const std::string& program, const Arguments& arguments, const std::string& line) {
  EXPECT_EQ(refused_line(bench, Arguments{Bench::program(program)} + arguments), "slipstream-" + program + ": " + line + "\n");
}

}  // namespace slipstream::test
