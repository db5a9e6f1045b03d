#include "monitor/session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "monitor/scoreboard.hpp"
#include "tests/monitor/fixture.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const EstimatorRecord& ekf(const TestRun& t) { return t.session.run()->estimators().at("ekf"); }

TEST(Session, EveryTickOfALockstepRunIsAnsweredAlsoARepeatedOne) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.handle(Tick{TestRun::header(1), RunState::kEnded});
  ASSERT_EQ(t.replies.size(), 3u);
  EXPECT_EQ(t.replies[1].header.utime, 0);
  EXPECT_EQ(t.replies[2].header.utime, TestRun::kStep);
  EXPECT_EQ(t.replies[2].header.run_id, TestRun::kRun);
  EXPECT_EQ(t.replies[2].header.seq, 2);
  EXPECT_EQ(t.replies[2].name, "monitor");
  EXPECT_TRUE(t.session.run()->ended());
}

TEST(Session, OtherClocksAreNotAnswered) {
  TestRun t("realtime");
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  EXPECT_TRUE(t.replies.empty());
}

TEST(Session, MessagesOfAnotherRunAreIgnoredAndCounted) {
  TestRun t;
  t.session.handle(t.estimate(0, 0.0));  // no run yet
  t.session.handle(t.descriptor);
  Tick other{TestRun::header(5), RunState::kEnded};
  other.header.run_id = 78;
  t.session.handle(other);
  EXPECT_EQ(t.session.ignored(), 2);
  EXPECT_FALSE(t.session.run()->ended());
  EXPECT_TRUE(t.replies.empty());
}

TEST(Session, ImplausibleTimesAreIgnored) {
  TestRun t;
  t.session.handle(t.descriptor);
  for (const std::int64_t utime : {std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()})
    t.session.handle(Tick{{utime, 0, TestRun::kRun}, RunState::kRunning});
  EXPECT_EQ(t.session.ignored(), 2);
}

RunDescriptor other_run(const TestRun& t) {
  RunDescriptor other = t.descriptor;
  other.header.run_id = TestRun::kRun + 1;
  other.name = "next";
  return other;
}

TEST(Session, AnotherPlantIsIgnoredWhileTheRunIsAlive) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.set_wall_s(10.0);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.set_wall_s(12.9);
  for (int i = 0; i < 3; ++i) t.session.handle(other_run(t));
  EXPECT_EQ(t.session.run()->info().name, "test-3");
  EXPECT_EQ(t.session.ignored(), 3);
  EXPECT_EQ(t.said, std::vector<std::string>{"another plant is on this bus: next; ignored while test-3 goes on"});
  EXPECT_TRUE(t.interrupted.empty());
}

TEST(Session, ARunThatIsSilentForThreeSecondsGivesWay) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.descriptor);  // the same run, before its first tick
  EXPECT_EQ(t.opened, 1);
  t.session.set_wall_s(10.0);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.set_wall_s(13.0);
  t.session.handle(other_run(t));
  EXPECT_EQ(t.interrupted, std::vector<std::string>{"test-3"});
  EXPECT_EQ(t.opened, 2);
  EXPECT_EQ(t.session.run()->info().name, "next");
  EXPECT_EQ(t.said, std::vector<std::string>{"another run begins: test-3 is closed, incomplete"});
}

TEST(Session, APausedRunStaysAliveByItsDescriptors) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kPaused});
  for (int i = 1; i <= 10; ++i) {
    t.session.set_wall_s(i);
    t.descriptor.header.seq = i;
    t.session.handle(t.descriptor);
    t.session.watch();
  }
  t.session.handle(other_run(t));
  EXPECT_EQ(t.session.run()->info().name, "test-3");
}

TEST(Session, ARunThatIsOverGivesWayAtOnce) {
  TestRun t;
  t.complete();
  t.session.handle(other_run(t));
  EXPECT_EQ(t.session.run()->info().name, "next");
  EXPECT_EQ(t.said.back(), "another run begins: test-3 is closed, complete");
}

