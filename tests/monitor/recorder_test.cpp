#include "monitor/recorder.hpp"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace slipstream {
namespace {

// Path -> what was written there, since it was last opened.
std::map<std::string, std::vector<std::string>>& files() {
  static std::map<std::string, std::vector<std::string>> all;
  return all;
}

// Like a file that is buffered: what is written arrives when it is closed.
class FakeLog {
 public:
  explicit FakeLog(const std::string& path) : path_(path) { files()[path].clear(); }
  ~FakeLog() { files()[path_].insert(files()[path_].end(), written_.begin(), written_.end()); }
  FakeLog(const FakeLog&) = delete;
  FakeLog& operator=(const FakeLog&) = delete;
  void write(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size) {
    written_.push_back(channel + "@" + std::to_string(wall_utime) + ":" + std::string(static_cast<const char*>(data), size));
  }
  std::int64_t events() const { return static_cast<std::int64_t>(written_.size()); }

 private:
  std::string path_;
  std::vector<std::string> written_;
};

using Lines = std::vector<std::string>;

TEST(Recorder, BeginsWithWhatCameBeforeTheRun) {
  files().clear();
  Recorder<FakeLog> recorder;
  recorder.add("ANNOUNCE", 1, "a", 1);
  recorder.add("RUN", 2, "r", 1);
  EXPECT_EQ(recorder.events(), 0);
  recorder.open("x");
  recorder.flush();
  EXPECT_EQ(recorder.events(), 2);
  recorder.add("TICK", 3, "t", 1);
  recorder.close();
  EXPECT_EQ(files()["x"], (Lines{"ANNOUNCE@1:a", "RUN@2:r", "TICK@3:t"}));
}

TEST(Recorder, TheMessageThatBeginsARunOpensItsLog) {
  files().clear();
  Recorder<FakeLog> recorder;
  recorder.open("x");
  recorder.add("TICK", 1, "t", 1);
  recorder.add("RUN", 2, "r", 1);
  recorder.close_before_newest();
  recorder.open("y");
  recorder.close();
  EXPECT_EQ(files()["x"], Lines{"TICK@1:t"});
  EXPECT_EQ(files()["y"], Lines{"RUN@2:r"});
}

TEST(Recorder, TheSamePathAgainIsANewFile) {
  files().clear();
  Recorder<FakeLog> recorder;
  recorder.open("x");
  recorder.add("RUN", 1, "old", 3);
  recorder.flush();
  recorder.add("RUN", 2, "new", 3);
  recorder.open("x");
  recorder.close();
  EXPECT_EQ(files()["x"], Lines{"RUN@2:new"});
}

TEST(Recorder, BeforeARunItKeepsTheNewestFourMegabytes) {
  files().clear();
  Recorder<FakeLog> recorder;
  const std::string megabyte(1u << 20, 'x');
  for (int i = 0; i < 10; ++i) recorder.add("X", i, megabyte.data(), megabyte.size());
  recorder.open("x");
  recorder.flush();
  EXPECT_EQ(recorder.events(), 4);
}

}  // namespace
}  // namespace slipstream
