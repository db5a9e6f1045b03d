// Parts, results and the runner, with experiments of our own.
#include "reproduce/runner.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "reproduce/files.hpp"
#include "tests/io/temporary_folder.hpp"

namespace slipstream {
namespace {

void good(const Bench& bench, Outcome& o) {
  bench.progress(1, 2);
  o.rows.push_back(judged("Table 7", "R2, \"quoted\"", "", Printed("0.5"), Aim::kHigh, {0.9, 0.8}, ""));
  o.rows.push_back(reported("Fig. 5", "nothing", "s", {}));
  o.tables.push_back({"Table 7", "a caption", {"title", {{"text", false}, {"number"}}, {{"a, b", "1"}, {"c \"d\"", "2"}}}});
  o.figures.push_back(
      Sketch("Fig. 5", "a line", 1.0).panel("y", 100).line("s", {0.0, 1.0}, {2.0, 3.0}, line_of(0)).finish("c"));
  o.notes.emplace_back("a note");
}
void throwing(const Bench&, Outcome&) { throw std::runtime_error("on\npurpose"); }
void dying(const Bench&, Outcome&) { std::raise(SIGKILL); }
void endless(const Bench&, Outcome&) {
  for (;;) ::pause();
}

Experiment named(const char* name, void (*run)(const Bench&, Outcome&), double minutes = 1.0) {
  return {"002", name, "chapter", "title", {}, minutes, run};
}

struct Finished {
  std::map<std::string, std::string> error;
  std::vector<std::string> order;
  int most_running = 0;
  bool interrupt = false;
  RunnerHooks hooks() {
    RunnerHooks h;
    h.interrupted = [this] { return interrupt; };
    h.progress = [this](const auto& running, std::size_t, std::size_t) {
      most_running = std::max(most_running, static_cast<int>(running.size()));
    };
    h.finished = [this](const std::string& name, const std::string& e, double) {
      error[name] = e;
      order.push_back(name);
    };
    return h;
  }
};

TEST(Runner, WhatIsFinishedIsReadBackAsItWas) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  const Experiment e = named("good", good);
  Finished f;
  ASSERT_TRUE(run_experiments({&e}, {}, folder.path(), "key", 1, f.hooks()));
  EXPECT_EQ(f.error.at("good"), "");
  const std::optional<Part> part = read_part(folder.path(), "good", "key");
  ASSERT_TRUE(part);
  Outcome original;
  Bench quiet;
  quiet.progress = [](int, int) {};
  good(quiet, original);
  ASSERT_EQ(part->outcome.rows.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(part->outcome.rows[i].verdict, original.rows[i].verdict);
    EXPECT_EQ(part->outcome.rows[i].quantity, original.rows[i].quantity);
    EXPECT_EQ(part->outcome.rows[i].published, original.rows[i].published);
  }
  EXPECT_EQ(part->outcome.rows[0].ours, original.rows[0].ours);
  EXPECT_EQ(part->outcome.rows[0].spread->high, 0.9);
  EXPECT_TRUE(std::isnan(part->outcome.rows[1].ours));
  ASSERT_EQ(part->outcome.tables.size(), 1U);
  EXPECT_EQ(part->outcome.tables[0].table.rows, original.tables[0].table.rows);
  EXPECT_EQ(part->outcome.notes.at(0), original.notes.at(0));  // the runner may add what became of the steps

  std::ifstream csv(folder.path("tables/table_7.csv"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(csv), {}), "text,number\n\"a, b\",1\n\"c \"\"d\"\"\",2\n");
  std::ifstream series(folder.path("figures/fig_5.csv"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(series), {}), "panel,series,x,y,low,high\ny,s,0,2,,\ny,s,1,3,,\n");

  write_results(folder.path(), {*part});
  std::ifstream file(folder.path("results.json"));
  const nlohmann::json results = nlohmann::json::parse(file);
  ASSERT_EQ(results.size(), 2U);
  for (const char* key : {"document", "item", "quantity", "unit", "published", "ours", "spread", "verdict", "note"})
    EXPECT_TRUE(results[0].contains(key)) << key;
  EXPECT_EQ(results[0]["document"], "002");
  EXPECT_EQ(results[0]["published"], 0.5);
  EXPECT_TRUE(results[1]["ours"].is_null());  // JSON has no NaN
}

void seeds(const Bench& bench, Outcome& o) {
  o.rows.push_back(reported("Fig. 5", "seeds", "", {static_cast<double>(bench.seeds)}));
  o.figures.push_back(
      Sketch("Fig. 5", "a line", 1.0).panel("y", 100).line("s", {0.0, 1.0}, {2.0, 3.0}, line_of(0)).finish("c"));
}

// Both documents have a Fig. 5: neither overwrites the other's, and every row says whose it is.
TEST(Runner, ItemsOfTwoDocumentsStandSideBySide) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  Experiment first = named("first", seeds), second = named("second", seeds);
  first.document = "001";
  first.seeds = 50;
  Finished f;
  ASSERT_TRUE(run_experiments({&first, &second}, {}, folder.path(), "key", 1, f.hooks()));
  std::vector<Part> parts;
  for (const char* name : {"first", "second"}) parts.push_back(read_part(folder.path(), name, "key").value());
  EXPECT_EQ(parts[0].document, "001");
  EXPECT_EQ(parts[0].outcome.figures[0].svg, "001_fig_5.svg");
  EXPECT_EQ(parts[1].outcome.figures[0].svg, "fig_5.svg");
  EXPECT_EQ(parts[0].outcome.rows[0].ours, 50.0);  // each experiment's own, where the call does not say
  EXPECT_EQ(parts[1].outcome.rows[0].ours, 20.0);
  for (const char* file : {"figures/001_fig_5.csv", "figures/fig_5.csv"})
    EXPECT_TRUE(std::ifstream(folder.path(file)).good()) << file;
  write_results(folder.path(), parts);
  std::ifstream file(folder.path("results.json"));
  const nlohmann::json results = nlohmann::json::parse(file);
  EXPECT_EQ(results[0]["document"], "001");
  EXPECT_EQ(results[1]["document"], "002");
}

