#include "studies/indices.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace slipstream {
namespace {

using Errors = std::vector<std::vector<double>>;

// By hand: two states, two samples, two runs, with 3-4-5 triangles: sqrt((3^2 + 4^2)/2) = 5/sqrt(2).
TEST(Indices, ByHand) {
  IndexAverage average;
  const RunIndices first = run_indices(Errors{{3.0, 6.0}, {-4.0, 8.0}});
  const double root = std::sqrt(2.0);
  EXPECT_NEAR(first.eps[0], 5.0 / root, 1e-15);  // rounding
  EXPECT_NEAR(first.eps[1], 10.0 / root, 1e-15);
  EXPECT_NEAR(first.eta, 7.5 / root, 1e-15);
  EXPECT_EQ(first.eps_state, (Errors{{3.0, 6.0}, {4.0, 8.0}}));
  average.add(first);
  average.add(run_indices(Errors{{-1.0, 0.0}, {1.0, 0.0}}));
  const StudyIndices study = average.result();
  EXPECT_EQ(study.runs, 2u);
  EXPECT_EQ(study.failed, 0u);
  EXPECT_NEAR(study.mean.eps[0], (5.0 / root + 1.0) / 2.0, 1e-15);
  EXPECT_NEAR(study.mean.eps[1], 5.0 / root, 1e-15);
  EXPECT_NEAR(study.mean.eta, (7.5 / root + 0.5) / 2.0, 1e-15);
  EXPECT_EQ(study.mean.eps_state, (Errors{{2.0, 3.0}, {2.5, 4.0}}));
}

TEST(Indices, ARunWithoutAnEstimateIsLeftOutAndCounted) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const RunIndices failed = run_indices(Errors{{1.0, nan}, {1.0, 1.0}});
  EXPECT_TRUE(std::isnan(failed.eta));
  EXPECT_EQ(failed.eps[0], 1.0);
  IndexAverage average;
  average.add(failed);
  EXPECT_TRUE(std::isnan(average.result().mean.eta));
  EXPECT_EQ(average.result().runs, 0u);
  average.add(run_indices(Errors{{2.0, 2.0}, {2.0, 2.0}}));
  EXPECT_EQ(average.result().mean.eta, 2.0);
  EXPECT_EQ(average.result().runs, 1u);
  EXPECT_EQ(average.result().failed, 1u);
}

}  // namespace
}  // namespace slipstream
