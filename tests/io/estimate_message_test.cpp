// An estimate through its bytes and back, and the sizes that are refused.
#include <gtest/gtest.h>

#include "io/translate.hpp"

namespace slipstream {
namespace {

Estimate with_interval() {
  Estimate e;
  e.header = {10000, 1, 7};
  e.name = "pf";
  e.status = EstimateStatus::kValid;
  e.mean = {1.0, 2.0};
  e.covariance = {4.0, 0.5, 0.5, 9.0};
  e.interval_low = {-4.0, -5.5};
  e.interval_high = {6.5, 9.75};
  e.innovation_of = {"wheel_speed_radps"};
  e.innovation = {0.25};
  e.innovation_covariance = {0.5};
  e.gated = {1};
  e.kkt_residual = 1e-7;
  e.step_time_us = 3.0;
  e.messages_lost = 1;
  e.messages_rejected = 2;
  return e;
}

// Apart from its caller: inlined into one that knows the size, g++ 12 sees lcm-gen's code read what it has not written.
[[gnu::noinline]] slipstream::estimate decoded(const void* data, int size) {
  slipstream::estimate received;
  EXPECT_EQ(received.decode(data, 0, size), size);
  return received;
}

Estimate there_and_back(const Estimate& e) {
  const slipstream::estimate sent = wire::to_wire(e);
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(sent.getEncodedSize()));
  sent.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return wire::from_wire(decoded(bytes.data(), static_cast<int>(bytes.size())));
}

TEST(EstimateMessage, CarriesTheInterval) {
  const Estimate e = with_interval(), back = there_and_back(e);
  EXPECT_EQ(back.mean, e.mean);
  EXPECT_EQ(back.covariance, e.covariance);
  EXPECT_EQ(back.interval_low, e.interval_low);
  EXPECT_EQ(back.interval_high, e.interval_high);
  EXPECT_EQ(back.innovation_of, e.innovation_of);
  EXPECT_EQ(back.innovation, e.innovation);
  EXPECT_EQ(back.innovation_covariance, e.innovation_covariance);
  EXPECT_EQ(back.gated, e.gated);
  EXPECT_EQ(back.kkt_residual, 1e-7);
  EXPECT_EQ(back.step_time_us, 3.0);
  EXPECT_EQ(back.messages_lost, 1);
  EXPECT_EQ(back.messages_rejected, 2);
}

TEST(EstimateMessage, MayHaveNoInterval) {
  Estimate e = with_interval();
  e.interval_low.clear();
  e.interval_high.clear();
  const Estimate back = there_and_back(e);
  EXPECT_TRUE(back.interval_low.empty());
  EXPECT_TRUE(back.interval_high.empty());
  EXPECT_EQ(back.innovation, e.innovation);
}

TEST(EstimateMessage, RefusesAnIntervalOfAnotherSize) {
  for (const std::size_t size : {1U, 3U}) {
    Estimate e = with_interval();
    e.interval_low.resize(size);
    e.interval_high.resize(size);
    try {
      there_and_back(e);
      FAIL() << "not refused";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "the interval's size is neither 0 nor that of the mean");
    }
  }
}

}  // namespace
}  // namespace slipstream
