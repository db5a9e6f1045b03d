// slipstream-import: turns a folder of CSV streams into an LCM log that estimators and monitors read like any other.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "common/refusal.hpp"
#include "io/bus.hpp"
#include "io/command_line.hpp"
#include "io/recorded_files.hpp"
#include "io/scenario_reader.hpp"
#include "plant/drive_messages.hpp"
#include "plant/recorded_drive.hpp"

namespace slipstream {
namespace {

constexpr std::int64_t kRunId = 1;  // the only run of its log; the same files give the same bytes

// The log's own times are those of the run: the time by which everything of an instant has been sent.
class LogSink final : public Sink {
 public:
  explicit LogSink(Bus& log) : log_(log) {}
  void publish(const RunDescriptor& m) override { count(m); }
  void publish(const Reading& m) override { count(m); }
  void publish(const Truth& m) override { count(m); }
  void publish(const Tick& m) override { count(m); }
  std::int64_t messages() const { return messages_; }

 private:
  // A fix that comes late is older than what is before it; the log's times do not go back.
  template <typename M>
  void count(const M& m) {
    newest_ = std::max(newest_, m.header.utime);
    log_.at(newest_);
    log_.publish(m);
    ++messages_;
  }

  Bus& log_;
  std::int64_t messages_ = 0;
  Utime newest_ = 0;
};

int run(int argc, char** argv) {
  std::string path, data_dir, out;
  std::vector<std::string> overrides;
  CommandLine line("slipstream-import", "Turns a folder of CSV streams into an LCM log.");
  line.positional("SCENARIO", path, "scenario file (TOML) whose [recorded] says what the files' columns are", true);
  line.option("--data", data_dir, "folder with the files");
  line.option("--out", out, "the log to write");
  line.option("--set", overrides, "KEY=VALUE in place of the scenario's; may be repeated");
  line.parse(argc, argv);
  if (data_dir.empty()) throw Refusal("--data: missing; name the folder with the CSV files");
  if (out.empty()) throw Refusal("--out: missing; name the log to write");

  const LoadedScenario loaded = load_scenario_file(path, overrides);
  const Scenario& scenario = loaded.scenario;
  if (!scenario.recorded)
    throw Refusal(fmt::format("scenario '{}' is simulated: there is nothing to import without [recorded]", scenario.name));
  RecordedDrive drive(load_recorded(scenario, data_dir), scenario.run.duration_s);

  Bus log = Bus::new_log(out);
  LogSink sink(log);
  const Utime last = publish_whole(drive, descriptor_of(drive, kRunId, loaded.run_name(), loaded.resolved_toml, "free"), sink);
  log.complete();
  fmt::print("slipstream-import: {}: {} messages up to {:.3f} s\n", out, sink.messages(), seconds(last));
  return 0;
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-import", [&] { return slipstream::run(argc, argv); });
}