TEST(Runner, SeedsOfTheCallHoldForAll) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  const Experiment e = named("good", seeds);
  Bench bench;
  bench.seeds = 3;
  Finished f;
  ASSERT_TRUE(run_experiments({&e}, bench, folder.path(), "key", 1, f.hooks()));
  EXPECT_EQ(read_part(folder.path(), "good", "key").value().outcome.rows[0].ours, 3.0);
}

TEST(Runner, APartOfAnotherKeyOrFormIsNotUsed) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  write_part(folder.path(), {"002", "x", "key", 1.0, {}});
  EXPECT_TRUE(read_part(folder.path(), "x", "key"));
  EXPECT_FALSE(read_part(folder.path(), "x", "other"));
  EXPECT_FALSE(read_part(folder.path(), "y", "key"));
  for (const char* text : {"", "{", "[]", "{\"key\": \"key\", \"experiment\": \"x\"}",
                           "{\"key\":\"key\",\"document\":\"002\",\"experiment\":\"x\",\"elapsed_s\":1,\"rows\":[{}],"
                           "\"tables\":[],\"figures\":[]}"}) {
    folder.write("parts/x.json", text);
    EXPECT_FALSE(read_part(folder.path(), "x", "key")) << text;
  }
}

TEST(Runner, OneThatFailsTakesNothingElseDown) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  const Experiment all[] = {named("throwing", throwing), named("good", good), named("dying", dying)};
  Finished f;
  EXPECT_TRUE(run_experiments({&all[0], &all[1], &all[2]}, {}, folder.path(), "key", 2, f.hooks()));
  EXPECT_EQ(f.error.at("throwing"), "on purpose");
  EXPECT_EQ(f.error.at("dying"), "was ended by signal 9");
  EXPECT_EQ(f.error.at("good"), "");
  EXPECT_FALSE(read_part(folder.path(), "throwing", "key"));
  EXPECT_LE(f.most_running, 2);
}

TEST(Runner, AnItemThatIsPromisedMustBeThere) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  Experiment e = named("good", good);
  e.items = {"Fig. 5", "Table 7"};
  Finished f;
  EXPECT_TRUE(run_experiments({&e}, {}, folder.path(), "key", 1, f.hooks()));
  EXPECT_EQ(f.error.at("good"), "");
  e.items = {"Fig. 5", "Fig. 6"};
  EXPECT_TRUE(run_experiments({&e}, {}, folder.path(), "other", 1, f.hooks()));
  EXPECT_EQ(f.error.at("good"), "Fig. 6 is missing in what it has computed");
}

TEST(Runner, TheLongestStartsFirst) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  const Experiment all[] = {named("short", good, 0.1), named("long", good, 5.0), named("middle", good, 1.0)};
  Finished f;
  EXPECT_TRUE(run_experiments({&all[0], &all[1], &all[2]}, {}, folder.path(), "key", 1, f.hooks()));
  EXPECT_EQ(f.order, (std::vector<std::string>{"long", "middle", "short"}));
}

TEST(Runner, AnInterruptionEndsThemAtOnceAndKeepsWhatIsFinished) {
  const TemporaryFolder folder;
  prepare_output(folder.path());
  const Experiment all[] = {named("good", good, 9.0), named("endless", endless)};
  Finished f;
  RunnerHooks hooks = f.hooks();
  hooks.interrupted = [&f] { return f.error.contains("good"); };
  EXPECT_FALSE(run_experiments({&all[0], &all[1]}, {}, folder.path(), "key", 2, hooks));
  EXPECT_TRUE(read_part(folder.path(), "good", "key"));
  EXPECT_FALSE(read_part(folder.path(), "endless", "key"));
}

TEST(Runner, AFolderThatCannotBeMadeIsRefused) {
  EXPECT_EQ(refusal_of([] { prepare_output("/proc/nowhere"); }),
            "--out: cannot make the folder /proc/nowhere/: No such file or directory");
}

}  // namespace
}  // namespace slipstream
