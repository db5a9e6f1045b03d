// slipstream-reproduce as a user meets it: refusals, the list, a named experiment, an interruption and going on.
#include <gtest/gtest.h>

#include "tests/system/doors.hpp"

namespace slipstream::test {
namespace {

const std::string kScenarios = std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios";
const Arguments kThere{"--scenarios", kScenarios};

Process reproduce(Bench& bench, const Arguments& more) {
  return bench.run(Arguments{Bench::program("reproduce")} + kThere + more);
}

TEST(Reproduce, Refusals) {
  Bench bench;
  struct {
    Arguments arguments;
    const char* line;
  } const doors[] = {
      {{"drivetrian"},
       "no experiment 'drivetrian'; did you mean 'drivetrain'?; --list names them with their figures and tables"},
      {{"tyre", "--data", "nowhere"}, "--data: no such folder: nowhere"},
      {{"tyre", "--scenarios", "nowhere"}, "--scenarios: given twice"},
      // Document 002 has no Fig. 14: a name without a document is one of 002's.
      {{"fig_14"}, "no experiment 'fig_14'; did you mean '001_fig_14'?; --list names them with their figures and tables"},
      {{"001_fig_4"}, "no experiment '001_fig_4'; --list names them with their figures and tables"},
      {{"tyre", "--seeds", "-1"}, "--seeds: found -1, expected a whole number from 0 to 10000"},
      {{"tyre", "--seeds", "2.5"}, "--seeds: found 2.5, expected a whole number from 0 to 10000"},
      {{"tyre", "--jobs", "-1"}, "--jobs: found -1, expected a whole number from 1 to 1024"},
      {{"tyre", "--out", "/proc/nowhere"}, "--out: cannot make the folder /proc/nowhere/: No such file or directory"},
      {{"tyre", "--out", "/proc/version"}, "--out: /proc/version is not a folder"},
      {{"recorded"}, "experiment 'recorded' needs the recorded drives: --data DIR"},
      {{"tyre", "--uot", "x"}, "unknown option '--uot'; did you mean '--out'?"},
  };
  for (const auto& door : doors) expect_refused(bench, "reproduce", kThere + door.arguments, door.line);
  expect_refused(bench, "reproduce", {"tyre", "--scenarios", "nowhere"}, "--scenarios: no such folder: nowhere");
}

TEST(Reproduce, TheListNamesEveryExperimentWithItsItems) {
  Bench bench;
  Process p = reproduce(bench, {"--list"});
  expect_success(p);
  for (const char* text : {"tyre", "Fig. 1, Table 1", "drivetrain", "Table 16", "document 001", "document 002", "localisation"})
    EXPECT_TRUE(p.said(text)) << text;
}

TEST(Reproduce, AFigureByItsNumberAndASecondCallThatHasNothingToDo) {
  Bench bench;
  Process first = reproduce(bench, {"fig_1", "--out", bench.path("out")});
  expect_success(first);
  EXPECT_TRUE(first.said("tyre begins"));  // at once, not only at the end
  EXPECT_TRUE(first.said("tyre finished in "));
  for (const char* file : {"report.html", "results.json", "figures/fig_1.svg", "figures/fig_1.csv", "tables/table_1.csv"})
    EXPECT_TRUE(std::filesystem::exists(bench.path(std::string("out/") + file))) << file;
  const std::string page = text_of(bench.path("out/report.html"));
  EXPECT_NE(page.find("<b>Fig. 1. Friction on different surfaces.</b>"), std::string::npos);
  EXPECT_EQ(page.find("http://"), page.find("http://www.w3.org"));  // names of XML, no address
  EXPECT_EQ(page.find("src="), std::string::npos);

  Process second = reproduce(bench, {"tyre", "--out", bench.path("out")});
  expect_success(second);
  EXPECT_TRUE(second.said("1 of 1 experiments are finished already"));
  EXPECT_FALSE(second.said("tyre begins"));
  EXPECT_EQ(text_of(bench.path("out/report.html")), page);
}

// Fig. 5 is there twice: the bare name is document 002's.
TEST(Reproduce, AFigureOfAnotherDocumentIsNamedWithIt) {
  Bench bench;
  Process p = reproduce(bench, {"001_fig_5", "--seeds", "1", "--out", bench.path("out")});
  expect_success(p);
  EXPECT_TRUE(p.said("localisation begins"));
  EXPECT_FALSE(p.said("snow begins"));
  EXPECT_TRUE(std::filesystem::exists(bench.path("out/figures/001_fig_5.svg")));
  EXPECT_FALSE(std::filesystem::exists(bench.path("out/figures/fig_5.svg")));
  EXPECT_NE(text_of(bench.path("out/report.html")).find("Document 001, reproduced"), std::string::npos);
  const nlohmann::json results = nlohmann::json::parse(text_of(bench.path("out/results.json")), nullptr, false);
  ASSERT_TRUE(results.is_array());
  for (const nlohmann::json& r : results) EXPECT_EQ(r["document"], "001");
}

// One run of everything: each experiment delivers the figures and tables that it promises, or the program fails.
TEST(Reproduce, EveryExperimentDeliversItsItems) {
  Bench bench;
  const std::string data = SLIPSTREAM_DATA_DIR;
  Process p = reproduce(
      bench, Arguments{"--seeds", "1", "--out", bench.path("out")} + (data.empty() ? Arguments{} : Arguments{"--data", data}));
  EXPECT_EQ(p.wait(280.0), 0) << p.out() << p.err();
  const nlohmann::json results = nlohmann::json::parse(text_of(bench.path("out/results.json")), nullptr, false);
  ASSERT_TRUE(results.is_array());
  EXPECT_GT(results.size(), 200U);
  for (const nlohmann::json& r : results) {
    EXPECT_FALSE(r["ours"].is_null()) << r.dump();
    EXPECT_EQ(r["verdict"].get<std::string>().find("not computed"), std::string::npos) << r.dump();
  }
  EXPECT_EQ(text_of(bench.path("out/report.html")).find("could not be drawn"), std::string::npos);
}

// What was finished before the interruption stays, and is in the report; the same call goes on from there.
TEST(Reproduce, AnInterruptedCallGoesOn) {
  Bench bench;
  const Arguments call{"drivetrain", "unimog", "--seeds", "500", "--jobs", "2", "--out", bench.path("out")};
  Process p = reproduce(bench, call);
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(50);
  while (!p.said("drivetrain finished") && std::chrono::steady_clock::now() < limit)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  p.signal(SIGINT);
  EXPECT_EQ(p.wait(), 1);
  EXPECT_EQ(p.err(), "slipstream-reproduce: interrupted; the same call goes on from here\n");
  EXPECT_NE(text_of(bench.path("out/report.html")).find("This call was interrupted"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(bench.path("out/parts/drivetrain.json")));
  EXPECT_FALSE(std::filesystem::exists(bench.path("out/parts/unimog.json")));
  Process again = reproduce(bench, call);
  while (!again.said("unimog begins") && std::chrono::steady_clock::now() < limit + std::chrono::seconds(10))
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(again.said("1 of 2 experiments are finished already"));
  EXPECT_FALSE(again.said("drivetrain begins"));
  again.kill();
}

}  // namespace
}  // namespace slipstream::test