TEST(Session, ARunWhoseTicksCountFromZeroAgainStartsAgain) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  for (int i = 0; i < 3; ++i) {
    t.instant(i, 0.0);
    t.session.handle(Tick{TestRun::header(i), RunState::kRunning});
  }
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  EXPECT_EQ(t.said.back(), "run test-3 starts again");
  EXPECT_EQ(t.interrupted, std::vector<std::string>{"test-3"});
  EXPECT_EQ(t.opened, 2);
  EXPECT_TRUE(t.session.run()->seen_from_start());
  EXPECT_EQ(ekf(t).algorithm, "ekf") << "who was there is still there";
  EXPECT_TRUE(ekf(t).utime.empty());
  t.instant(1, 0.0);
  EXPECT_EQ(ekf(t).utime.size(), 1u);
  EXPECT_EQ(ekf(t).sequence.out_of_order, 0);
}

TEST(Session, ARunWhoseDescriptorsCountFromZeroAgainStartsAgain) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.handle(Tick{TestRun::header(1), RunState::kRunning});
  RunDescriptor repeated = t.descriptor;
  repeated.header.seq = 1;  // once a second: nothing new
  t.session.handle(repeated);
  EXPECT_EQ(t.opened, 1);
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});  // asked again in lockstep
  EXPECT_EQ(t.opened, 2);
  EXPECT_EQ(t.said, std::vector<std::string>{"run test-3 starts again"});
}

TEST(Session, SaysOnceThatThePlantIsSilentAndThatItIsBack) {
  TestRun t;
  t.session.watch();  // no run: nothing to say
  t.session.handle(t.descriptor);
  t.session.handle(Tick{TestRun::header(0), RunState::kRunning});
  for (const double now : {4.9, 5.0, 6.0, 20.0}) {
    t.session.set_wall_s(now);
    t.session.watch();
    EXPECT_EQ(t.said.size(), now < 5.0 ? 0u : 1u) << now;
  }
  t.session.handle(Tick{TestRun::header(1), RunState::kRunning});
  t.session.watch();
  EXPECT_EQ(t.said, (std::vector<std::string>{"no message from the plant for 5 s", "the plant is back"}));
}

TEST(Session, APausedPlantAndOneThatIsDoneMayBeSilent) {
  for (const RunState state : {RunState::kPaused, RunState::kEnded, RunState::kStopped}) {
    TestRun t;
    t.session.handle(t.descriptor);
    t.session.handle(Tick{TestRun::header(0), state});
    t.session.set_wall_s(100.0);
    t.session.watch();
    EXPECT_TRUE(t.said.empty());
  }
}

TEST(Session, EstimatorsThatCameBeforeTheRunAreInIt) {
  TestRun t;
  t.announcement.header.run_id = 0;
  t.session.handle(t.announcement);
  t.session.handle(t.descriptor);
  EXPECT_EQ(ekf(t).algorithm, "ekf");
}

TEST(Session, WhoDoesNotKnowItsModelYetIsNotRejected) {
  TestRun t;
  Announcement early = t.announcement;
  early.header.run_id = 0;
  early.state_names.clear();
  early.state_units.clear();
  t.session.handle(early);
  t.session.handle(t.descriptor);
  t.session.handle(early);
  EXPECT_TRUE(t.session.run()->estimators().empty());
  t.session.handle(t.announcement);
  t.session.handle(early);
  EXPECT_EQ(ekf(t).state_names.size(), 2u);
  EXPECT_EQ(t.session.run()->rejected() + t.session.run()->announcements_rejected(), 0);
}

