// What an estimator says about its model when it starts: once a run, and only where something is not observable.
#include <gtest/gtest.h>

#include "tests/system/bench.hpp"

namespace slipstream::test {
namespace {

TEST(Observability, AnEstimatorSaysOnceWhatItCannotObserve) {
  Bench bench;
  play_short(bench, {"--set", "run.duration_s=0.5"});
  const std::string log = bench.path("out/run.lcm");
  const std::string line =
      "speed_mps is not observable from wheel_speed_radps, a_x_mps2 with model longitudinal_friction (rank 2 of 3): its "
      "estimate "
      "is integrated from the start and its uncertainty grows\n";
  for (const char* algorithm : {"ekf", "hierarchical_ekf", "hierarchical_mhe"}) {
    Process without_drag = bench.from_log(log, {"--algorithm", algorithm, "--tuning", "document"});
    expect_success(without_drag);
    const std::string said = without_drag.out(), expected = std::string("slipstream-estimator ") + algorithm + ": " + line;
    const std::size_t first = said.find(expected);
    ASSERT_NE(first, std::string::npos) << said;
    EXPECT_EQ(said.find("observable", first + expected.size()), std::string::npos) << said;
  }
  Process with_drag = bench.from_log(log, {"--tuning", "matched"});
  expect_success(with_drag);
  EXPECT_FALSE(with_drag.said("observable")) << with_drag.out();
}

}  // namespace
}  // namespace slipstream::test
