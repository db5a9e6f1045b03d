#include "plant/conductor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "common/refusal.hpp"
#include "tests/plant/fake_stage.hpp"

namespace slipstream {
namespace {

constexpr Utime kStep = 10'000;  // 100 Hz

struct Play {
  explicit Play(const std::string& clock, int epochs = 20, Utime dt = kStep) : drive(epochs, dt) {
    run.clock = clock;
    run.late_timeout_s = 30.0;  // far beyond any hiccup of the machine, where a test is not about it
  }
  void prepare() {
    RunDescriptor descriptor;
    descriptor.header.run_id = FakeStage::kRunId;
    descriptor.name = "test-run";
    conductor.emplace(run, descriptor, drive, stage);
    stage.conductor = &*conductor;
  }
  RunSummary play() {
    if (!conductor) prepare();
    return conductor->play();
  }
  bool said(const std::string& pattern) const {
    return std::any_of(stage.lines.begin(), stage.lines.end(),
                       [&](const std::string& line) { return std::regex_match(line, std::regex(pattern)); });
  }

  RunConfig run;
  FakeDrive drive;
  FakeStage stage;
  std::optional<Conductor> conductor;
};

// What holds in every run, whatever the clock and whoever takes part.
void expect_orderly(const FakeStage& stage) {
  std::map<std::string, std::int64_t> next_seq;  // per channel
  Utime ticked = -1, now = -1;
  std::map<Utime, int> in_instant;
  std::map<int, int> between_polls;
  std::int64_t ended_seq = -1;
  for (const Published& p : stage.published) {
    EXPECT_EQ(p.header.run_id, FakeStage::kRunId);
    const std::string channel = std::to_string(p.kind) + (p.kind == Published::kReading ? p.quantity : "");
    const bool repeated = p.kind == Published::kTick && p.header.seq == next_seq[channel] - 1;
    if (!repeated) {
      EXPECT_EQ(p.header.seq, next_seq[channel]++) << channel << " at " << p.header.utime;
    }
    EXPECT_LE(++between_polls[p.polls], 31) << "a queue of LCM's default length holds no more";
    if (p.kind == Published::kDescriptor) continue;
    if (p.kind == Published::kTick) {
      EXPECT_GE(p.header.utime, ticked) << "ticks never go back";
      ticked = p.header.utime;
      if (is_over(p.state)) {
        EXPECT_TRUE(ended_seq == -1 || ended_seq == p.header.seq) << "one end, sent more than once";
        ended_seq = p.header.seq;
      } else {
        EXPECT_EQ(ended_seq, -1) << "nothing comes after the end";
      }
      if (repeated) continue;
    } else {
      EXPECT_GT(p.header.utime, ticked) << "a tick has said that everything up to here was published";
      EXPECT_EQ(ended_seq, -1) << "nothing comes after the end";
      EXPECT_GE(p.header.utime, now);
      now = p.header.utime;
    }
    EXPECT_LE(++in_instant[p.header.utime], 31) << "a queue of LCM's default length holds no more";
  }
  ASSERT_FALSE(stage.published.empty());
  EXPECT_EQ(stage.published.front().kind, Published::kDescriptor);
  EXPECT_TRUE(is_over(stage.published.back().state));
}

std::vector<Utime> instants(const FakeStage& stage, const std::string& quantity) {
  std::vector<Utime> times;
  for (const Published& p : stage.of(Published::kReading))
    if (p.quantity == quantity) times.push_back(p.header.utime);
  return times;
}

void expect_complete(const Play& p, const RunSummary& summary, int epochs, Utime dt) {
  EXPECT_TRUE(summary.complete);
  EXPECT_EQ(p.stage.published.back().state, RunState::kEnded);
  EXPECT_DOUBLE_EQ(summary.simulated_s, 1e-6 * static_cast<double>((epochs - 1) * dt));
  std::vector<Utime> expected;
  for (int k = 0; k < epochs; ++k) expected.push_back(k * dt);
  EXPECT_EQ(instants(p.stage, "drive_torque_nm"), expected);
  EXPECT_EQ(instants(p.stage, "wheel_speed_radps"), expected);
  EXPECT_EQ(p.stage.of(Published::kTruth).size(), static_cast<std::size_t>((epochs + 1) / 2));
}

TEST(Conductor, PlaysTheWholeDriveOnEveryClock) {
  for (const std::string clock : {"lockstep", "realtime", "free"}) {
    Play p(clock);
    p.run.realtime_factor = 10.0;
    const RunSummary summary = p.play();
    expect_complete(p, summary, 20, kStep);
    expect_orderly(p.stage);
    // A tick behind every instant, and three times the end.
    EXPECT_EQ(p.stage.of(Published::kTick).size(), 23u) << clock;
    EXPECT_GE(summary.wall_s, 0.0);
  }
}

TEST(Conductor, AnInstantIsReadingsThenTruthThenItsTick) {
  Play p("free", 1);
  p.play();
  const auto& m = p.stage.published;
  ASSERT_GE(m.size(), 5u);
  EXPECT_EQ(m[0].kind, Published::kDescriptor);
  EXPECT_EQ(m[1].quantity, "drive_torque_nm");
  EXPECT_EQ(m[2].quantity, "wheel_speed_radps");
  EXPECT_EQ(m[3].kind, Published::kTruth);
  EXPECT_EQ(m[4].kind, Published::kTick);
}

// --- Lockstep ---------------------------------------------------------------------------------------------------------

// Before anything of an instant is published, everyone in `names` has answered for the instant before.
void expect_waited_for(const FakeStage& stage, const std::string& name, const std::map<Utime, Utime>& processed_at) {
  ASSERT_FALSE(processed_at.empty()) << name;
  for (const auto& [utime, processed] : processed_at) EXPECT_GE(processed, utime - kStep) << name << " at " << utime;
  EXPECT_FALSE(stage.published.empty());
}

TEST(Conductor, LockstepWaitsForEveryParticipantBeforeTheNextInstant) {
  Play p("lockstep");
  p.prepare();
  p.stage.join("a");
  p.stage.join("b");
  std::map<std::string, std::map<Utime, Utime>> processed_at;  // name -> instant -> answered up to, when its tick went out
  p.stage.on_tick = [&](const Tick& t) {
    for (const std::string& name : p.stage.members)
      processed_at[name].emplace(t.header.utime, p.stage.processed.contains(name) ? p.stage.processed[name] : -kStep);
  };
  expect_complete(p, p.play(), 20, kStep);
  expect_orderly(p.stage);
  for (const char* name : {"a", "b"}) {
    EXPECT_EQ(processed_at[name].size(), 20u);
    expect_waited_for(p.stage, name, processed_at[name]);
  }
}

TEST(Conductor, ATickWhoseAnswerIsMissingIsSentAgain) {
  Play p("lockstep", 5);
  p.prepare();
  p.stage.announce("deaf once", Presence::kJoined);
  std::vector<Tick> at_20ms;
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime == 2 * kStep) at_20ms.push_back(t);
    if (t.header.utime != 2 * kStep || at_20ms.size() == 2)
      p.stage.later(1, [&p, utime = t.header.utime] { p.stage.answer("deaf once", utime); });
  };
  const RunSummary summary = p.play();
  expect_complete(p, summary, 5, kStep);
  expect_orderly(p.stage);
  ASSERT_EQ(at_20ms.size(), 2u);
  EXPECT_EQ(at_20ms[0].header.seq, at_20ms[1].header.seq);
  EXPECT_EQ(at_20ms[1].state, RunState::kRunning);
  EXPECT_FALSE(p.said(".*late.*"));
}

