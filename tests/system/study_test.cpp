// slipstream-study as a user meets it: refusals, a whole study, sudden ends, shards, and what becomes of the folder.
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <regex>

#include "tests/system/doors.hpp"
#include "tests/system/studies.hpp"

namespace slipstream::test {
namespace {

TEST(Study, Refusals) {
  Bench bench;
  const std::string study = write_study(bench, 3), nowhere = bench.path("nowhere");
  struct {
    Arguments arguments;
    std::string line;
  } const doors[] = {
      {{}, "missing argument 'STUDY'; see --help"},
      {{nowhere}, nowhere + ": cannot read: No such file or directory"},
      {{study, "--jobs", "-1"}, "--jobs: found -1, expected a whole number from 1 to 1024"},
      {{study, "--jobs", "1.5"}, "--jobs: found 1.5, expected a whole number from 1 to 1024"},
      {{study, "--shard", "0/3"}, "--shard: found '0/3', expected K/N with K from 1 to N, like 2/3"},
      {{study, "--shard", "4/3"}, "--shard: found '4/3', expected K/N with K from 1 to N, like 2/3"},
      {{study, "--shard", "2"}, "--shard: found '2', expected K/N with K from 1 to N, like 2/3"},
      {{study, "--out", "/proc/nowhere"}, "--out: cannot make the folder /proc/nowhere/scenarios: No such file or directory"},
      {{study, "--sahrd", "1/2"}, "unknown option '--sahrd'; did you mean '--shard'?"},
      {{"merge"}, "merge: missing argument 'DIR|FILE'; see --help"},
      {{"merge", bench.path("work")}, "merge: missing option '--out'; see --help"},
      {{"merge", bench.path("work"), "--out", nowhere}, bench.path("work") + ": no runs*.jsonl in this folder"},
      {{"merge", nowhere, "--out", bench.path("m")}, nowhere + ": there is no study.toml beside it that says of what"},
  };
  for (const auto& door : doors) expect_refused(bench, "study", door.arguments, door.line);
  // Of the file itself tests/studies/study_reader_test.cpp has every refusal; three as they reach the terminal.
  const std::string empty = write_study(bench, 3, "[grid]\n");
  expect_refused(bench, "study", {empty},
                 empty + ":8:1: grid: an empty grid; expected keys of the scenarios with lists of values, or no [grid]");
  const std::string unknown = write_study(bench, 3, "[estimator.ekff]\ntuning = \"matched\"\n");
  EXPECT_EQ(refused_line(bench, {Bench::program("study"), unknown}).substr(0, unknown.size() + 64),
            "slipstream-study: " + unknown + ":8:1: estimator.ekff: unknown algorithm 'ekff'");
}

TEST(Study, LeavesItsRunsItsResultsAndItself) {
  Bench bench;
  const std::string file = write_study(bench, 20, "[estimator.pf]\nset = [\"tuning.matched.pf_particles=50\"]\n");
  Process p = bench.run({Bench::program("study"), file, "--out", bench.path("out")});
  expect_success(p);
  EXPECT_TRUE(p.said("small: 1 case x 20 runs, ekf, pf; into " + bench.path("out"))) << p.out();
  EXPECT_TRUE(p.said("results are in " + bench.path("out/results.json")));
  const nlohmann::json results = nlohmann::json::parse(text_of(bench.path("out/results.json")), nullptr, false);
  ASSERT_TRUE(results.is_object());
  EXPECT_EQ(results["runs"], 20);
  EXPECT_TRUE(results["missing"].empty());
  ASSERT_EQ(results["cases"].size(), 1U);
  for (const char* name : {"ekf", "pf"}) {
    const nlohmann::json& e = results["cases"][0]["estimators"][name];
    EXPECT_GT(e["eta"], 0.0);
    EXPECT_EQ(e["steps"], 20 * 21);
    EXPECT_EQ(e["invalid"], 0);
    EXPECT_EQ(e["states"]["east_m"]["samples"], 20 * 21);
  }
  const std::string runs = text_of(bench.path("out/runs.jsonl"));
  EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), 20);

  // The same call has nothing to do; the folder's own study.toml is the same study.
  const std::string before = results_of(bench, "out");
  for (const std::string& again : {file, bench.path("out/study.toml")}) {
    Process q = bench.run({Bench::program("study"), again, "--out", bench.path("out")});
    expect_success(q);
    EXPECT_TRUE(q.said("20 of 20 are finished already")) << q.out();
    EXPECT_EQ(text_of(bench.path("out/runs.jsonl")), runs);
    EXPECT_EQ(results_of(bench, "out"), before);
  }
}

