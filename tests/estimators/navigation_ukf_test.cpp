// The unscented filter: what every strapdown filter must do, and what is its own.
#include "common/refusal.hpp"
#include "tests/estimators/navigation_cases.hpp"

namespace slipstream::test {
namespace {

class NavigationUkf : public ::testing::TestWithParam<const char*> {
 protected:
  std::unique_ptr<NavigationFilter> make(bool biases) const {
    return make_navigation_ukf({}, navigation_tuning(GetParam(), biases));
  }
};
INSTANTIATE_TEST_SUITE_P(Forms, NavigationUkf, ::testing::Values("global", "local"));

TEST_P(NavigationUkf, LinearCaseIsAKalmanFilter) { expect_kalman(*make(false), false); }
TEST_P(NavigationUkf, CovarianceStaysSymmetricAndPositive) { expect_covariances(*make(true), true); }
TEST_P(NavigationUkf, ErrorsAreAsLargeAsItBelieves) { expect_consistent(*make(true), true); }
TEST_P(NavigationUkf, WhatIsRefusedLeavesTheBelief) { expect_untouched(*make(true), true); }
// The points lie along the factor's columns, which do not turn with the world: their second order differs, sigma_phi^2 / 10.
TEST_P(NavigationUkf, YawWraps) { expect_yaw_is_no_number(*make(true), 1e-3); }

// The mean of the velocity that an uncertain heading leads to: E[cos psi] = exp(-sigma^2 / 2), which no first order sees.
TEST_P(NavigationUkf, MeanOfAnUncertainHeading) {
  constexpr double variance = 0.04, f = 10.0;
  NavigationBelief b;
  b.P(kAttitude + 2, kAttitude + 2) = variance;
  Strapdown weightless;
  weightless.gravity_mps2 = 0.0;
  make_navigation_ukf(weightless, navigation_tuning(GetParam(), true))->predict(b, {{f, 0.0, 0.0}, Vector3::Zero()}, {}, 1.0);
  // The middle's heading is 0 here and so is the mean's: what is left of exp is its third term, sigma^4 / 8.
  EXPECT_NEAR(b.x.v_WS[0], f * std::exp(-0.5 * variance), f * variance * variance / 8.0);
  EXPECT_NEAR(b.x.v_WS[1], 0.0, 1e-12);  // rounding
}

std::string refusal(const StrapdownTuning& tuning) {
  try {
    make_navigation_ukf({}, tuning);
  } catch (const Refusal& r) {
    return r.what();
  }
  return "";
}

TEST(NavigationUkfTuning, IsRefusedWhereTheTransformWouldBreak) {
  StrapdownTuning t = navigation_tuning("global", false);
  t.ukf_kappa = -10.0;
  EXPECT_EQ(refusal(t), "ukf_kappa = -10 must be more than -9, the number of error states");
  t.biases = true;
  EXPECT_EQ(refusal(t), "");
  t.ukf_alpha = 0.5;
  t.ukf_beta = 0.2;
  EXPECT_EQ(refusal(t), "ukf_beta = 0.2 must be at least ukf_alpha squared, 0.25: else the covariance may become indefinite");
}

}  // namespace
}  // namespace slipstream::test
