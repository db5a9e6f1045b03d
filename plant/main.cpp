// slipstream-plant: plays a scenario's drive, simulated or recorded, on the bus.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <utility>

#include "common/refusal.hpp"
#include "io/bus.hpp"
#include "io/command_line.hpp"
#include "io/interrupt.hpp"
#include "io/recorded_files.hpp"
#include "io/rejections.hpp"
#include "io/scenario_reader.hpp"
#include "plant/conductor.hpp"
#include "plant/drive_messages.hpp"
#include "plant/recorded_drive.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream {
namespace {

class BusStage final : public Stage {
 public:
  explicit BusStage(Bus& bus) : bus_(bus) {}
  void publish(const RunDescriptor& m) override { bus_.publish(m); }
  void publish(const Reading& m) override { bus_.publish(m); }
  void publish(const Truth& m) override { bus_.publish(m); }
  void publish(const Tick& m) override { bus_.publish(m); }
  void poll(int timeout_ms) override { bus_.poll(timeout_ms); }
  void say(const std::string& line) override {
    fmt::print("slipstream-plant: {}\n", line);
    std::fflush(stdout);
  }
  bool interrupted() const override { return slipstream::interrupted(); }

 private:
  Bus& bus_;
};

std::unique_ptr<DriveSource> make_drive(const Scenario& scenario, const std::string& data_dir) {
  if (!scenario.recorded) {
    if (!data_dir.empty())
      throw Refusal(fmt::format("--data: scenario '{}' is simulated and reads no recorded drive", scenario.name));
    return make_simulated_drive(scenario);
  }
  if (data_dir.empty())
    throw Refusal(
        fmt::format("scenario '{}' plays a recorded drive: name the folder with its files by --data DIR", scenario.name));
  return std::make_unique<RecordedDrive>(load_recorded(scenario, data_dir), scenario.run.duration_s);
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> items;
  std::string item;
  for (const char c : list + ",") {
    if (c != ',') {
      item += c;
      continue;
    }
    if (!is_valid_name(item))
      throw Refusal(fmt::format("--wait-for: '{}' is no participant's name; expected NAME[,NAME...] or none", item));
    items.push_back(std::exchange(item, ""));
  }
  return items;
}

int run(int argc, char** argv) {
  std::string path, url = kDefaultLcmUrl, data_dir, wait_for, clock;
  std::vector<std::string> overrides;
  CommandLine line("slipstream-plant", "Plays a scenario's drive, simulated or recorded, on the bus.");
  line.positional("SCENARIO", path, "scenario file (TOML)", true);
  line.option("--set", overrides, "KEY=VALUE in place of the scenario's, e.g. run.seed=7; may be repeated");
  line.option("--clock", clock, "lockstep, realtime or free, in place of the scenario's");
  line.option("--wait-for", wait_for, "participants that must be there before the run starts, NAME[,NAME...] or none");
  line.option("--data", data_dir, "folder with the files of a recorded drive");
  line.option("--lcm-url", url, "the bus");
  line.parse(argc, argv);

  if (url.starts_with("file:")) throw Refusal(fmt::format("--lcm-url: '{}' is a log; a plant needs a network", url));
  if (!clock.empty()) overrides.push_back("run.clock=" + clock);
  LoadedScenario loaded = load_scenario_file(path, overrides);
  Scenario& scenario = loaded.scenario;
  if (!wait_for.empty()) scenario.run.wait_for = wait_for == "none" ? std::vector<std::string>{} : split(wait_for);
  const std::unique_ptr<DriveSource> drive = make_drive(scenario, data_dir);

  catch_interrupts();
  Bus bus(url);
  BusStage stage(bus);
  // Unique per start: a restarted plant is a new run.
  const std::int64_t run_id =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  const RunDescriptor descriptor = descriptor_of(*drive, run_id, loaded.run_name(), loaded.resolved_toml, scenario.run.clock);
  Conductor conductor(scenario.run, descriptor, *drive, stage);
  Rejections rejections;
  Handlers handlers;
  handlers.announcement = [&](const Announcement& a) { conductor.on_announcement(a); };
  handlers.progress = [&](const Progress& p) { conductor.on_progress(p); };
  handlers.control = [&](const Control& c) { conductor.on_control(c); };
  handlers.rejected = [&](const std::string& channel, const std::string& reason) {
    if (const std::string text = rejections.line(channel, reason); !text.empty()) stage.say(text);
  };
  bus.subscribe(handlers);

  stage.say(
      fmt::format("run {} ({}, {} clock)", descriptor.name, scenario.recorded ? "recorded" : "simulated", scenario.run.clock));
  const RunSummary summary = conductor.play();
  stage.say(fmt::format("{} after {:.3f} s of simulation in {:.3f} s, {:.4g} times real time{}",
                        summary.complete ? "finished" : "stopped", summary.simulated_s, summary.wall_s,
                        summary.simulated_s / std::max(summary.wall_s, 1e-9),
                        scenario.run.clock == "realtime" ? fmt::format(" ({} asked for)", scenario.run.realtime_factor) : ""));
  return 0;
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-plant", [&] { return slipstream::run(argc, argv); });
}