// A run of the study is an ordinary run: live, over the bus, it scores the same to the bit.
TEST(Study, ARunCanBeSeenLive) {
  Bench bench;
  Process p = bench.run({Bench::program("study"), write_study(bench, 1), "--out", bench.path("out")});
  expect_success(p);
  const nlohmann::json results = nlohmann::json::parse(results_of(bench, "out"), nullptr, false);
  ASSERT_TRUE(results.is_object());
  const nlohmann::json& ekf = results["cases"][0]["estimators"]["ekf"];
  const std::string replay = ekf["worst"]["replay"], prefix = "slipstream-plant scenarios/point_mass.toml --set ";
  ASSERT_EQ(replay.substr(0, prefix.size()), prefix);
  Process plant = bench.plant({bench.path("out/scenarios/point_mass.toml"), "--set", replay.substr(prefix.size()), "--wait-for",
                               "ekf,monitor"}),
          monitor = bench.monitor("live"), estimator = bench.estimator({"--once"});
  for (Process* q : {&plant, &estimator, &monitor}) expect_success(*q);
  const nlohmann::json live = bench.scores("live");
  ASSERT_TRUE(live.is_object());
  for (const char* state : {"east_m", "north_m", "speed_mps", "heading_rad"})
    EXPECT_EQ(ekf["states"][state]["rmse"], live["estimators"]["ekf"]["states"][state]["rmse"]) << state;
}

TEST(Study, KilledTenTimesAndResumedItIsTheSameToTheBit) {
  Bench bench;
  const std::string file = write_study(bench, 600);
  Process whole = bench.run({Bench::program("study"), file, "--out", bench.path("whole")});
  const auto start = std::chrono::steady_clock::now();
  expect_success(whole);
  const double whole_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::mt19937 random(1);
  int killed = 0;
  for (int i = 0; i < 10; ++i) {
    Process p = bench.run({Bench::program("study"), file, "--out", bench.path("out")});
    std::this_thread::sleep_for(
        std::chrono::duration<double>(whole_s * (0.05 + 0.2 * static_cast<double>(random() % 1000) / 1000.0)));
    killed += p.is_running() ? 1 : 0;
    p.kill();
    EXPECT_EQ(survivors(bench.path("out")), "") << "no child outlives its parent";
  }
  EXPECT_GT(killed, 0);
  Process last = bench.run({Bench::program("study"), file, "--out", bench.path("out")});
  expect_success(last);
  EXPECT_EQ(results_of(bench, "out"), results_of(bench, "whole"));
  EXPECT_EQ(sorted_lines(bench.path("out/runs.jsonl")), sorted_lines(bench.path("whole/runs.jsonl")));
}

TEST(Study, ATornLastLineIsToldAndRepeated) {
  Bench bench;
  const std::string file = write_study(bench, 10), runs = bench.path("out/runs.jsonl");
  Process first = bench.run({Bench::program("study"), file, "--out", bench.path("out")});
  expect_success(first);
  const std::string before = results_of(bench, "out");
  std::filesystem::resize_file(runs, std::filesystem::file_size(runs) - 7);
  Process second = bench.run({Bench::program("study"), file, "--out", bench.path("out")});
  expect_success(second);
  EXPECT_TRUE(second.said("slipstream-study: " + runs + ": cut off a torn last line of ")) << second.out();
  EXPECT_TRUE(second.said("9 of 10 are finished already"));
  EXPECT_EQ(results_of(bench, "out"), before);
}

TEST(Study, ShardsMergedAreTheWhole) {
  Bench bench;
  const std::string file = write_study(bench, 20, "[grid]\nvehicle.mass_kg = [1000, 1500]\n"), out = bench.path("merged");
  Process whole = bench.run({Bench::program("study"), file, "--out", bench.path("whole")});
  expect_success(whole);
  for (const char* k : {"1", "2", "3"}) {
    Process p =
        bench.run({Bench::program("study"), file, "--shard", std::string(k) + "/3", "--out", bench.path(std::string("s") + k)});
    expect_success(p);
    EXPECT_TRUE(p.said("merge the shards with: slipstream-study merge DIR... --out DIR"));
    EXPECT_FALSE(std::filesystem::exists(bench.path(std::string("s") + k + "/results.json")));
  }
  expect_refused(bench, "study", {"merge", bench.path("s1"), bench.path("s3"), "--out", out},
                 "13 of 40 runs are missing: items 1, 4, 7, 10, 13 and 8 more; --partial merges what is there");
  // A folder, a file, and one shard twice.
  Process merge = bench.run({Bench::program("study"), "merge", bench.path("s2"), bench.path("s1/runs-1-of-3.jsonl"),
                             bench.path("s3"), bench.path("s3"), "--out", out});
  expect_success(merge);
  EXPECT_EQ(results_of(bench, "merged"), results_of(bench, "whole"));

  // Shards that share a folder, the last of which finds everything there.
  for (const char* k : {"1/3", "3/3", "2/3"}) {
    Process p = bench.run({Bench::program("study"), file, "--shard", k, "--out", bench.path("shared")});
    expect_success(p);
  }
  EXPECT_EQ(results_of(bench, "shared"), results_of(bench, "whole"));

  Process partial = bench.run({Bench::program("study"), "merge", bench.path("s1"), "--partial", "--out", bench.path("part")});
  expect_success(partial);
  EXPECT_EQ(nlohmann::json::parse(results_of(bench, "part"))["missing"].size(), 26U);
}

