// The plant under command: pause, step, run, stop.
#include <gtest/gtest.h>

#include "tests/system/bench.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

using Heard = std::vector<std::pair<Utime, RunState>>;

Heard heard_since(const Observer& observer, std::size_t from) {
  Heard heard;
  for (std::size_t i = from; i < observer.ticks.size(); ++i)
    heard.emplace_back(observer.ticks[i].header.utime, observer.ticks[i].state);
  return heard;
}

TEST(Control, PausesStepsOneInstantRunsOnAndStops) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Utime stop_at = -1;
  observer.at_tick = [&](const Tick& t) {
    if (t.header.utime == 500'000) observer.send(Command::kPause);
    if (t.header.utime == stop_at) observer.send(Command::kStop);
  };
  Process plant = bench.plant({kUnimog, "--wait-for", "observer"});
  ASSERT_TRUE(observer.until_paused(500'000)) << plant.out();
  EXPECT_EQ(observer.ticks.back().header.utime, 500'000) << "at the very instant, because the plant waited for our reply";

  for (const Utime next : {510'000, 520'000}) {
    const std::size_t from = observer.ticks.size();
    observer.send(Command::kStep);
    ASSERT_TRUE(observer.until_paused(next));
    EXPECT_EQ(heard_since(observer, from), (Heard{{next, RunState::kRunning}, {next, RunState::kPaused}}));
  }
  stop_at = 1'000'000;
  observer.send(Command::kRun);
  ASSERT_TRUE(observer.until_ended());
  expect_success(plant);
  EXPECT_EQ(observer.ticks.back().header.utime, 1'000'000);
  EXPECT_TRUE(plant.said("stopped after 1.000 s")) << plant.out();
  EXPECT_EQ(observer.readings.size(), 3U * 101U) << "every measurement once, whatever the stops on the way";
}

TEST(Control, APauseBeforeTheStartCostsNoMeasurement) {
  Bench bench, undisturbed;
  play_short(undisturbed);
  Observer observer(bench.url);
  Process ekf = bench.estimator({"--once"}), mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  Process plant = bench.plant(kShort);
  ASSERT_TRUE(observer.until_follows("ekf") && observer.until_follows("mhe"));
  observer.send(Command::kPause);  // it still waits for its monitor
  Process monitor = bench.monitor();
  ASSERT_TRUE(observer.until([&] { return plant.said("paused"); })) << plant.out();
  observer.send(Command::kRun);
  for (Process* p : {&plant, &ekf, &mhe, &monitor}) expect_success(*p);
  EXPECT_EQ(without_times(bench.scores()), without_times(undisturbed.scores()));
}

TEST(Control, APauseOnTheWayChangesNoNumber) {
  Bench bench, undisturbed;
  play_short(undisturbed);
  Observer observer(bench.url, "observer");
  observer.at_tick = [&](const Tick& t) {
    if (t.header.utime == 1'000'000) observer.send(Command::kPause);
  };
  Process ekf = bench.estimator({"--once"}), mhe = bench.estimator({"--algorithm", "mhe", "--once"}), monitor = bench.monitor(),
          plant = bench.plant(kShort + Arguments{"--wait-for", "observer,ekf,mhe,monitor"});
  ASSERT_TRUE(observer.until_paused(1'000'000));
  observer.send(Command::kRun);
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &ekf, &mhe, &monitor}) expect_success(*p);
  EXPECT_EQ(bench.scores()["estimators"]["ekf"]["states"], undisturbed.scores()["estimators"]["ekf"]["states"]);
  EXPECT_EQ(bench.scores()["estimators"]["mhe"]["states"], undisturbed.scores()["estimators"]["mhe"]["states"]);
}

TEST(Control, APlantStopsOnSigintAndTheOthersEndInOrder) {
  Bench bench;
  Observer observer(bench.url, "observer");
  Process ekf = bench.estimator({"--once"}), monitor = bench.monitor(),
          plant = bench.plant({kUnimog, "--wait-for", "observer,ekf,monitor"});
  observer.at_tick = [&](const Tick& t) {
    if (t.header.utime == 1'000'000) plant.signal(SIGINT);
  };
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &ekf, &monitor}) expect_success(*p);
  EXPECT_TRUE(plant.said("stopped after 1.000 s")) << plant.out();
  EXPECT_EQ(bench.scores()["run"]["complete"], false) << "10 s were asked for";
}

}  // namespace
}  // namespace slipstream::test
