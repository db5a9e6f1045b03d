// From messages to steps: what belongs to one instant, how inputs are averaged, who starts from what, and what is counted.
#include "estimators/session.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "models/processes/longitudinal_friction.hpp"

namespace slipstream::test {
namespace {

// Writes down the steps it is given.
class Spy final : public Estimator {
 public:
  struct Step {
    double dt_s, input;
    std::vector<double> z;
    std::uint32_t measured;
  };
  std::vector<Step> steps;
  int given = 0;
  std::vector<double> started_from;

  ModelNames names() const override {
    using M = LongitudinalFriction;
    return {M::kName, M::kStateNames, M::kInputNames, M::kOutputNames, wants_inputs_at_end};
  }
  static inline bool wants_inputs_at_end = false;  // read when the session opens
  void start_given() override { ++given; }
  bool start_measured(int output, double z) override {
    if (output != 0) return false;
    started_from.push_back(z);
    return true;
  }
  void step(const StepInput& s) override {
    steps.push_back({s.dt_s, s.input[0], {s.measured_value.begin(), s.measured_value.end()}, s.measured});
  }
  EstimateStatus status = EstimateStatus::kValid;
  Posterior posterior() const override {
    static constexpr std::array<double, 9> kNumbers{};
    return {status, {kNumbers.data(), 3}, {kNumbers.data(), 9}, {kNumbers.data(), 2}, {kNumbers.data(), 4}};
  }
};

class Session : public testing::Test {
 protected:
  void open(const std::string& start = "given") {
    Scenario scenario;
    scenario.sensors = {{"wheel_speed", "wheel_speed_radps", 100.0, {}}, {"accelerometer", "a_x_mps2", 100.0, {}}};
    Tuning tuning;
    tuning.start = start;
    auto spy = std::make_unique<Spy>();
    spy_ = spy.get();
    session_ = std::make_unique<EstimatorSession>("spy", 7, scenario, tuning, std::move(spy),
                                                  [this](const Estimate& e) { estimates_.push_back(e); });
  }
  void say(const std::string& quantity, Utime utime, std::int64_t seq, double value) {
    session_->on_reading({{utime, seq, 7}, quantity, value});
  }
  void torque(Utime utime, std::int64_t seq, double value) { say("drive_torque_nm", utime, seq, value); }
  void wheel(Utime utime, std::int64_t seq, double value) { say("wheel_speed_radps", utime, seq, value); }
  void acceleration(Utime utime, std::int64_t seq, double value) { say("a_x_mps2", utime, seq, value); }