TEST(Study, MergeRefusesWhatDoesNotBelongTogether) {
  Bench bench;
  const std::string a = write_study(bench, 4), b = write_study(bench, 5);
  for (const auto& [file, out] : {std::pair{a, "a"}, std::pair{b, "b"}}) {
    Process p = bench.run({Bench::program("study"), file, "--out", bench.path(out)});
    expect_success(p);
  }
  const auto head = [&](const char* out) { return text_of(bench.path(std::string(out) + "/study.toml")).substr(0, 24); };
  const std::string a_runs = bench.path("a/runs.jsonl"), b_runs = bench.path("b/runs.jsonl");
  expect_refused(bench, "study", {"merge", bench.path("a"), bench.path("b"), "--out", bench.path("m")},
                 a_runs + " and " + b_runs + " are of different studies, or of processors that compute differently ('" +
                     head("a") + "' and '" + head("b") + "')");
  expect_refused(bench, "study", {b, "--out", bench.path("a")},
                 "--out: " + bench.path("a") + " holds another study (its study.toml says '" + head("a") + "', this one is '" +
                     head("b") + "'); give this one a folder of its own");
  // Two results of one run.
  std::filesystem::copy(bench.path("a"), bench.path("c"), std::filesystem::copy_options::recursive);
  std::string text = text_of(a_runs);
  text.replace(text.find("\"fallback\":0"), 12, "\"fallback\":1");
  std::ofstream(bench.path("c/runs.jsonl")) << text;
  const std::string line =
      refused_line(bench, {Bench::program("study"), "merge", bench.path("a"), bench.path("c"), "--out", bench.path("m")});
  EXPECT_TRUE(std::regex_match(
      line, std::regex("slipstream-study: .*/c/runs.jsonl:[1-4]: item [0-3] differs from .*/a/runs.jsonl:[1-4]: "
                       "one of them was made by another program\n")))
      << line;
  // A study.toml that somebody has edited.
  std::string toml = text_of(bench.path("a/study.toml"));
  toml.replace(toml.find("seed = 7"), 8, "seed = 8");
  std::ofstream(bench.path("a/study.toml")) << toml;
  const std::string edited = refused_line(bench, {Bench::program("study"), "merge", bench.path("a"), "--out", bench.path("m")});
  EXPECT_TRUE(std::regex_match(
      edited, std::regex("slipstream-study: .*/a/study.toml: its first line says '# study [0-9a-f]{16}', but it "
                         "reads as '# study [0-9a-f]{16}': was it changed, or made by another program\\?\n")))
      << edited;
}