TEST(Conductor, ALateParticipantIsNamedAndDroppedAndTheOthersAreStillWaitedFor) {
  Play p("lockstep");
  p.run.late_timeout_s = 0.3;
  p.prepare();
  p.stage.join("good");
  p.stage.announce("silent", Presence::kJoined);
  std::map<Utime, Utime> processed_at;
  p.stage.on_tick = [&](const Tick& t) {
    processed_at.emplace(t.header.utime, p.stage.processed.contains("good") ? p.stage.processed["good"] : -kStep);
    if (t.header.utime <= 3 * kStep) p.stage.later(1, [&p, utime = t.header.utime] { p.stage.answer("silent", utime); });
  };
  const double start = wall_s();
  const RunSummary summary = p.play();
  expect_complete(p, summary, 20, kStep);
  expect_orderly(p.stage);
  EXPECT_GE(wall_s() - start, 0.3) << "it was given its time";
  // The seconds waited are those of the wall clock: 0.3 and a little, more on a busy machine.
  EXPECT_TRUE(p.said(R"('silent' is late: nothing from it for [0-9]+\.[0-9] s after t = 0\.030 s; going on without it)"))
      << ::testing::PrintToString(p.stage.lines);
  EXPECT_FALSE(p.said("'good' is late.*"));
  EXPECT_EQ(std::count_if(p.stage.lines.begin(), p.stage.lines.end(),
                          [](const std::string& line) { return line.find("late") != std::string::npos; }),
            1);
  expect_waited_for(p.stage, "good", processed_at);
}