TEST(Session, SaysWhoJoinsChangesAndLeaves) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  t.announcement.presence = Presence::kAlive;
  t.session.handle(t.announcement);
  Estimate start = t.estimate(0, 0.0);
  start.status = EstimateStatus::kInitialising;
  t.session.handle(start);
  t.session.handle(t.estimate(1, 0.0));
  t.session.handle(t.estimate(2, 0.0));
  t.announcement.presence = Presence::kLeft;
  t.session.handle(t.announcement);
  EXPECT_EQ(t.said, (std::vector<std::string>{"ekf joined: ekf, tuning matched, model point", "ekf is initialising at 0.00 s",
                                              "ekf is valid at 0.10 s", "ekf left"}));
}

TEST(Session, JoinedIsSaidOnceAlgorithmAndTuningAreKnown) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.estimate(0, 0.0));  // its announcement was lost
  Announcement early = t.announcement;
  early.tuning.clear();
  early.model.clear();
  early.state_names.clear();
  early.state_units.clear();
  t.session.handle(early);
  t.session.handle(t.announcement);
  t.session.handle(t.announcement);
  EXPECT_EQ(t.said, (std::vector<std::string>{"ekf is valid at 0.00 s", "ekf joined: ekf, tuning matched, model point"}));
}

TEST(Session, ARestartedEstimatorJoinsAgainAndItsCountsAddUp) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.announcement.instance = 1001;
  t.session.handle(t.announcement);
  Estimate m = t.estimate(0, 0.0);
  m.messages_lost = 3;
  m.messages_rejected = 2;
  t.session.handle(m);
  m = t.estimate(1, 0.0);
  m.messages_lost = 5;
  m.messages_rejected = 2;
  t.session.handle(m);
  t.announcement.instance = 1002;  // killed: no goodbye
  t.session.handle(t.announcement);
  t.session.handle(t.announcement);
  m = t.estimate(2, 0.0);
  m.header.seq = 0;
  m.messages_lost = 1;
  t.session.handle(m);
  EXPECT_EQ(ekf(t).reported_lost(), 6);
  EXPECT_EQ(ekf(t).reported_rejected(), 2);
  EXPECT_EQ(ekf(t).utime.size(), 3u);
  EXPECT_EQ(ekf(t).sequence.out_of_order, 0);
  EXPECT_FALSE(ekf(t).name_conflict);
  const std::string joined = "ekf joined: ekf, tuning matched, model point";
  EXPECT_EQ(t.said, (std::vector<std::string>{joined, "ekf is valid at 0.00 s", joined}));
}

TEST(Session, WhoAnnouncesItselfAgainHasNotStartedAgain) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.announcement.instance = 1001;
  t.session.handle(t.announcement);
  t.session.handle(t.estimate(0, 0.0));
  t.session.handle(t.estimate(1, 0.0));
  t.session.handle(t.announcement);  // kJoined, the same process
  Estimate repeated = t.estimate(2, 0.0);
  repeated.header.seq = 1;
  t.session.handle(repeated);
  EXPECT_EQ(ekf(t).sequence.out_of_order, 1);
}

TEST(Session, TwoEstimatorsOfOneNameAreSaidOnce) {
  TestRun t;
  t.session.handle(t.descriptor);
  for (const std::int64_t instance : {1, 2, 1, 2, 1}) {
    t.announcement.instance = instance;
    t.session.handle(t.announcement);
  }
  EXPECT_TRUE(ekf(t).name_conflict);
  EXPECT_EQ(std::count(t.said.begin(), t.said.end(), "two estimators are named 'ekf'; names must differ"), 1);
  EXPECT_EQ(t.said.size(), 3u) << "and each of them joined once";
}

TEST(Session, TheLateGoodbyeOfAnEarlierProcessIsNoConflict) {
  TestRun t;
  t.session.handle(t.descriptor);
  for (const std::int64_t instance : {1, 2}) {
    t.announcement.instance = instance;
    t.session.handle(t.announcement);
  }
  t.announcement.instance = 1;
  t.announcement.presence = Presence::kLeft;
  t.session.handle(t.announcement);
  EXPECT_FALSE(ekf(t).name_conflict);
  EXPECT_EQ(ekf(t).presence, Presence::kJoined) << "the later one is still there";
}

