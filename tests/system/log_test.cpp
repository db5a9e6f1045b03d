// Logs: estimated again without a network, written by the real lcm-logger, played by the real lcm-logplayer.
#include <gtest/gtest.h>

#include <iostream>
#include <lcm/lcm-cpp.hpp>
#include <map>

#include "tests/system/bench.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

using Payloads = std::map<std::string, std::vector<std::string>>;

// What each channel carried, in order.
Payloads payloads_in(const std::string& path) {
  Payloads payloads;
  lcm::LogFile log(path, "r");
  if (!log.good()) return payloads;
  while (const lcm::LogEvent* event = log.readNextEvent())
    payloads[event->channel].emplace_back(static_cast<const char*>(event->data), static_cast<std::size_t>(event->datalen));
  return payloads;
}

void expect_same(const std::vector<Estimate>& found, const std::vector<Estimate>& expected, bool with_rejections = true) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    ASSERT_EQ(bits(found[i], with_rejections), bits(expected[i], with_rejections)) << "estimate " << i;
}

TEST(Log, EstimatedAgainItGivesTheSameBits) {
  Bench bench;
  play_short(bench);
  const std::string log = bench.path("out/run.lcm");
  for (const std::string algorithm : {"ekf", "mhe"}) {
    SCOPED_TRACE(algorithm);
    Process again = bench.from_log(log, {"--algorithm", algorithm, "--out", bench.path(algorithm + ".lcm")});
    expect_success(again);
    const std::vector<Estimate> live = estimates_in(log, algorithm);
    EXPECT_EQ(live.size(), 301U);
    expect_same(estimates_in(bench.path(algorithm + ".lcm"), algorithm), live);
  }
}

TEST(Log, EstimatedAgainItNeedsNoNetwork) {
  Bench bench;
  play_short(bench, {"--set", "run.duration_s=0.5"});
  const std::string log = bench.path("out/run.lcm");
  Process probe = bench.run({"unshare", "-r", "--net", "true"});
  if (probe.wait() != 0) GTEST_SKIP() << "cannot make a network namespace here: " << probe.err();
  Process again = bench.run({"unshare", "-r", "--net", Bench::program("estimator"), "--lcm-url", "file://" + log + "?speed=0",
                             "--out", bench.path("new.lcm")});
  expect_success(again);
  expect_same(estimates_in(bench.path("new.lcm"), "ekf"), estimates_in(log, "ekf"));
}

TEST(Log, TheMonitorScoresItTheSame) {
  Bench bench;
  play_short(bench);
  Process again = bench.run({Bench::program("monitor"), "--lcm-url", "file://" + bench.path("out/run.lcm") + "?speed=0",
                             "--out", bench.path("again")});
  expect_success(again);
  EXPECT_EQ(without_times(bench.scores("again")), without_times(bench.scores()));
}

// A run at 1 kHz with the real lcm-logger beside it. Its queue holds 31 messages, which is 5 ms of such a run: when the machine
// itself halts the logger for longer, messages are gone whatever the plant does. That is the only way to get `false`.
bool logger_has_everything() {
  Bench bench;
  Observer observer(bench.url);
  const std::string log = bench.path("logged.lcm");
  Process logger = bench.run({"lcm-logger", "--lcm-url=" + bench.url, log});
  // The logger hears us once a message of ours is in its file.
  EXPECT_TRUE(observer.until([&] {
    std::error_code none;
    observer.send(Command::kRun);
    return std::filesystem::file_size(log, none) > 0 && !none;
  })) << logger.err();

  Process plant = bench.plant({kUnimog, "--clock", "realtime", "--wait-for", "ekf,monitor", "--set", "run.duration_s=2",
                               "--set", "sensor.wheel_speed.rate_hz=1000", "--set", "sensor.accelerometer.rate_hz=1000",
                               "--set", "plant.input_rate_hz=1000", "--set", "plant.truth_rate_hz=1000"}),
          monitor = bench.monitor(), ekf = bench.estimator({"--once"});
  for (Process* p : {&plant, &ekf, &monitor}) expect_success(*p);
  logger.signal(SIGTERM);
  logger.wait();

  Payloads logged = payloads_in(log), recorded = payloads_in(bench.path("out/run.lcm"));
  bool everything = logged["TICK"] == recorded["TICK"];
  for (const char* channel : {"DRIVE_TORQUE", "SENSOR_WHEEL_SPEED", "SENSOR_ACCELEROMETER", "TRUTH", "ESTIMATE_ekf"}) {
    EXPECT_EQ(recorded[channel].size(), 2001U) << channel << ", our own log: 2 s at 1 kHz, both ends included";
    everything = everything && logged[channel] == recorded[channel];
    if (logged[channel].size() < 2001) std::cout << channel << ": the logger has " << logged[channel].size() << " of 2001\n";
  }
  if (!everything) return false;
  // Our own numbers say the same: the estimator, on the logger's file, misses none.
  Process again = bench.from_log(log, {"--out", bench.path("new.lcm")});
  expect_success(again);
  const std::vector<Estimate> estimates = estimates_in(bench.path("new.lcm"), "ekf");
  EXPECT_EQ(estimates.size(), 2001U);
  for (const Estimate& e : estimates) EXPECT_EQ(e.messages_lost, 0);
  expect_same(estimates, estimates_in(log, "ekf"));
  return true;
}

TEST(RealTime, LcmLoggerLosesNothingAtAKilohertz) {
  // A second and a third chance are for halts of the machine; a plant that sends bursts fails them all.
  bool everything = false;
  for (int attempt = 0; attempt < 3 && !everything && !HasFailure(); ++attempt) everything = logger_has_everything();
  EXPECT_TRUE(everything);
}

TEST(RealTime, LcmLogplayerFeedsLiveEstimators) {
  Bench bench;
  {
    Process plant = bench.plant({kUnimog, "--clock", "realtime", "--wait-for", "ekf,monitor", "--set", "run.duration_s=2",
                                 "--set", "run.realtime_factor=2"}),
            monitor = bench.monitor(), ekf = bench.estimator({"--once"});
    for (Process* p : {&plant, &ekf, &monitor}) expect_success(*p);
  }
  Observer observer(bench.url);
  Process ekf = bench.estimator({"--name", "ekf2", "--once"}),
          mhe = bench.estimator({"--algorithm", "mhe", "--name", "mhe2", "--once"});
  ASSERT_TRUE(observer.until([&] { return observer.announcements.size() >= 2; }));
  Process player = bench.run({"lcm-logplayer", "-s", "0.5", "-l", bench.url, bench.path("out/run.lcm")});
  for (Process* p : {&player, &ekf, &mhe}) expect_success(*p);
  ASSERT_TRUE(observer.until([&] {
    return observer.estimates["mhe2"].size() >= 201 && observer.estimates["ekf2"].size() >= 201;
  })) << "2 s at 100 Hz, both ends included; found "
      << observer.estimates["ekf2"].size() << " and " << observer.estimates["mhe2"].size();
  EXPECT_EQ(observer.estimates["mhe2"].back().messages_lost, 0);
  std::vector<Estimate> played = observer.estimates["ekf2"];
  for (Estimate& e : played) e.name = "ekf";
  expect_same(played, estimates_in(bench.path("out/run.lcm"), "ekf"));
}

}  // namespace
}  // namespace slipstream::test