TEST(Conductor, WhoWasDroppedComesBackAndIsWaitedForAgain) {
  Play p("lockstep");
  p.run.late_timeout_s = 0.3;
  p.prepare();
  p.stage.announce("slow", Presence::kJoined);
  std::map<Utime, Utime> processed_at;
  p.stage.on_tick = [&](const Tick& t) {
    processed_at.emplace(t.header.utime, p.stage.processed.contains("slow") ? p.stage.processed["slow"] : -kStep);
    if (t.header.utime == 5 * kStep) p.stage.later(1, [&p] { p.stage.announce("slow", Presence::kAlive); });
    // From its return it answers, late within the rules.
    if (t.header.utime >= 6 * kStep) p.stage.later(4, [&p, utime = t.header.utime] { p.stage.answer("slow", utime); });
  };
  expect_complete(p, p.play(), 20, kStep);
  expect_orderly(p.stage);
  EXPECT_EQ(std::count(p.stage.lines.begin(), p.stage.lines.end(), "estimator 'slow' takes part"), 2) << "at first and again";
  std::erase_if(processed_at, [](const auto& entry) { return entry.first <= 6 * kStep; });
  expect_waited_for(p.stage, "slow", processed_at);
}

TEST(Conductor, WhoLeavesIsNotWaitedFor) {
  Play p("lockstep");
  p.prepare();
  p.stage.join("a");
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime != 5 * kStep || !p.stage.members.contains("a")) return;
    p.stage.members.erase("a");
    p.stage.later(3, [&p] { p.stage.announce("a", Presence::kLeft); });
  };
  const RunSummary summary = p.play();
  expect_complete(p, summary, 20, kStep);
  expect_orderly(p.stage);
  EXPECT_TRUE(p.said("estimator 'a' takes part"));
  EXPECT_TRUE(p.said("'a' has left"));
  EXPECT_FALSE(p.said(".*late.*"));
  EXPECT_LT(summary.wall_s, 15.0) << "half of late_timeout_s: nobody waited for it";
}

TEST(Conductor, WhoJoinsOnTheWayIsWaitedForFromThen) {
  Play p("lockstep");
  p.prepare();
  p.stage.join("a");
  std::map<Utime, Utime> processed_at;
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime == 10 * kStep && !p.stage.members.contains("b")) p.stage.later(1, [&p] { p.stage.join("b"); });
    if (t.header.utime > 11 * kStep)
      processed_at.emplace(t.header.utime, p.stage.processed.contains("b") ? p.stage.processed["b"] : -kStep);
  };
  expect_complete(p, p.play(), 20, kStep);
  expect_orderly(p.stage);
  EXPECT_EQ(processed_at.size(), 8u);
  expect_waited_for(p.stage, "b", processed_at);
}

