// Participants come late, leave, die and come back; the plant and the others go on.
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "tests/system/bench.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

constexpr Utime kSecond = 1'000'000;

// Does something once, at the first tick at or after `utime`.
std::function<void(const Tick&)> once_at(Utime utime, std::function<void()> action) {
  return [utime, action = std::move(action), done = false](const Tick& t) mutable {
    if (done || t.header.utime < utime) return;
    done = true;
    action();
  };
}

// Every estimate's wheel speed is near the truth of its instant.
void expect_near_truth(const std::vector<Estimate>& estimates, const std::vector<Truth>& truth) {
  std::map<Utime, double> wheel_speed;
  for (const Truth& t : truth) wheel_speed[t.header.utime] = t.value.at(0);
  for (const Estimate& e : estimates) {
    ASSERT_EQ(e.status, EstimateStatus::kValid) << "at " << e.header.utime;
    const double expected = wheel_speed.at(e.header.utime);
    // Five sigma of a single measurement, whose noise is 5 %: it may start from one.
    ASSERT_NEAR(e.mean.at(0), expected, 0.25 * expected) << "at " << e.header.utime;
  }
}

// On both clocks: pause, start an estimator, go on.
void join_late(const std::string& clock, Utime pause_at) {
  Bench bench;
  Observer observer(bench.url, "observer");
  observer.at_tick = once_at(pause_at, [&] { observer.send(Command::kPause); });
  Process plant = bench.plant({kUnimog, "--clock", clock, "--wait-for", "observer,ekf", "--set", "run.duration_s=2"}),
          ekf = bench.estimator({"--once"});
  ASSERT_TRUE(observer.until_paused(pause_at));
  const Utime paused = observer.ticks.back().header.utime;
  Process mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  ASSERT_TRUE(observer.until_follows("mhe"));
  observer.send(Command::kRun);
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &ekf, &mhe}) expect_success(*p);
  // The last estimates come after the end, or with it.
  const auto instants = static_cast<std::size_t>((2 * kSecond - paused) / 10'000);
  observer.until([&] { return observer.estimates["mhe"].size() >= instants && observer.estimates["ekf"].size() >= 201; }, 5.0);

  EXPECT_FALSE(plant.said("is late")) << plant.out();
  EXPECT_TRUE(plant.said("finished after 2.000 s")) << plant.out();
  const std::vector<Estimate>& late = observer.estimates["mhe"];
  ASSERT_EQ(late.size(), instants) << "one for every instant from then on";
  EXPECT_EQ(late.front().header.utime, paused + 10'000);
  EXPECT_EQ(late.front().messages_lost, 0) << "what came before it joined is not lost";
  expect_near_truth(late, observer.truth);
  EXPECT_EQ(observer.estimates["ekf"].size(), 201U) << "the other one missed nothing";
}

TEST(Participants, AnEstimatorJoinsALockstepRunLate) { join_late("lockstep", kSecond); }
TEST(RealTime, AnEstimatorJoinsLate) { join_late("realtime", kSecond / 2); }

TEST(Participants, AKilledEstimatorIsNamedAndAnotherOneTakesPartLater) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Process monitor = bench.monitor(), ekf = bench.estimator({"--once"}), mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  const auto kill = once_at(kSecond, [&] { mhe.kill(); });
  const auto pause = once_at(2 * kSecond, [&] { observer.send(Command::kPause); });
  observer.at_tick = [kill, pause](const Tick& t) mutable {
    kill(t);
    pause(t);
  };
  Process plant = bench.plant(kShort + Arguments{"--wait-for", "observer,ekf,mhe,monitor", "--set", "run.late_timeout_s=1"});
  ASSERT_TRUE(observer.until_paused(2 * kSecond)) << plant.out() << plant.err();
  Process second = bench.estimator({"--name", "second", "--once"});
  ASSERT_TRUE(observer.until_follows("second"));
  observer.send(Command::kRun);
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &ekf, &second, &monitor}) expect_success(*p);

  // It may have died before or after its reply to the tick of 1 s.
  EXPECT_TRUE(std::regex_search(
      plant.out(),
      std::regex("'mhe' is late: nothing from it for 1\\.\\d s after t = (0\\.990|1\\.000|1\\.010) s; going on without it")))
      << plant.out();
  const nlohmann::json scores = bench.scores();
  EXPECT_EQ(scores["run"]["complete"], true);
  EXPECT_EQ(scores["estimators"]["ekf"]["estimates"], 301);
  ASSERT_TRUE(scores["estimators"].contains("mhe")) << "what it delivered is listed";
  EXPECT_GE(scores["estimators"]["mhe"]["estimates"].get<int>(), 99);
  EXPECT_LE(scores["estimators"]["mhe"]["estimates"].get<int>(), 101);
  EXPECT_EQ(scores["estimators"]["second"]["estimates"], 100) << "every instant after 2 s";
}

