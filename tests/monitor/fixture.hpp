// A small run for the tests of this room, said message by message to a Session, and what comes back.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "monitor/results.hpp"
#include "monitor/session.hpp"

namespace slipstream {

// Truth: speed_mps = t, friction = 0.5. One instant every 100 ms. The estimator "ekf" knows both.
class TestRun {
 public:
  explicit TestRun(std::string clock = "lockstep")
      : session(
            "monitor",
            {[this](const RunDescriptor& m) {
               RunInfo info;
               info.scenario = "test";
               info.scenario_toml = m.scenario_toml;
               info.setup = scenario;
               info.seed = 3;
               info.duration_s = 1.0;
               info.deadline_s = 0.01;
               info.noise_percent = 5.0;
               info.input_names = {"drive_torque_nm"};
               return info;
             },
             [this](const RunRecord&) { ++opened; }, [this](const RunRecord& run) { interrupted.push_back(run.info().name); },
             [this](const Progress& m) { replies.push_back(m); }, [this](const std::string& line) { said.push_back(line); },
             [this](const std::string& line) { said.push_back(line); }}) {
    descriptor.header.run_id = kRun;
    descriptor.name = "test-3";
    descriptor.scenario_toml = "name = \"test\"\n";
    descriptor.clock = std::move(clock);
    descriptor.truth_names = {"speed_mps", "friction"};
    descriptor.truth_units = {"m/s", "1"};
    announcement.header.run_id = kRun;
    announcement.name = "ekf";
    announcement.role = "estimator";
    announcement.algorithm = "ekf";
    announcement.tuning = "matched";
    announcement.model = "point";
    announcement.state_names = {"speed_mps", "friction"};
    announcement.state_units = {"m/s", "1"};
  }

  static Header header(int i) { return {i * kStep, i, kRun}; }

  // speed_error is the estimate's; the speed's variance is 4, that of the innovation 1.
  Estimate estimate(int i, double speed_error) const {
    Estimate m;
    m.header = header(i);
    m.name = announcement.name;
    m.status = EstimateStatus::kValid;
    m.mean = {seconds(m.header.utime) + speed_error, 0.5};
    m.covariance = {4.0, 0.0, 0.0, 1.0};
    m.innovation_of = {"speed_mps"};
    m.innovation = {speed_error};
    m.innovation_covariance = {1.0};
    m.gated = {0};
    m.step_time_us = 100.0 + i;
    return m;
  }

  void instant(int i, double speed_error) {
    session.handle(Reading{header(i), "drive_torque_nm", 10.0});
    session.handle(Reading{header(i), "speed_mps", seconds(header(i).utime)});
    session.handle(Truth{header(i), {seconds(header(i).utime), 0.5}});
    session.handle(estimate(i, speed_error));
  }

  // Eleven instants, errors +1 and -1 in turn, and the end.
  void complete() {
    session.handle(descriptor);
    session.handle(announcement);
    for (int i = 0; i <= 10; ++i) {
      instant(i, i % 2 == 0 ? 1.0 : -1.0);
      session.handle(Tick{header(i), i == 10 ? RunState::kEnded : RunState::kRunning});
    }
  }

  static constexpr std::int64_t kRun = 77;
  static constexpr Utime kStep = 100'000;
  std::shared_ptr<const Scenario> scenario;  // null: not known
  RunDescriptor descriptor;
  Announcement announcement;
  int opened = 0;
  std::vector<std::string> interrupted, said;
  std::vector<Progress> replies;
  Session session;
};

// Results of a run, with everything they refer to.
struct TestResults {
  explicit TestResults(const Session& session, std::optional<Published> p = std::nullopt)
      : board(score_run(*session.run())), published(std::move(p)), results{*session.run(), board, published, times} {}
  Scoreboard board;
  std::optional<Published> published;
  WallTimes times{"2000-01-01T00:00:00Z", 2.0, 0, 0, 0};
  Results results;
};

}  // namespace slipstream