TEST(Conductor, RealtimeAndFreeClocksWaitForNobody) {
  for (const std::string clock : {"realtime", "free"}) {
    Play p(clock);
    p.run.realtime_factor = 10.0;
    p.prepare();
    p.stage.announce("silent", Presence::kJoined);
    const RunSummary summary = p.play();
    expect_complete(p, summary, 20, kStep);
    EXPECT_LT(summary.wall_s, 15.0) << "half of late_timeout_s";
    EXPECT_FALSE(p.said(".*late.*"));
  }
}

// --- Before the start -------------------------------------------------------------------------------------------------

TEST(Conductor, RefusesToStartWithoutThoseItWaitsFor) {
  Play p("lockstep");
  p.run.wait_for = {"ekf", "mhe", "monitor"};
  p.run.start_timeout_s = 0.2;
  p.prepare();
  p.stage.join("mhe");
  std::string message;
  try {
    p.play();
  } catch (const Refusal& r) {
    message = r.what();
  }
  // Word for word but for the seconds, which are the wall clock's: 0 unless the machine stalls.
  EXPECT_TRUE(std::regex_match(message, std::regex("after [0-9]+ s nobody has announced itself as 'ekf', 'monitor'; start it, "
                                                   "or choose others with --wait-for")))
      << message;
  EXPECT_TRUE(p.stage.of(Published::kReading).empty());
  // Those who came hear that nothing will follow.
  const auto ticks = p.stage.of(Published::kTick);
  ASSERT_EQ(ticks.size(), 1U);
  EXPECT_EQ(ticks[0].state, RunState::kStopped);
}

TEST(Conductor, StartsWhenTheLastOneItWaitsForIsThere) {
  Play p("lockstep");
  p.run.wait_for = {"a", "b"};
  p.prepare();
  bool all_there = false;
  p.stage.later(3, [&] { p.stage.join("a"); });
  p.stage.later(10, [&] {
    p.stage.join("b");
    all_there = true;
  });
  p.stage.on_tick = [&](const Tick&) { EXPECT_TRUE(all_there); };
  const RunSummary summary = p.play();
  expect_complete(p, summary, 20, kStep);
  expect_orderly(p.stage);
}

TEST(Conductor, ANewcomerGetsTheRunDescriptor) {
  Play p("lockstep", 5);
  p.prepare();
  std::size_t before = 0, after = 0;
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime != 2 * kStep || before != 0) return;
    p.stage.later(1, [&] {
      before = p.stage.of(Published::kDescriptor).size();
      p.stage.announce("newcomer", Presence::kJoined, 0);  // knows no run yet
      after = p.stage.of(Published::kDescriptor).size();
    });
  };
  expect_complete(p, p.play(), 5, kStep);
  EXPECT_GE(before, 1u);
  EXPECT_EQ(after, before + 1);
  EXPECT_FALSE(p.said(".*newcomer.*")) << "takes part only once it knows the run";
  expect_orderly(p.stage);
}

// --- Pause, step, stop ------------------------------------------------------------------------------------------------

// Pauses after t = 50 ms, then does what `script` says at the 5th, 10th, 15th ... poll of the pause.
struct Paused : Play {
  explicit Paused(const std::string& clock, std::vector<std::function<void(Paused&)>> steps)
      : Play(clock), script(std::move(steps)) {
    run.realtime_factor = 10.0;
    prepare();
    stage.on_tick = [this](const Tick& t) {
      if (t.header.utime == 5 * kStep && t.state == RunState::kRunning && !asked) {
        asked = true;
        stage.command(Command::kPause);
      }
      paused = t.state == RunState::kPaused;
      polls = 0;
    };
    stage.on_poll = [this] {
      if (!paused || ++polls % 5 != 0) return;
      if (next < script.size()) script[next++](*this);
    };
  }
  std::vector<std::function<void(Paused&)>> script;
  std::size_t next = 0;
  bool asked = false, paused = false;
  int polls = 0;
};