TEST(Session, TruthWithUnsafeNamesIsNotUsed) {
  TestRun t;
  t.descriptor.truth_names[0] = "speed\"; system(\"x";
  t.session.handle(t.descriptor);
  EXPECT_TRUE(t.session.run()->info().truth_names.empty());
  EXPECT_EQ(t.said, std::vector<std::string>{"the truth of this run is not used: a name in it is not usable"});
}

TEST(RunRecord, OnlyUsableEstimatesAreScored) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  for (int i = 0; i < 5; ++i) t.session.handle(Truth{TestRun::header(i), {seconds(i * TestRun::kStep), 0.5}});
  const EstimateStatus status[] = {EstimateStatus::kInitialising, EstimateStatus::kValid, EstimateStatus::kFallback,
                                   EstimateStatus::kInvalid, EstimateStatus::kValid};
  for (int i = 0; i < 5; ++i) {
    Estimate m = t.estimate(i, i == 1 ? 1.0 : i == 2 ? -3.0 : 100.0);
    m.status = status[i];
    if (i == 4) m.mean[0] = kNan;  // calls itself valid, is not
    t.session.handle(m);
  }
  const Scoreboard board = score_run(*t.session.run());
  const EstimatorScore& s = board.estimators.at(0);
  EXPECT_EQ(s.states[0].score.samples, 2);
  EXPECT_DOUBLE_EQ(s.states[0].score.rmse, std::sqrt(5.0));  // of 1 and -3
  EXPECT_DOUBLE_EQ(s.states[0].max_error_s, 0.2);
  EXPECT_EQ(s.initialising, 1);
  EXPECT_EQ(s.valid, 1);
  EXPECT_EQ(s.fallback, 1);
  EXPECT_EQ(s.invalid, 2);
}

TEST(RunRecord, ConsistencyOfACompleteRun) {
  TestRun t;
  t.complete();
  const Scoreboard board = score_run(*t.session.run());
  const EstimatorScore& s = board.estimators.at(0);
  EXPECT_TRUE(board.complete);
  EXPECT_DOUBLE_EQ(s.nees_score.mean, 0.25);  // speed error 1 of variance 4, friction error 0
  EXPECT_EQ(s.nees_score.dimension, 2);
  EXPECT_DOUBLE_EQ(s.nis_score.mean, 1.0);  // innovation 1 of variance 1
  EXPECT_EQ(s.nis_score.dimension, 1);
  EXPECT_DOUBLE_EQ(s.nis_ratio, 1.0);
  EXPECT_EQ(s.step_times.p50, 105.0);  // of 100 to 110
}

TEST(RunRecord, AStateWithoutTruthIsLeftOutOfNees) {
  TestRun t;
  t.descriptor.truth_names = {"speed_mps", "somethingelse"};
  t.complete();
  const Scoreboard board = score_run(*t.session.run());
  EXPECT_EQ(board.estimators[0].nees_score.dimension, 1);
  EXPECT_EQ(board.estimators[0].states[1].score.samples, 0);
}

// chi2_3 at 0.025 and 0.975 is 0.216 and 9.348 (NIST table).
TEST(RunRecord, NisCoversStepsOfUnequalDimension) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  Estimate both = t.estimate(0, 0.0);
  both.innovation_of = {"speed_mps", "a_x_mps2"};
  both.innovation = {1.0, 2.0};
  both.innovation_covariance = {1.0, 0.0, 0.0, 1.0};
  both.gated = {0, 0};
  t.session.handle(both);                // NIS 5
  t.session.handle(t.estimate(1, 1.0));  // NIS 1, speed only
  Estimate nothing = t.estimate(2, 0.0);
  nothing.innovation_of.clear();
  nothing.innovation.clear();
  nothing.innovation_covariance.clear();
  nothing.gated.clear();
  t.session.handle(nothing);
  const Scoreboard board = score_run(*t.session.run());
  const EstimatorScore& s = board.estimators[0];
  EXPECT_EQ(s.nis_score.samples, 2);
  EXPECT_DOUBLE_EQ(s.nis_score.dimension, 1.5);
  EXPECT_DOUBLE_EQ(s.nis_score.mean, 3.0);
  EXPECT_NEAR(s.nis_score.band.low, 0.216 / 2.0, 5e-4 / 2.0);   // half the last printed digit over N
  EXPECT_NEAR(s.nis_score.band.high, 9.348 / 2.0, 5e-4 / 2.0);  // the same
  EXPECT_DOUBLE_EQ(s.nis_ratio, 2.0);                           // (5 + 1)/(2 + 1)
}

