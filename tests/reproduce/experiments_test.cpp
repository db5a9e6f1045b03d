// The list of experiments is complete: every figure and table of chapters 3 to 7 that shows a result has its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "reproduce/files.hpp"

namespace slipstream {
namespace {

TEST(Experiments, EveryFigureAndTableOfTheDocumentIsThereOnce) {
  std::map<std::string, int> count;
  for (const Experiment& e : experiments())
    for (const std::string& item : e.items) ++count[item];
  std::set<std::string> wanted{"Fig. 1"};
  for (const auto& [first, last] : {std::pair{5, 13}, {16, 28}, {29, 35}, {37, 58}})
    for (int n = first; n <= last; ++n) wanted.insert("Fig. " + std::to_string(n));
  wanted.insert("Table 1");
  for (int n = 3; n <= 16; ++n) wanted.insert("Table " + std::to_string(n));
  for (const std::string& item : wanted) EXPECT_EQ(count[item], 1) << item;
}

TEST(Experiments, NamesAreUniqueAndFitForFiles) {
  std::set<std::string> names;
  for (const Experiment& e : experiments()) {
    EXPECT_TRUE(names.insert(e.name).second) << e.name;
    EXPECT_EQ(file_stem(e.name), e.name);
    EXPECT_NE(e.run, nullptr);
    EXPECT_FALSE(e.title.empty());
  }
}

TEST(Experiments, FileStems) {
  EXPECT_EQ(file_stem("Fig. 16"), "fig_16");
  EXPECT_EQ(file_stem("Table 7"), "table_7");
}

}  // namespace
}  // namespace slipstream