TEST(Conductor, PausesStepsAndRunsOn) {
  for (const std::string clock : {"lockstep", "realtime", "free"}) {
    std::vector<std::size_t> readings;  // instants published, at each action
    const auto count = [&](Paused& p) { readings.push_back(instants(p.stage, "drive_torque_nm").size()); };
    Paused p(clock, {[&](Paused& q) {
                       count(q);
                       q.stage.command(Command::kStep);
                     },
                     [&](Paused& q) {
                       count(q);
                       q.stage.command(Command::kStep);
                     },
                     [&](Paused& q) {
                       count(q);
                       q.stage.command(Command::kRun);
                     }});
    const RunSummary summary = p.play();
    expect_complete(p, summary, 20, kStep);
    expect_orderly(p.stage);
    // t = 0 ... 50 ms are six instants; each step is one more.
    EXPECT_EQ(readings, (std::vector<std::size_t>{6, 7, 8})) << clock;
    EXPECT_TRUE(p.said(R"(paused at t = 0\.050 s)")) << clock;
    EXPECT_TRUE(p.said(R"(paused at t = 0\.070 s)")) << clock;
    std::vector<Utime> paused;
    for (const Published& t : p.stage.of(Published::kTick))
      if (t.state == RunState::kPaused) paused.push_back(t.header.utime);
    EXPECT_EQ(paused, (std::vector<Utime>{5 * kStep, 6 * kStep, 7 * kStep})) << clock;
  }
}

TEST(Conductor, StopsWhilePaused) {
  Paused p("lockstep", {[](Paused& q) { q.stage.command(Command::kStop); }});
  const RunSummary summary = p.play();
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(p.stage.published.back().state, RunState::kStopped);
  EXPECT_DOUBLE_EQ(summary.simulated_s, 0.05);
  EXPECT_EQ(instants(p.stage, "drive_torque_nm").size(), 6u);
  expect_orderly(p.stage);
}

TEST(Conductor, StopsOnTheWay) {
  for (const std::string clock : {"lockstep", "realtime", "free"}) {
    Play p(clock);
    p.prepare();
    p.stage.on_tick = [&](const Tick& t) {
      if (t.header.utime == 7 * kStep) p.stage.command(Command::kStop);
    };
    const RunSummary summary = p.play();
    EXPECT_FALSE(summary.complete) << clock;
    EXPECT_EQ(p.stage.published.back().state, RunState::kStopped) << clock;
    EXPECT_DOUBLE_EQ(summary.simulated_s, 0.07) << clock;
    EXPECT_EQ(p.stage.published.back().header.utime, 7 * kStep) << clock;
    expect_orderly(p.stage);
  }
}

TEST(Conductor, AnInterruptEndsTheRunInOrder) {
  Play p("lockstep");
  p.prepare();
  p.stage.on_tick = [&](const Tick& t) { p.stage.interrupt = p.stage.interrupt || t.header.utime == 3 * kStep; };
  const RunSummary summary = p.play();
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(p.stage.published.back().state, RunState::kStopped);
  EXPECT_DOUBLE_EQ(summary.simulated_s, 0.03);
  expect_orderly(p.stage);
}

TEST(Conductor, ControlsForAnotherRunAreIgnored) {
  Play p("free");
  p.prepare();
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime == 3 * kStep) p.stage.command(Command::kStop, FakeStage::kRunId + 1);
    if (t.header.utime == 7 * kStep) p.stage.command(Command::kStop, 0);  // for whatever runs
  };
  EXPECT_DOUBLE_EQ(p.play().simulated_s, 0.07);
}

// A pause before the first instant must not say that the first instant was published: whoever believed it would reject what
// comes then, and lockstep would not wait for who answered it.
TEST(Conductor, APauseBeforeTheStartClaimsNothing) {
  Play p("lockstep", 5);
  p.prepare();
  p.stage.join("a");
  p.stage.command(Command::kPause);
  int polls = 0;
  p.stage.on_poll = [&] {
    if (++polls == 10) p.stage.command(Command::kRun);
  };
  expect_complete(p, p.play(), 5, kStep);
  expect_orderly(p.stage);
}