TEST(RunRecord, GapsAndDisorderAreCounted) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  for (const int i : {0, 1, 4, 4, 3, 5}) t.session.handle(t.estimate(i, 0.0));
  EXPECT_EQ(ekf(t).sequence.lost, 2);          // 2 and 3
  EXPECT_EQ(ekf(t).sequence.out_of_order, 2);  // the second 4, and 3 after it
  EXPECT_EQ(ekf(t).utime.size(), 4u);
}

TEST(RunRecord, AnEstimateThatDoesNotFitIsRejected) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  t.session.handle(t.estimate(0, 0.0));
  Estimate wrong = t.estimate(1, 0.0);
  wrong.covariance.pop_back();
  t.session.handle(wrong);
  wrong = t.estimate(2, 0.0);
  wrong.mean = {1.0};
  wrong.covariance = {1.0};
  t.session.handle(wrong);
  wrong = t.estimate(3, 0.0);
  wrong.innovation_of = {"<b>"};
  t.session.handle(wrong);
  wrong = t.estimate(4, 0.0);
  wrong.interval_low = {0.0};
  wrong.interval_high = {1.0};
  t.session.handle(wrong);
  EXPECT_EQ(ekf(t).rejected, 4);
  EXPECT_EQ(ekf(t).utime.size(), 1u);
}

