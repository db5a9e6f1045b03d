// The durable lines of a study: what is torn, mixed, repeated or foreign.
#include "studies/journal.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "studies/desk.hpp"
#include "tests/studies/small_study.hpp"

namespace slipstream {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Journals : public ::testing::Test {
 protected:
  std::string line(std::size_t item) const { return to_text(run_item(study_, item)); }
  std::string path(const std::string& name) const { return folder_.path(name); }
  // The known items of a file with this text, or what was refused.
  std::string known(const std::string& text) {
    const std::string file = folder_.write("runs.jsonl", text);
    return refusal_of([&] {
      KnownRuns runs(study_);
      torn_ = runs.read(file);
      std::string items;
      for (std::size_t item = 0; item < study_.items(); ++item) items += runs.has(item) ? "1" : "0";
      throw Refusal(items);
    });
  }

  const TemporaryFolder folder_, sources_;
  const Study study_ = read_small(sources_, small_study());
  std::size_t torn_ = 0;
};

TEST_F(Journals, ATornLastLineIsToldFromAWholeOne) {
  const std::string a = line(0), b = line(2);
  EXPECT_EQ(known(""), "000");
  EXPECT_EQ(known(a + "\n" + b + "\n"), "101");
  EXPECT_EQ(torn_, 0U);
  for (const std::size_t size : {std::size_t{1}, b.size() / 2, b.size()}) {  // also where only the end of line is missing
    EXPECT_EQ(known(a + "\n" + b.substr(0, size)), "100");
    EXPECT_EQ(torn_, size);
  }
  EXPECT_EQ(known(a + "\n" + b.substr(0, 40) + "\n"), "100");
  EXPECT_EQ(torn_, 41U);
  EXPECT_EQ(known(a + "\n" + std::string(100, '\0')), "100");  // what a lost block reads as
  EXPECT_EQ(torn_, 100U);
}

TEST_F(Journals, Refusals) {
  const std::string file = path("runs.jsonl"), a = line(0);
  EXPECT_EQ(known("rubbish\n" + a + "\n"), file + ":1: not a line of JSON; take the line out and its run is repeated");
  EXPECT_EQ(known("{}\n" + a + "\n"), file + ":1: not the line of a run; take the line out and its run is repeated");
  std::string other = a;
  other.replace(a.find(study_.key), 4, "beef");
  EXPECT_EQ(known(a + "\n" + other + "\n"),
            file + ":2: a run of another study ('beef" + study_.key.substr(4) + "', this one is '" + study_.key + "')");
  std::string moved = a;
  moved.replace(a.find("\"item\":0"), 8, "\"item\":1");
  EXPECT_EQ(known(moved + "\n"),
            file + ":1: item 1 with seed " + std::to_string(study_.seed_of(0)) + " is no run of this study");
  moved.replace(a.find("\"item\":0"), 8, "\"item\":3");
  EXPECT_EQ(known(moved + "\n"),
            file + ":1: item 3 with seed " + std::to_string(study_.seed_of(0)) + " is no run of this study");
}

// A damage inside a line shows when it is summed.
TEST_F(Journals, ADamagedLineIsNamed) {
  const std::string file = path("runs.jsonl");
  std::string damaged = line(0);
  damaged[damaged.find(':', damaged.find("\"estimators\":{") + 14)] = '"';  // after the first estimator's name
  folder_.write("runs.jsonl", damaged + "\n" + line(1) + "\n");
  KnownRuns runs(study_);
  EXPECT_EQ(runs.read(file), 0U);
  const std::string refused = refusal_of([&] { summarise(study_, runs); });
  EXPECT_TRUE(refused == file + ":1: not a line of JSON; take the line out and its run is repeated" ||
              refused == file + ":1: not the line of a run; take the line out and its run is repeated")
      << refused;
}

TEST_F(Journals, TheSameResultTwiceIsFineADifferentOneIsNot) {
  const std::string file = path("runs.jsonl"), a = line(0), again = line(0);  // other times
  EXPECT_EQ(known(a + "\n" + again + "\n"), "100");
  std::string different = a;
  different.replace(a.find("\"steps\":21"), 10, "\"steps\":22");
  EXPECT_EQ(known(a + "\n" + different + "\n"),
            file + ":2: item 0 differs from " + file + ":1: one of them was made by another program");
}

TEST_F(Journals, ADeskGoesOnWhereAnEarlierOneEnded) {
  const std::string out = path("out");
  std::vector<std::string> said;
  const auto say = [&](const std::string& line) { said.push_back(line); };
  {
    Desk desk(study_, out, {}, say);
    EXPECT_EQ(desk.next(), 0U);
    EXPECT_EQ(desk.next(), 1U);
    EXPECT_EQ(desk.next(), 2U);
    EXPECT_EQ(desk.next(), std::nullopt);
    desk.finished(1, line(1));
    desk.finished(0, line(0));
    desk.close();
  }
  const std::string whole = text_of(path("out/runs.jsonl"));
  const std::size_t last = whole.size() - whole.find('\n') - 1;         // bytes of item 0's line, the second
  folder_.write("out/runs.jsonl", whole.substr(0, whole.size() - 10));  // item 0's line is torn
  {
    Desk desk(study_, out, {}, say);
    ASSERT_EQ(said.size(), 1U);
    EXPECT_EQ(said[0],
              out + "/runs.jsonl: cut off a torn last line of " + std::to_string(last - 10) + " bytes; its run is repeated");
    EXPECT_EQ(desk.done(), 1U);
    EXPECT_EQ(desk.next(), 1U);  // done again, to see whether it comes out as it did
    EXPECT_EQ(desk.next(), 0U);
    EXPECT_EQ(desk.next(), 2U);
    EXPECT_EQ(desk.next(), std::nullopt);
    desk.finished(1, line(1));
    EXPECT_EQ(desk.done(), 1U);
    desk.finished(0, line(0));
    desk.finished(2, line(2));
    desk.close();
    EXPECT_EQ(desk.done(), 3U);
  }
  KnownRuns known(study_);
  EXPECT_EQ(known.read(path("out/runs.jsonl")), 0U);
  EXPECT_EQ(known.count(), 3U);
  EXPECT_EQ(known.repeated(), 0U);
  Desk desk(study_, out, {}, say);
  EXPECT_EQ(desk.next(), std::nullopt);  // nothing is left, so nothing is mixed
}

TEST_F(Journals, AnotherProgramMayNotGoOn) {
  const std::string out = path("out");
  const auto quiet = [](const std::string&) {};
  {
    Desk desk(study_, out, {}, quiet);
    std::string other = line(0);
    other.replace(other.find("\"steps\":21"), 10, "\"steps\":22");
    desk.finished(0, other);
    desk.close();
  }
  Desk desk(study_, out, {}, quiet);
  EXPECT_EQ(desk.next(), 0U);
  EXPECT_EQ(refusal_of([&] { desk.finished(0, line(0)); }),
            out +
                "/runs.jsonl:1: this run comes out differently now: another program has begun this study; start it afresh in "
                "another folder");
}

TEST_F(Journals, ShardsShareTheItems) {
  const std::string out = path("out");
  const auto quiet = [](const std::string&) {};
  Desk first(study_, out, {1, 2}, quiet);
  EXPECT_EQ(first.all(), 2U);
  EXPECT_EQ(first.next(), 0U);
  EXPECT_EQ(first.next(), 2U);
  EXPECT_EQ(first.next(), std::nullopt);
  Desk second(study_, out, {2, 2}, quiet);  // at the same time
  EXPECT_EQ(second.next(), 1U);
  EXPECT_EQ(second.next(), std::nullopt);
  EXPECT_TRUE(std::filesystem::exists(path("out/runs-2-of-2.jsonl")));
}

TEST_F(Journals, AFolderHoldsOneStudy) {
  const std::string out = path("out");
  claim_folder(out, study_);
  claim_folder(out, study_);
  const TemporaryFolder elsewhere;
  const Study other = read_small(elsewhere, small_study("", "seed = 8"));
  EXPECT_EQ(refusal_of([&] { claim_folder(out, other); }),
            "--out: " + out + " holds another study (its study.toml says '# study " + study_.key + "', this one is '# study " +
                other.key + "'); give this one a folder of its own");
  std::filesystem::create_directory(path("odd"));
  folder_.write("odd/runs-1-of-2.jsonl", "");
  EXPECT_EQ(refusal_of([&] { claim_folder(path("odd"), study_); }),
            "--out: " + path("odd") + " holds runs but no study.toml that says of what; give this study another folder");
  EXPECT_EQ(refusal_of([&] { claim_folder(folder_.write("file", ""), study_); }),
            "--out: " + path("file") + " is not a folder");
  EXPECT_EQ(refusal_of([&] { claim_folder("/proc/nowhere", study_); }),
            "--out: cannot make the folder /proc/nowhere/scenarios: No such file or directory");
}

}  // namespace
}  // namespace slipstream
