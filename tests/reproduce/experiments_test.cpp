// The list of experiments is complete: every figure and table of document 000, of document 001's chapter 4 and of document
// 002's chapters 3 to 7 that shows a result has its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "reproduce/files.hpp"

namespace slipstream {
namespace {

std::map<std::string, int> count_of_items(const std::string& document) {
  std::map<std::string, int> count;
  for (const Experiment& e : experiments())
    if (e.document == document)
      for (const std::string& item : e.items) ++count[item];
  return count;
}

TEST(Experiments, EveryFigureOfDocument001IsThereOnce) {
  const std::map<std::string, int> count = count_of_items("001");
  for (int n = 5; n <= 15; ++n) {
    const std::string item = "Fig. " + std::to_string(n);
    ASSERT_TRUE(count.contains(item)) << item;
    EXPECT_EQ(count.at(item), 1) << item;
  }
}

TEST(Experiments, EveryResultOfDocument000IsThereOnce) {
  const std::map<std::string, int> count = count_of_items("000");
  std::set<std::string> wanted{"Table 1"};
  for (int n = 3; n <= 9; ++n) wanted.insert("Fig. " + std::to_string(n));
  for (const std::string& item : wanted) {
    ASSERT_TRUE(count.contains(item)) << item;
    EXPECT_EQ(count.at(item), 1) << item;
  }
}

TEST(Experiments, EveryFigureAndTableOfDocument002IsThereOnce) {
  std::map<std::string, int> count = count_of_items("002");
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
    const std::map<std::string, int> seeds{{"000", 10}, {"001", e.needs_data ? 20 : 50}, {"002", 20}, {"past", 20}};
    ASSERT_TRUE(seeds.contains(e.document)) << e.name;
    EXPECT_EQ(e.seeds, seeds.at(e.document)) << e.name;
  }
}

TEST(Experiments, FileStems) {
  EXPECT_EQ(file_stem("Fig. 16"), "fig_16");
  EXPECT_EQ(file_stem("Table 7"), "table_7");
  EXPECT_EQ(item_stem("002", "Fig. 16"), "fig_16");
  EXPECT_EQ(item_stem("001", "Fig. 16"), "001_fig_16");
  EXPECT_EQ(item_stem("past", "Hill and load"), "past_hill_and_load");
}

}  // namespace
}  // namespace slipstream
