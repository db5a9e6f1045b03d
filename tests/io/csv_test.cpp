#include "io/csv.hpp"

#include <gtest/gtest.h>

#include "tests/io/temporary_folder.hpp"

namespace slipstream {
namespace {

class Csv : public testing::Test {
 protected:
  // The refusal of a file with this content, without the folder's name.
  std::string refused(const std::string& text, const std::vector<std::string>& columns = {"t_s", "w_radps"}) {
    const std::string path = folder.write("drive.csv", text);
    const std::string line = refusal_of([&] { read_csv(path, columns, "t_s"); });
    EXPECT_EQ(line.find(path), 0u) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    return line.substr(std::min(line.size(), folder.path().size() + 1));
  }

  TemporaryFolder folder;
};

TEST_F(Csv, ReadsTheNamedColumnsInTheOrderAsked) {
  const CsvTable table =
      read_csv(folder.write("a.csv", "t_s,note,w_radps\n0.5,\"a, \"\"b\"\"\",+1e-3\n1.5,,-2\n"), {"w_radps", "t_s"}, "t_s");
  EXPECT_EQ(table.columns, (std::vector<std::string>{"w_radps", "t_s"}));
  EXPECT_EQ(table["t_s"], (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(table["w_radps"], (std::vector<double>{1e-3, -2.0}));
  EXPECT_EQ(table.line, (std::vector<long>{2, 3}));
}

TEST_F(Csv, TakesOtherLineEndsAByteOrderMarkBlankLinesAndNoFinalNewline) {
  const CsvTable table =
      read_csv(folder.write("a.csv", "\xEF\xBB\xBFt_s,\"w_radps\"\r\n0, 1 \r\n\r\n2,3"), {"t_s", "w_radps"}, "t_s");
  EXPECT_EQ(table["t_s"], (std::vector<double>{0, 2}));
  EXPECT_EQ(table["w_radps"], (std::vector<double>{1, 3}));
  EXPECT_EQ(table.line, (std::vector<long>{2, 4}));
}

TEST_F(Csv, RefusesFilesItCannotRead) {
  const std::string path = folder.path("none.csv");
  EXPECT_EQ(refusal_of([&] { read_csv(path, {"t_s"}); }), path + ": cannot read: No such file or directory");
  EXPECT_EQ(refusal_of([&] { read_csv(folder.path(), {"t_s"}); }), folder.path() + ": cannot read: Is a directory");
}

TEST_F(Csv, RefusesAHeaderWithoutTheColumn) {
  EXPECT_EQ(refused("t_s,w_rapds\n0,1\n"), "drive.csv:1: missing column 'w_radps'; did you mean 'w_rapds'?");
  EXPECT_EQ(refused("t_s,speed\n0,1\n"), "drive.csv:1: missing column 'w_radps'; expected one of t_s, speed");
  EXPECT_EQ(refused("t_s,w_radps,t_s\n0,1,2\n"), "drive.csv:1: column 't_s' appears twice");
}

TEST_F(Csv, RefusesRowsOfTheWrongLength) {
  EXPECT_EQ(refused("t_s,w_radps\n0,1\n1\n"), "drive.csv:3: found 1 cell, expected 2 as in the header");
  EXPECT_EQ(refused("t_s,w_radps\n0,1,2\n"), "drive.csv:2: found 3 cells, expected 2 as in the header");
  EXPECT_EQ(refused("t_s,w_radps\n0,12,5\n"), "drive.csv:2: found 3 cells, expected 2 as in the header");
}

TEST_F(Csv, RefusesCellsThatAreNotFiniteNumbers) {
  for (const char* cell : {"12;5", "abc", "", "nan", "inf", "-inf", "1e999", "0x10", "1 2", "+-5", "--5", "1e", "3m"})
    EXPECT_EQ(refused(std::string("t_s,w_radps\n0,1\n1,") + cell + "\n"),
              std::string("drive.csv:3: w_radps: found '") + cell + "', expected a finite number");
  EXPECT_EQ(refused("t_s,w_radps\n0,\"12,5\"\n"), "drive.csv:2: w_radps: found '12,5', expected a finite number");
  EXPECT_EQ(refused("t_s,w_radps\n0,\"a\nb\"\n"), "drive.csv:3: w_radps: found 'a?b', expected a finite number");
}

TEST_F(Csv, RefusesTimeThatDoesNotIncrease) {
  EXPECT_EQ(refused("t_s,w_radps\n0,1\n0.5,1\n0.5,2\n"), "drive.csv:4: t_s: found 0.5, expected more than the row before it");
  EXPECT_EQ(refused("t_s,w_radps\n1,1\n0.5,1\n"), "drive.csv:3: t_s: found 0.5, expected more than the row before it");
}

TEST_F(Csv, RefusesEmptyAndMalformedFiles) {
  EXPECT_EQ(refused(""), "drive.csv: empty, expected a header line");
  EXPECT_EQ(refused("\n\n"), "drive.csv: empty, expected a header line");
  EXPECT_EQ(refused("t_s,w_radps\n"), "drive.csv: no rows after the header");
  EXPECT_EQ(refused("t_s,w_radps\n0,\"1\n"), "drive.csv:2: malformed: a quoted cell does not end");
  EXPECT_EQ(refused("t_s,w_radps\n0,1\"2\n").substr(0, 23), "drive.csv:2: malformed:");
}

}  // namespace
}  // namespace slipstream
