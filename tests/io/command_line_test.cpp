#include "io/command_line.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "io/suggest.hpp"
#include "tests/io/temporary_folder.hpp"

namespace slipstream {
namespace {

struct Parsed {
  std::string scenario, url = "udpm://", log;
  double speed = 1.5;
  std::vector<std::string> set;
  bool quiet = false;
};

Parsed parse(std::vector<std::string> arguments) {
  Parsed p;
  CommandLine line("bench", "Runs a scenario.");
  line.positional("SCENARIO", p.scenario, "the scenario file", true);
  line.positional("LOG", p.log, "a log file", false);
  line.option("--lcm-url", p.url, "the bus");
  line.option("-s,--speed", p.speed, "pace");
  line.option("--set", p.set, "table.key=value");
  line.flag("--quiet", p.quiet, "say nothing");
  arguments.insert(arguments.begin(), "bench");
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  line.parse(static_cast<int>(argv.size()), argv.data());
  return p;
}

std::string refused(const std::vector<std::string>& arguments) {
  return refusal_of([&] { parse(arguments); });
}

TEST(CommandLine, BindsWhatIsGivenAndKeepsTheRest) {
  const Parsed p = parse({"--set", "run.seed=7", "a.toml", "--speed", "-2.5", "--set=run.clock=free", "--quiet"});
  EXPECT_EQ(p.scenario, "a.toml");
  EXPECT_EQ(p.log, "");
  EXPECT_EQ(p.url, "udpm://");
  EXPECT_EQ(p.speed, -2.5);
  EXPECT_EQ(p.set, (std::vector<std::string>{"run.seed=7", "run.clock=free"}));
  EXPECT_TRUE(p.quiet);
  EXPECT_EQ(parse({"a.toml", "b.lcm", "-s", "3"}).log, "b.lcm");
}

TEST(CommandLine, RefusesWrongUsageInOneLine) {
  EXPECT_EQ(refused({"--sped", "2", "a.toml"}), "unknown option '--sped'; did you mean '--speed'?");
  EXPECT_EQ(refused({"a.toml", "--qiuet=1"}), "unknown option '--qiuet'; did you mean '--quiet'?");
  EXPECT_EQ(refused({"a.toml", "--frobnicate"}), "unknown option '--frobnicate'; see --help");
  EXPECT_EQ(refused({"a", "b", "c"}), "unexpected argument 'c'; see --help");
  EXPECT_EQ(refused({"--sped", "2"}), "unknown option '--sped'; did you mean '--speed'?");
  EXPECT_EQ(refused({}), "missing argument 'SCENARIO'; see --help");
  EXPECT_EQ(refused({"a", "--speed", "fast"}), "--speed: found 'fast', expected a number");
  EXPECT_EQ(refused({"a", "--speed", "nan"}), "--speed: found 'nan', expected a number");
  EXPECT_EQ(refused({"a", "--speed", ""}), "--speed: found '', expected a number");
  EXPECT_EQ(refused({"a", "--set", "--quiet"}), "--set: expected a value, found the option '--quiet'");
  EXPECT_EQ(refused({"a", "--lcm-url"}), "--lcm-url: expected a value; see --help");
  EXPECT_EQ(refused({"a", "--speed", "1", "--speed", "2"}), "--speed: given twice");
}

TEST(CommandLine, HelpNamesEverythingAndExitsWithZero) {
  // What a death test compares is stderr.
  const auto help_on_stderr = [] {
    dup2(STDERR_FILENO, STDOUT_FILENO);
    parse({"--help"});
  };
  const char* const everything =
      "Runs a scenario.*Usage: bench .OPTIONS. SCENARIO .LOG..*--lcm-url.*udpm.*--speed.*1.5.*--set.*--quiet";
  EXPECT_EXIT(help_on_stderr(), testing::ExitedWithCode(0), everything);
}

TEST(CommandLine, RunMainTurnsExceptionsIntoOneLine) {
  const auto stderr_of = [](const std::function<int()>& body, int code) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(run_main("bench", body), code);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(stderr_of([] { return 3; }, 3), "");
  EXPECT_EQ(stderr_of([]() -> int { throw Refusal("a.toml:1:2: wrong"); }, 1), "bench: a.toml:1:2: wrong\n");
  EXPECT_EQ(stderr_of([]() -> int { throw std::runtime_error("out of\nluck\n"); }, 1), "bench: internal error: out of luck\n");
}

TEST(Suggest, DistanceCountsSlipsAndSwaps) {
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);  // Wagner and Fischer's textbook pair
  EXPECT_EQ(edit_distance("sede", "seed"), 1u);
}

TEST(Suggest, OffersOnlyNearWords) {
  EXPECT_EQ(nearest("nois_percent", {"rate_hz", "noise_percent"}), "noise_percent");
  EXPECT_EQ(nearest("w", {"v"}), std::nullopt);
  EXPECT_EQ(nearest("", {"v"}), std::nullopt);
  EXPECT_EQ(suggestion("zzz", {"lower", "upper"}), "; expected one of lower, upper");
  EXPECT_EQ(suggestion("zzz", {}), "");
}

}  // namespace
}  // namespace slipstream