  std::unique_ptr<EstimatorSession> session_;
  Spy* spy_ = nullptr;
  std::vector<Estimate> estimates_;
};

// A model that asks for it is told what the torque is at the measurement, not what it was before.
TEST_F(Session, AModelMayWantTheInputsAtTheStepsInstant) {
  Spy::wants_inputs_at_end = true;
  open();
  Spy::wants_inputs_at_end = false;
  torque(0, 0, 100.0), wheel(0, 0, 0.5);
  torque(10000, 1, 300.0), wheel(10000, 1, 0.6);
  wheel(20000, 2, 0.7);  // no new torque: the last one holds
  torque(25000, 2, 500.0);
  wheel(30000, 3, 0.8);
  session_->on_tick(30000);
  ASSERT_EQ(spy_->steps.size(), 4U);
  EXPECT_EQ(spy_->steps[0].input, 100.0);
  EXPECT_EQ(spy_->steps[1].input, 300.0);
  EXPECT_EQ(spy_->steps[2].input, 300.0);
  EXPECT_EQ(spy_->steps[3].input, 500.0);
}

TEST_F(Session, OneInstantIsOneStepWhateverTheOrderInIt) {
  open();
  acceleration(0, 0, 1.5);
  torque(0, 0, 100.0);
  wheel(0, 0, 0.5);
  EXPECT_TRUE(spy_->steps.empty());  // not before the instant is known to be complete
  session_->on_tick(0);
  ASSERT_EQ(spy_->steps.size(), 1U);
  EXPECT_EQ(spy_->steps[0].measured, 3U);
  EXPECT_EQ(spy_->steps[0].dt_s, 0.0);
  EXPECT_EQ(spy_->steps[0].z, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(spy_->given, 1);
  ASSERT_EQ(estimates_.size(), 1U);
  EXPECT_EQ(estimates_[0].innovation_of, (std::vector<std::string>{"wheel_speed_radps", "a_x_mps2"}));
}

TEST_F(Session, ALaterMessageClosesAnInstantWithoutATick) {
  open();
  torque(0, 0, 100.0);
  wheel(0, 0, 0.5);
  wheel(10'000, 1, 0.6);
  ASSERT_EQ(spy_->steps.size(), 1U);
  session_->on_tick(10'000);
  ASSERT_EQ(spy_->steps.size(), 2U);
  EXPECT_DOUBLE_EQ(spy_->steps[1].dt_s, 0.01);
}

TEST_F(Session, InputsHoldUntilTheNextAndStepsTakeTheirMeanOverTheTimeThatPassed) {
  open();
  torque(0, 0, 100.0);
  wheel(0, 0, 0.5);
  torque(4'000, 1, 200.0);
  torque(7'000, 2, 400.0);
  wheel(10'000, 1, 0.6);
  torque(10'000, 3, 999.0);  // from now on: not part of the interval that ends here
  session_->on_tick(10'000);
  ASSERT_EQ(spy_->steps.size(), 2U);
  EXPECT_NEAR(spy_->steps[1].input, (100.0 * 4 + 200.0 * 3 + 400.0 * 3) / 10.0, 1e-9);  // rounding
  wheel(30'000, 2, 0.6);
  session_->on_tick(30'000);
  EXPECT_NEAR(spy_->steps[2].input, 999.0, 1e-9);
  EXPECT_DOUBLE_EQ(spy_->steps[2].dt_s, 0.02);
  EXPECT_EQ(estimates_.size(), 3U);  // an input alone publishes nothing
}

TEST_F(Session, NothingIsEstimatedBeforeTheInputIsKnown) {
  open();
  wheel(0, 0, 0.5);
  session_->on_tick(0);
  EXPECT_TRUE(spy_->steps.empty());
  ASSERT_EQ(estimates_.size(), 1U);
  EXPECT_EQ(estimates_[0].status, EstimateStatus::kInitialising);
}

TEST_F(Session, WhoJoinsLateStartsFromAMeasurementAndUsesItOnce) {
  open("given");
  torque(5'000'000, 500, 100.0);
  acceleration(5'000'000, 500, 1.0);
  session_->on_tick(5'000'000);
  EXPECT_TRUE(spy_->steps.empty());  // an acceleration fixes no start
  torque(5'010'000, 501, 100.0);
  acceleration(5'010'000, 501, 1.0);
  wheel(5'010'000, 501, 9.0);
  session_->on_tick(5'010'000);
  EXPECT_EQ(spy_->given, 0);
  EXPECT_EQ(spy_->started_from, (std::vector<double>{9.0}));
  ASSERT_EQ(spy_->steps.size(), 1U);
  EXPECT_EQ(spy_->steps[0].measured, 2U);         // only the acceleration: the wheel speed is in the start already
  EXPECT_EQ(estimates_.back().messages_lost, 0);  // what was sent before joining is not lost
}

TEST_F(Session, CountsWhatIsLostAndRefusesWhatIsOldRepeatedOrNotANumber) {
  open();
  torque(0, 0, 100.0);
  wheel(0, 0, 0.5);
  session_->on_tick(0);
  wheel(40'000, 4, 0.7);  // 1, 2 and 3 are missing
  session_->on_tick(40'000);
  EXPECT_EQ(estimates_.back().messages_lost, 3);
  wheel(20'000, 2, 0.6);  // too late
  wheel(50'000, 4, 0.8);  // its number was there before
  acceleration(50'000, 0, std::numeric_limits<double>::quiet_NaN());
  wheel(60'000, 5, 0.9);
  session_->on_tick(60'000);
  EXPECT_EQ(estimates_.back().messages_rejected, 3);
  EXPECT_EQ(estimates_.back().messages_lost, 3);
  EXPECT_EQ(spy_->steps.size(), 3U);
  EXPECT_EQ(spy_->steps.back().measured, 1U);
}

TEST_F(Session, AnInvalidEstimateIsPublishedAndTheNextMeasurementStartsAgain) {
  open();
  torque(0, 0, 100.0);
  wheel(0, 0, 0.5);
  session_->on_tick(0);
  spy_->status = EstimateStatus::kInvalid;
  wheel(10'000, 1, 0.6);
  session_->on_tick(10'000);
  EXPECT_EQ(estimates_.back().status, EstimateStatus::kInvalid);
  spy_->status = EstimateStatus::kValid;
  wheel(50'000, 2, 0.7);
  session_->on_tick(50'000);
  EXPECT_EQ(spy_->started_from, (std::vector<double>{0.7}));
  EXPECT_EQ(spy_->steps.back().dt_s, 0.0);
  EXPECT_EQ(estimates_.back().status, EstimateStatus::kValid);
}

TEST_F(Session, QuantitiesThatTheModelDoesNotUseAreIgnored) {
  open();
  say("temperature_k", 0, 0, 300.0);
  session_->on_tick(0);
  EXPECT_TRUE(estimates_.empty());
}

}  // namespace
}  // namespace slipstream::test
