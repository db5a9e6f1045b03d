#include "reproduce/outcome.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace slipstream {
namespace {

std::string verdict(const char* published, Aim aim, const std::vector<double>& ours) {
  return judged("Table 1", "q", "", Printed(published), aim, ours, "it rains").verdict;
}

TEST(Verdict, PrintedNumbersHaveAResolution) {
  EXPECT_EQ(Printed("0.9639").value, 0.9639);
  EXPECT_NEAR(Printed("0.9639").resolution, 1e-4, 1e-18);  // rounding of pow
  EXPECT_EQ(Printed("41").resolution, 1.0);
  EXPECT_NEAR(Printed("3.167e-3").resolution, 1e-6, 1e-18);  // rounding of pow
}

TEST(Verdict, OneRunIsComparedToThePrintedDigit) {
  EXPECT_EQ(verdict("0.90", Aim::kHigh, {0.906}), "better");
  EXPECT_EQ(verdict("0.90", Aim::kHigh, {0.896}), "equal to the printed digit");  // rounds to 0.90
  EXPECT_EQ(verdict("0.90", Aim::kHigh, {0.894}), "worse, because it rains");
  EXPECT_EQ(verdict("0.90", Aim::kLow, {0.894}), "better");
  EXPECT_EQ(verdict("0.90", Aim::kLow, {0.906}), "worse, because it rains");
}

TEST(Verdict, ManyRunsAreComparedByTheirSpread) {
  std::vector<double> ours;
  for (int i = 0; i < 20; ++i) ours.push_back(0.80 + 0.01 * i);  // 5 to 95 %: 0.80 to 0.98 by nearest rank
  EXPECT_EQ(verdict("0.97", Aim::kHigh, ours), "equal within spread");
  EXPECT_EQ(verdict("0.995", Aim::kHigh, ours), "worse, because it rains");
  EXPECT_EQ(verdict("0.70", Aim::kHigh, ours), "better");
  const Row row = judged("Table 1", "q", "", Printed("0.70"), Aim::kHigh, ours, "");
  EXPECT_NEAR(row.ours, 0.895, 1e-12);  // the mean of the two in the middle; rounding
  EXPECT_NEAR(row.spread->low, 0.80, 1e-12);
  EXPECT_NEAR(row.spread->high, 0.98, 1e-12);
  EXPECT_EQ(row.runs, 20);
}

TEST(Verdict, WithoutANumberThereIsNone) {
  const double nan = std::nan("");
  for (const std::vector<double>& ours : {std::vector<double>{nan}, {}, {0.5, nan, 0.6}})
    for (const Aim aim : {Aim::kHigh, Aim::kLow})
      EXPECT_EQ(verdict("0.90", aim, ours), "not computed: some run gave no number");
  EXPECT_TRUE(std::isnan(median({0.5, nan, 0.6})));
}

TEST(Verdict, WorseAlwaysHasAReason) {
  EXPECT_EQ(judged("T", "q", "", Printed("1.0"), Aim::kHigh, {0.5}, "").verdict,
            "worse, because of a reason that we have not found");
}

TEST(Verdict, AValueToBeMet) {
  EXPECT_EQ(met("T", "q", "s", Printed("2.56"), 2.50, 0.06, "why").verdict, "met within 0.06 s");
  EXPECT_EQ(met("T", "q", "s", Printed("2.56"), 2.561, 0.0, "why").verdict, "met to the printed digit");
  EXPECT_EQ(met("T", "q", "s", Printed("2.56"), 2.49, 0.06, "why").verdict, "different, because why");
  EXPECT_EQ(met("T", "q", "s", Printed("2.56"), std::nan(""), 0.06, "why").verdict, "not computed");
}

TEST(Verdict, AValueOfOursAlone) {
  const Row row = reported("T", "q", "s", {1.0, 3.0, 2.0});
  EXPECT_EQ(row.verdict, "no published value");
  EXPECT_EQ(row.ours, 2.0);
  EXPECT_FALSE(row.published);
}

}  // namespace
}  // namespace slipstream
