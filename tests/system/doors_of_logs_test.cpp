// Refusals about logs and results, word for word.
#include <gtest/gtest.h>

#include <regex>

#include "tests/system/doors.hpp"

namespace slipstream::test {
namespace {

std::string url_of(const std::string& log) { return "file://" + log + "?speed=0"; }

TEST(Doors, Logs) {
  Bench bench;
  play_short(bench, {"--set", "run.duration_s=0.5"});
  const std::string log = bench.path("out/run.lcm"), out = bench.path("new.lcm"), missing = bench.path("none.lcm");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(missing), "--out", out},
                 missing + ": cannot read the log: No such file or directory");
  expect_refused(bench, "monitor", {"--lcm-url", url_of(missing), "--out", bench.path("scored")},
                 missing + ": cannot read the log: No such file or directory");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(bench.path("work"))},
                 bench.path("work") + ": cannot read the log: Is a directory");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(log), "--out", log},
                 "--out: '" + log + "' is the log that is being read");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(log), "--out", bench.path("none/new.lcm")},
                 bench.path("none/new.lcm") + ": cannot write the log");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(log), "--out", out, "--tuning", "best"},
                 "unknown tuning 'best'; scenario 'unimog' has: document, matched");

  const std::string empty = bench.folder.write("empty.lcm", "");
  expect_refused(bench, "estimator", {"--lcm-url", url_of(empty), "--out", out},
                 url_of(empty) + ": the log has no run descriptor; nothing to estimate");
  expect_refused(bench, "monitor", {"--lcm-url", url_of(empty), "--out", bench.path("scored")},
                 url_of(empty) + ": no run in this log");
  const std::string text = bench.folder.write("text.lcm", std::string(1000, 'x'));
  expect_refused(bench, "estimator", {"--lcm-url", url_of(text), "--out", out},
                 text + ": the log is damaged or cut off after byte 0 of 1000");
}

TEST(Doors, ALogCutOffInTheMiddle) {
  Bench bench;
  play_short(bench, {"--set", "run.duration_s=0.5"});
  const std::string cut = bench.path("cut.lcm");
  std::filesystem::copy_file(bench.path("out/run.lcm"), cut);
  auto size = std::filesystem::file_size(cut) * 6 / 10;
  if (text_of(cut).compare(size, 4, "\xED\xA1\xDA\x01") == 0) ++size;  // between two events: into the next
  std::filesystem::resize_file(cut, size);
  const std::string said =
      refused_line(bench, {Bench::program("estimator"), "--lcm-url", url_of(cut), "--out", bench.path("new.lcm")});
  std::smatch found;
  ASSERT_TRUE(std::regex_match(
      said, found, std::regex("slipstream-estimator: (.*): the log is damaged or cut off after byte (\\d+) of (\\d+)\n")))
      << said;
  EXPECT_EQ(found[1], cut);
  EXPECT_EQ(found[3], std::to_string(size));
  // The last whole event ends before the cut, and no event of half a second's run is longer than its scenario.
  EXPECT_LE(std::stoul(found[2]), size);
  EXPECT_GT(std::stoul(found[2]), size - 8192);

  // The monitor scores what there is, in whole files that say that the run is not complete.
  Process monitor = bench.run({Bench::program("monitor"), "--lcm-url", url_of(cut), "--out", bench.path("scored")});
  EXPECT_EQ(monitor.wait(), 1);
  EXPECT_EQ(monitor.err(), "slipstream-monitor:" + said.substr(said.find(' ')));
  EXPECT_EQ(bench.scores("scored")["run"]["complete"], false);
}

TEST(Doors, TheMonitorsFolder) {
  Bench bench;
  const std::string file = bench.folder.write("file", "");
  expect_refused(bench, "monitor", {"--lcm-url", bench.url, "--out", file}, "--out: '" + file + "' is not a folder");
  expect_refused(bench, "monitor", {"--lcm-url", bench.url, "--out", file + "/results"},
                 "--out: '" + file + "' is not a folder");
  expect_refused(bench, "monitor", {"--lcm-url", bench.url, "--out", ""}, "--out: found '', expected a folder");
}

}  // namespace
}  // namespace slipstream::test