// A stop is obeyed although someone has not answered: its time to be late is not over.
TEST(Conductor, AStopDoesNotWaitForASilentParticipant) {
  Play p("lockstep");
  p.run.late_timeout_s = 1.5;
  p.prepare();
  p.stage.announce("silent", Presence::kJoined);
  int polls = 0;
  p.stage.on_poll = [&] {
    if (++polls == 5) p.stage.command(Command::kStop);
  };
  const RunSummary summary = p.play();
  EXPECT_FALSE(summary.complete);
  EXPECT_EQ(p.stage.published.back().state, RunState::kStopped);
  EXPECT_FALSE(p.said(".*late.*")) << "waited for all of late_timeout_s";
  EXPECT_LT(summary.wall_s, 1.5);  // late_timeout_s
  expect_orderly(p.stage);
}

// --- Pace -------------------------------------------------------------------------------------------------------------

TEST(Conductor, RealtimeIsNeverFasterThanAskedFor) {
  for (const double factor : {1.0, 4.0}) {
    Play p("realtime", 31);
    p.run.realtime_factor = factor;
    p.prepare();
    const double start = wall_s();
    const RunSummary summary = p.play();
    for (const Published& m : p.stage.of(Published::kReading))
      EXPECT_GE(m.wall_s - start, seconds(m.header.utime) / factor - 1e-9) << factor;  // rounding of the clock's doubles
    // How much slower depends on the machine: ten times and a second means that pacing is broken, not that it is busy.
    EXPECT_LT(summary.wall_s, 10.0 * 0.3 / factor + 1.0) << factor;
    EXPECT_GE(summary.wall_s, 0.3 / factor - 1e-9);
    expect_orderly(p.stage);
  }
}

TEST(Conductor, TimeSpentPausedIsNotCaughtUpWith) {
  const double pause = 0.15;
  double from = 0.0;
  Paused p("realtime", {[&](Paused&) { from = wall_s(); }});
  p.run.realtime_factor = 1.0;
  p.conductor.reset();
  p.prepare();
  const auto on_poll = p.stage.on_poll;
  p.stage.on_poll = [&, on_poll] {
    on_poll();
    if (p.paused && from > 0.0 && wall_s() - from > pause) p.stage.command(Command::kRun);
  };
  const double start = wall_s();
  const RunSummary summary = p.play();
  expect_complete(p, summary, 20, kStep);
  for (const Published& m : p.stage.of(Published::kReading))
    if (m.header.utime > 5 * kStep) {
      EXPECT_GE(m.wall_s - start, seconds(m.header.utime) + pause - 1e-9);  // rounding of the clock's doubles
    }
  EXPECT_LE(summary.wall_s, wall_s() - start - pause) << "the summary does not count the pause";
}

// After a stall realtime catches up at twice the asked pace at most, as the head of conductor.hpp says.
TEST(Conductor, CatchingUpIsNotABurst) {
  Play p("realtime", 100, 1'000);
  p.prepare();
  p.stage.on_tick = [&](const Tick& t) {
    if (t.header.utime == 10'000) std::this_thread::sleep_for(std::chrono::milliseconds(80));
  };
  p.play();
  const auto ticks = p.stage.of(Published::kTick);
  int caught_up = 0;
  for (std::size_t k = 1; k < 100; ++k) {
    const double gap = ticks[k].wall_s - ticks[k - 1].wall_s;
    EXPECT_GE(gap, 0.00049) << k;  // half the interval, less what passes between the test's clock and the conductor's
    if (gap < 0.0009) ++caught_up;
  }
  EXPECT_GT(caught_up, 0) << "an 80 ms stall in 90 instants of 1 ms and no attempt to catch up";
  expect_orderly(p.stage);
}

}  // namespace
}  // namespace slipstream
