#include "monitor/session.hpp"

#include <gtest/gtest.h>

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

TEST(Session, ANewRunClosesTheOldOne) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.descriptor);  // repeated once a second: the same run
  EXPECT_EQ(t.opened, 1);
  RunDescriptor next = t.descriptor;
  next.header.run_id = 78;
  next.name = "next";
  t.session.handle(next);
  EXPECT_EQ(t.interrupted, std::vector<std::string>{"test-3"});
  EXPECT_EQ(t.opened, 2);
  EXPECT_EQ(t.session.run()->info().name, "next");
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

TEST(RunRecord, NisIsReportedForStepsThatMeasuredEverything) {
  TestRun t;
  t.session.handle(t.descriptor);
  t.session.handle(t.announcement);
  Estimate both = t.estimate(0, 0.0);
  both.innovation_of = {"speed_mps", "a_x_mps2"};
  both.innovation = {1.0, 2.0};
  both.innovation_covariance = {1.0, 0.0, 0.0, 1.0};
  t.session.handle(both);                // NIS 5
  t.session.handle(t.estimate(1, 1.0));  // NIS 1, speed only
  const Scoreboard board = score_run(*t.session.run());
  const EstimatorScore& s = board.estimators[0];
  EXPECT_EQ(s.nis_score.dimension, 2);
  EXPECT_EQ(s.nis_score.samples, 1);
  EXPECT_DOUBLE_EQ(s.nis_score.mean, 5.0);
  EXPECT_DOUBLE_EQ(s.nis_ratio, 2.0);  // (5 + 1)/(2 + 1)
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
  EXPECT_EQ(ekf(t).rejected, 3);
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