// An interrupted estimator says goodbye, so nobody waits: the plant's time limit is far beyond the test's.
void leave_by(int signal) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Process ekf = bench.estimator({}), mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  observer.at_tick = once_at(kSecond, [&] {
    mhe.signal(signal);
    EXPECT_EQ(mhe.wait(), 0) << mhe.err();
  });
  Process plant = bench.plant(kShort + Arguments{"--wait-for", "observer,ekf,mhe", "--set", "run.late_timeout_s=1000"});
  ASSERT_TRUE(observer.until_ended()) << plant.out();
  expect_success(plant);
  EXPECT_TRUE(plant.said("'mhe' has left")) << plant.out();
  EXPECT_TRUE(plant.said("finished after 3.000 s")) << plant.out();
  ekf.signal(signal);
  EXPECT_EQ(ekf.wait(), 0) << "without --once it has waited for the next run; " << ekf.err();
}
TEST(Participants, AnEstimatorLeavesOnSigint) { leave_by(SIGINT); }
TEST(Participants, AnEstimatorLeavesOnSigterm) { leave_by(SIGTERM); }

TEST(Participants, AnEstimatorThatComesBackUnderItsNameIsRecordedAgain) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Process monitor = bench.monitor(), first = bench.estimator({"--once"});
  observer.at_tick = once_at(2 * kSecond, [&] {
    first.kill();
    observer.send(Command::kPause);
  });
  Process plant = bench.plant(kShort + Arguments{"--wait-for", "observer,ekf,monitor", "--set", "run.late_timeout_s=1"});
  ASSERT_TRUE(observer.until_paused(2 * kSecond)) << plant.out();
  Process again = bench.estimator({"--once"});
  ASSERT_TRUE(observer.until_follows("ekf"));
  observer.send(Command::kRun);
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &again, &monitor}) expect_success(*p);
  const nlohmann::json ekf = bench.scores()["estimators"]["ekf"];
  EXPECT_GE(ekf["estimates"].get<int>(), 299) << "up to 2 s from the one, from then on from the other";
  EXPECT_EQ(ekf["out_of_order"], 0);
}

// Multicast reaches one receiver before another: an estimator may answer a run's descriptor before the monitor has heard it.
TEST(Participants, TheMonitorKeepsAnAnnouncementThatComesBeforeItsRun) {
  Bench bench;
  Observer observer(bench.url);
  Process monitor = bench.monitor();
  ASSERT_TRUE(observer.until([&] { return !observer.announcements.empty(); }));
  Announcement a;
  a.header = {0, 0, 4711};
  a.name = "quick";
  a.role = "estimator";
  a.algorithm = "ekf";
  a.tuning = "matched";
  a.model = "longitudinal_friction";
  a.state_names = {"speed_mps"};
  a.state_units = {"m/s"};
  observer.bus().publish(a);
  observer.bus().publish(RunDescriptor{{0, 0, 4711}, "quick-run", text_of(kUnimog), "free", {"speed_mps"}, {"m/s"}});
  observer.bus().publish(Truth{{0, 0, 4711}, {1.0}});
  observer.bus().publish(Tick{{0, 0, 4711}, RunState::kRunning});
  observer.bus().publish(Tick{{0, 1, 4711}, RunState::kEnded});
  a.header = {0, 1, 0};
  a.state_names.clear();
  a.state_units.clear();
  a.presence = Presence::kLeft;
  observer.bus().publish(a);
  expect_success(monitor);
  EXPECT_EQ(bench.scores()["estimators"]["quick"]["algorithm"], "ekf") << bench.scores();
}

TEST(Participants, ARestartedPlantIsANewRunForTheSameEstimators) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Process monitor = bench.monitor(), ekf = bench.estimator({});
  const Arguments arguments = kShort + Arguments{"--wait-for", "observer,ekf,monitor"};
  {
    Process plant = bench.plant(arguments);
    observer.at_tick = once_at(kSecond, [&] { plant.kill(); });
    ASSERT_TRUE(observer.until([&] { return !plant.is_running(); }));
  }
  observer.at_tick = nullptr;
  Process plant = bench.plant(arguments);
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &monitor}) expect_success(*p);
  ekf.signal(SIGTERM);
  expect_success(ekf);
  EXPECT_EQ(bench.scores()["run"]["complete"], true);
  EXPECT_EQ(bench.scores()["estimators"]["ekf"]["estimates"], 301);
  const nlohmann::json before = bench.scores("out/earlier-1");
  EXPECT_EQ(before["run"]["complete"], false) << "the first run was cut short, and says so";
}

}  // namespace
}  // namespace slipstream::test