TEST(RunRecord, LateOnlyAgainstAPacedClock) {
  for (const char* clock : {"lockstep", "realtime", "free"}) {
    TestRun t(clock);
    t.session.handle(t.descriptor);
    t.session.handle(t.announcement);
    t.session.handle(Tick{{10'000, 0, TestRun::kRun}, RunState::kRunning});
    t.session.handle(t.estimate(0, 0.0));  // one deadline after its instant: in time
    t.session.handle(Tick{{110'001, 1, TestRun::kRun}, RunState::kRunning});
    t.session.handle(t.estimate(1, 0.0));  // one microsecond more
    EXPECT_EQ(ekf(t).late, clock == std::string("realtime") ? 1 : 0) << clock;
  }
}

TEST(RunRecord, AwaitsTheEstimateOfTheLastMeasurement) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  t.instant(0, 0.0);
  EXPECT_FALSE(t.session.run()->awaits_estimates());
  t.session.handle(Reading{TestRun::header(1), "speed_mps", 0.0});
  EXPECT_TRUE(t.session.run()->awaits_estimates());
  t.announcement.presence = Presence::kLeft;
  t.session.handle(t.announcement);
  EXPECT_FALSE(t.session.run()->awaits_estimates());
}

// The fixes of a strapdown estimator are published under names of their own.
TEST(RunRecord, AwaitsTheEstimateOfTheLastFixAndOfTheLastInertialReading) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  const auto imu = [](int i) { return Reading{TestRun::header(i), "imu", Values(std::array{0.0, 0.0, 9.81, 0.0, 0.0, 0.0})}; };
  const auto gnss = [](int i) { return Reading{TestRun::header(i), "gnss", Values(std::array{48.0, 11.0, 500.0})}; };
  t.session.handle(imu(0));
  t.session.handle(gnss(0));
  Estimate m = t.estimate(0, 0.0);
  m.innovation_of = {"gnss_east_m", "gnss_north_m", "gnss_up_m"};
  m.innovation = {0.1, 0.2, 0.3};
  m.innovation_covariance = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  m.gated = {0, 0, 0};
  t.session.handle(m);
  EXPECT_FALSE(t.session.run()->awaits_estimates());
  t.session.handle(imu(1));
  EXPECT_TRUE(t.session.run()->awaits_estimates());
  t.session.handle(t.estimate(1, 0.0));
  EXPECT_FALSE(t.session.run()->awaits_estimates());
  t.session.handle(gnss(2));
  EXPECT_TRUE(t.session.run()->awaits_estimates());
}

TEST(RunRecord, ALateFixTakesItsPlaceAndIsNoError) {
  TestRun t;
  t.session.handle(t.descriptor);
  int seq = 0;
  for (const int i : {1, 2, 4, 3, 3, 5})  // by the time of the measurement, in the order of sending
    t.session.handle(Reading{{i * TestRun::kStep, seq++, TestRun::kRun}, "gnss", Values(std::array{48.0, 11.0, 500.0 + i})});
  t.session.handle(Reading{{0, 2, TestRun::kRun}, "gnss", Values(std::array{48.0, 11.0, 0.0})});  // sent before
  const ReadingRecord& height = t.session.run()->readings().at("height_m");
  EXPECT_EQ(height.value, (std::vector<double>{501, 502, 503, 504, 505}));
  EXPECT_TRUE(std::is_sorted(height.utime.begin(), height.utime.end()));
  EXPECT_EQ(height.late, 1);
  EXPECT_EQ(height.sequence.out_of_order, 2);  // the second 3, and what was sent before
  EXPECT_EQ(height.sequence.lost, 0);
}

TEST(RunRecord, SensorsAreScoredApartAndWhatIsGatedIsCounted) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  Estimate m = t.estimate(0, 0.0);
  // A fix, a speed, and a second fix that came late and is far off.
  m.innovation_of = {"gnss_east_m", "gnss_north_m", "forward_speed_mps", "gnss_east_m", "gnss_north_m"};
  m.innovation = {1.0, -1.0, 3.0, 100.0, 0.0};
  m.innovation_covariance = {2, 1, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1};
  m.gated = {0, 0, 0, 1, 1};
  t.session.handle(m);
  const Scoreboard board = score_run(*t.session.run());
  const EstimatorScore& s = board.estimators[0];
  EXPECT_DOUBLE_EQ(s.nis_score.mean, 4.25);  // 2 (scores_test.cpp) and 9/4
  EXPECT_EQ(s.nis_score.dimension, 3);
  ASSERT_EQ(s.sensors.size(), 2u);
  EXPECT_EQ(s.sensors[0].sensor, "forward_speed_mps");
  EXPECT_DOUBLE_EQ(s.sensors[0].nis.mean, 2.25);
  EXPECT_EQ(s.sensors[1].sensor, "gnss");
  EXPECT_EQ(s.sensors[1].samples, 2);
  EXPECT_EQ(s.sensors[1].gated, 1);
  EXPECT_DOUBLE_EQ(s.sensors[1].nis.mean, 2.0);
  EXPECT_EQ(s.sensors[1].nis.dimension, 2);
}

TEST(RunningScore, AgreesWithTheFinalOne) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  RunningScore running;
  for (int i = 0; i < 6; ++i) {
    t.session.handle(t.estimate(i, i));  // the estimate comes before its truth
    running.update(*t.session.run(), ekf(t));
    t.session.handle(Truth{TestRun::header(i), {seconds(i * TestRun::kStep), 0.5}});
  }
  running.update(*t.session.run(), ekf(t));
  EXPECT_NEAR(running.rmse(0), std::sqrt(55.0 / 6.0), 1e-12);  // 0 1 4 9 16 25; rounding of t + i - t
  EXPECT_DOUBLE_EQ(running.nis_ratio(), 55.0 / 6.0);
}

}  // namespace
}  // namespace slipstream