TEST(Study, TwoInOneFolder) {
  Bench bench;
  const std::string file = write_study(bench, 100'000), out = bench.path("out");
  Process first = bench.run({Bench::program("study"), file, "--out", out});
  ASSERT_TRUE(begun(out));
  Process second = bench.run({Bench::program("study"), file, "--out", out});
  EXPECT_EQ(second.wait(), 1);
  EXPECT_TRUE(std::regex_match(
      second.err(), std::regex("slipstream-study: " + out + "/runs.jsonl is being written by process [0-9]+ on [^ ]+\n")))
      << second.err();
  EXPECT_TRUE(first.is_running());
  first.kill();
}

TEST(Study, AnInterruptedCallSaysHowToGoOn) {
  Bench bench;
  const std::string file = write_study(bench, 100'000), out = bench.path("out");
  Process p = bench.run({Bench::program("study"), file, "--out", out});
  ASSERT_TRUE(begun(out));
  p.signal(SIGINT);
  EXPECT_EQ(p.wait(), 1);
  std::smatch match;
  const std::string said = p.err();
  ASSERT_TRUE(std::regex_match(
      said, match,
      std::regex("slipstream-study: interrupted with ([0-9]+) of 100000 runs finished; the same call goes on from here\n")))
      << said;
  const std::string runs = text_of(out + "/runs.jsonl");
  EXPECT_EQ(std::to_string(std::count(runs.begin(), runs.end(), '\n')), match[1].str());
  EXPECT_EQ(survivors(out), "");
}

// Somebody, or the system short of memory, ends one of the working processes.
TEST(Study, ARunWhoseProcessEndsIsNamedAndTriedAgain) {
  Bench bench;
  // Runs of milliseconds, so that it is ended within one.
  const std::string file = write_study(bench, 100, "[estimator.pf]\nset = [\"tuning.matched.pf_particles=10000\"]\n"),
                    out = bench.path("out");
  Process p = bench.run({Bench::program("study"), file, "--jobs", "2", "--out", out});
  ASSERT_TRUE(begun(out));
  const std::vector<pid_t> children = children_named("slipstream-study", out);
  ASSERT_EQ(children.size(), 3U);  // with the parent, which is the oldest
  ::kill(*std::max_element(children.begin(), children.end()), SIGKILL);
  EXPECT_EQ(p.wait(), 1);
  EXPECT_TRUE(
      std::regex_search(p.out(), std::regex("slipstream-study: item [0-9]+ failed: its process was ended by signal 9 \\(to see "
                                            "it: slipstream-plant scenarios/point_mass.toml --set run.seed=[0-9]+\\)\n")))
      << p.out();
  EXPECT_EQ(p.err(), "slipstream-study: 1 of 100 runs failed; the same call tries them again\n");
  const nlohmann::json partial = nlohmann::json::parse(results_of(bench, "out"), nullptr, false);
  EXPECT_EQ(partial["missing"].size(), 1U);
  Process again = bench.run({Bench::program("study"), file, "--out", out});
  expect_success(again);
  EXPECT_TRUE(again.said("99 of 100 are finished already"));
  EXPECT_TRUE(nlohmann::json::parse(results_of(bench, "out"))["missing"].empty());
}

TEST(Study, AFullDiskLosesNoRun) {
  Bench bench;
  const std::string file = write_study(bench, 200), disk = bench.path("disk"), out = disk + "/out";
  Process whole = bench.run({Bench::program("study"), file, "--out", bench.path("whole")});
  expect_success(whole);
  std::filesystem::create_directory(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) GTEST_SKIP() << "mounting is not allowed here";
  Process p = bench.run({Bench::program("study"), file, "--out", out});
  EXPECT_EQ(p.wait(), 1);
  EXPECT_EQ(p.err(), "slipstream-study: " + out +
                         "/runs.jsonl: cannot write: No space left on device; the runs before are kept, the same call goes on "
                         "from there\n");
  const std::string kept = text_of(out + "/runs.jsonl");
  const auto lines = std::count(kept.begin(), kept.end(), '\n');
  EXPECT_GT(lines, 0);
  EXPECT_EQ(kept.back(), '\n') << "nothing half-written";
  EXPECT_EQ(::mount("tmpfs", disk.c_str(), "tmpfs", MS_REMOUNT, "size=8m"), 0);
  Process again = bench.run({Bench::program("study"), file, "--out", out});
  expect_success(again);
  EXPECT_TRUE(again.said(std::to_string(lines) + " of 200 are finished already")) << again.out();
  EXPECT_EQ(text_of(out + "/results.json"), results_of(bench, "whole"));
  EXPECT_EQ(::umount(disk.c_str()), 0);
}

// The same where no file system can be mounted: a file that may not grow.
TEST(Study, AFileThatMayNotGrowLosesNoRun) {
  Bench bench;
  const std::string file = write_study(bench, 200), out = bench.path("out");
  const std::string limited = "trap '' XFSZ; ulimit -f 64; exec \"$0\" \"$@\"";  // in blocks of 1024 bytes
  Process p = bench.run({"bash", "-c", limited, Bench::program("study"), file, "--out", out});
  EXPECT_EQ(p.wait(), 1);
  EXPECT_EQ(p.err(),
            "slipstream-study: " + out +
                "/runs.jsonl: cannot write: File too large; the runs before are kept, the same call goes on from there\n");
  const std::string kept = text_of(out + "/runs.jsonl");
  EXPECT_EQ(kept.back(), '\n');
  Process again = bench.run({Bench::program("study"), file, "--out", out});
  expect_success(again);
  EXPECT_TRUE(nlohmann::json::parse(results_of(bench, "out"))["missing"].empty());
}

}  // namespace
}  // namespace slipstream::test
