// A bench of its own for one test: a port that nobody else uses, a folder that goes away, and the programs on that port.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/io/temporary_folder.hpp"
#include "tests/system/process.hpp"

namespace slipstream::test {

using Arguments = std::vector<std::string>;

inline const std::string kUnimog = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/unimog.toml";

inline Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Benches are kept apart by port: LCM hears other groups on the same port. ctest runs every test as a process of its own, so
// the process id spreads them; a port on which somebody listens is passed over.
inline int free_port() {
  static int offset = 0;
  for (;; ++offset) {
    const int port = 21000 + (static_cast<int>(getpid() % 2900) * 4 + offset) % 11600;  // below the ephemeral ports
    const int probe = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool is_free = bind(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(probe);
    if (!is_free) continue;
    ++offset;
    return port;
  }
}

class Bench {
 public:
  Bench() : port(free_port()), url("udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0") {
    std::filesystem::create_directory(folder.path("work"));
    std::filesystem::create_directory(folder.path("said"));
  }

  // Any command, in the folder work/.
  Process run(const Arguments& command) {
    return Process(command, folder.path("said/" + std::to_string(started_++)), folder.path("work"));
  }
  Process plant(const Arguments& more) { return run(Arguments{program("plant"), "--lcm-url", url} + more); }
  Process estimator(const Arguments& more) { return run(Arguments{program("estimator"), "--lcm-url", url} + more); }
  Process monitor(const std::string& out = "out") {
    return run({program("monitor"), "--lcm-url", url, "--out", folder.path(out)});
  }
  Process from_log(const std::string& log, const Arguments& more) {
    return run(Arguments{program("estimator"), "--lcm-url", "file://" + log + "?speed=0"} + more);
  }

  static std::string program(const std::string& name) { return std::string(SLIPSTREAM_BIN_DIR) + "/slipstream-" + name; }
  std::string path(const std::string& name) const { return folder.path(name); }
  nlohmann::json scores(const std::string& out = "out") const {
    return nlohmann::json::parse(text_of(path(out + "/scores.json")), nullptr, false);
  }

  const TemporaryFolder folder;
  const int port;
  const std::string url;

 private:
  int started_ = 0;
};

// The exit code must be 0; else what the program said is shown.
inline void expect_success(Process& p) { EXPECT_EQ(p.wait(), 0) << p.out() << p.err(); }

// A short run of the Unimog in lockstep, with both estimators and a monitor.
inline const Arguments kShort{kUnimog, "--set", "run.duration_s=3"};
inline void play_short(Bench& bench, const Arguments& more = {}, const std::string& out = "out") {
  Process plant = bench.plant(kShort + more), monitor = bench.monitor(out), ekf = bench.estimator({"--once"}),
          mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  for (Process* p : {&plant, &ekf, &mhe, &monitor}) expect_success(*p);
}

// Takes out what depends on the wall clock.
inline nlohmann::json without_times(nlohmann::json scores) {
  scores["run"].erase("times");
  for (auto& [name, estimator] : scores["estimators"].items()) {
    estimator.erase("step_time_us");
    estimator.erase("deadline_misses");
  }
  return scores;
}
// series.csv without its columns *.step_time_us.
inline std::string without_times(const std::string& csv) {
  const auto cells = [](const std::string& line) {
    std::vector<std::string> result;
    std::istringstream in(line + ",");
    for (std::string cell; std::getline(in, cell, ',');) result.push_back(cell);
    return result;
  };
  std::istringstream in(csv);
  std::string line, result;
  std::vector<std::string> header;
  while (std::getline(in, line)) {
    const std::vector<std::string> row = cells(line);
    if (header.empty()) header = row;
    for (std::size_t i = 0; i < row.size(); ++i)
      if (i < header.size() && !header[i].ends_with(".step_time_us")) result += row[i] + ",";
    result += "\n";
  }
  return result;
}

}  // namespace slipstream::test
