// slipstream-monitor: records a run, scores every estimator against the truth and writes the report.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <optional>

#include "common/refusal.hpp"
#include "io/bus.hpp"
#include "io/command_line.hpp"
#include "io/interrupt.hpp"
#include "io/log_writer.hpp"
#include "io/scenario_reader.hpp"
#include "monitor/live_table.hpp"
#include "monitor/recorder.hpp"
#include "monitor/results.hpp"
#include "monitor/session.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kQuiet_s = 0.3;       // after the end: no message for so long means that everyone is done
constexpr double kLongestEnd_s = 5.0;  // after the end: wait no longer than this
constexpr double kAlivePeriod_s = 1.0;
constexpr double kRedrawPeriod_s = 0.2;

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

struct Options {
  std::string lcm_url = kDefaultLcmUrl;
  std::string out = "out/monitor";
  std::string name = "monitor";
  std::string log_name = "run.lcm";
  std::string published;
};

// What the room's RunInfo needs to know of a scenario.
RunInfo describe(const RunDescriptor& descriptor) {
  RunInfo info;
  const LoadedScenario loaded = load_scenario_text(descriptor.scenario_toml, "scenario of run " + plain_line(descriptor.name));
  const Scenario& scenario = loaded.scenario;
  info.scenario = scenario.name;
  info.description = scenario.description;
  info.scenario_toml = loaded.resolved_toml;
  info.setup = std::make_shared<const Scenario>(scenario);
  info.seed = scenario.run.seed;
  if (scenario.run.duration_s > 0.0) info.duration_s = scenario.run.duration_s;  // of a recorded drive 0 is all of it
  info.deadline_s = scenario.run.deadline_s;
  std::string sensors;
  const auto sensor_fact = [&](const std::string& name, double rate_hz, const std::string& more) {
    if (scenario.run.deadline_s == 0.0 && rate_hz > 0.0)
      info.deadline_s = info.deadline_s == 0.0 ? 1.0 / rate_hz : std::min(info.deadline_s, 1.0 / rate_hz);
    sensors += fmt::format("{}{} at {:g} Hz{}", sensors.empty() ? "" : ", ", name, rate_hz, more);
  };
  const auto fix_fact = [&](const std::string& name, const FixSensor& s) {
    std::string more = fmt::format(" ({:g}, {:g}, {:g} m", s.noise_m[0], s.noise_m[1], s.noise_m[2]);
    if (s.delay_s > 0.0) more += fmt::format(", {:g} s late", s.delay_s);
    for (std::size_t i = 0; i + 1 < s.outages_s.size(); i += 2)
      more += fmt::format(", out from {:g} s to {:g} s", s.outages_s[i], s.outages_s[i + 1]);
    sensor_fact(name, s.rate_hz, more + ")");
  };
  if (scenario.imu)
    sensor_fact("IMU", scenario.imu->rate_hz,
                fmt::format(" ({:g} m/s^2, {:g} rad/s)", scenario.imu->noise_mps2, scenario.imu->noise_radps));
  if (scenario.gnss) fix_fact("GNSS", *scenario.gnss);
  if (scenario.lidar) fix_fact("LIDAR", *scenario.lidar);
  for (const SensorConfig& sensor : scenario.sensors) sensor_fact(sensor.quantity, sensor.rate_hz, "");
  const auto same_noise = [&](const SensorConfig& s) {
    return s.noise.relative == scenario.sensors.front().noise.relative && s.noise.absolute == 0.0;
  };
  const bool only_scalars = !scenario.imu && !scenario.gnss && !scenario.lidar;
  if (only_scalars && !scenario.sensors.empty() && std::all_of(scenario.sensors.begin(), scenario.sensors.end(), same_noise))
    info.noise_percent = 100.0 * scenario.sensors.front().noise.relative;
  if (!scenario.estimator.strapdown)  // which an IMU drives, and nothing else
    std::visit(
        [&](const auto& process) {
          for (const Quantity& input : process.kInputNames) info.input_names.emplace_back(input.name);
        },
        scenario.estimator.process);
  const std::string plant = scenario.recorded
                                ? "recorded drive"
                                : std::visit([](const auto& v) { return std::string(v.kName); }, scenario.plant.vehicle);
  info.facts = {{"Plant", plant}, {"Sensors", sensors}};
  return info;
}

class Monitor {
 public:
  Monitor(const Options& options, std::optional<Published> published)
      : options_(options),
        published_(std::move(published)),
        is_replay_(options.lcm_url.starts_with("file:")),
        is_tty_(::isatty(STDOUT_FILENO) == 1),
        bus_(options.lcm_url),
        session_(options.name,
                 {[this](const RunDescriptor& m) { return safely_described(m); }, [this](const RunRecord& run) { opened(run); },
                  [this](const RunRecord& run) { replaced(run); },
                  [this](const Progress& m) {
                    if (!is_replay_) bus_.publish(m);
                  },
                  [this](const std::string& line) { say(line); }, [this](const std::string& line) { warn(line); }}) {
    Handlers handlers;
    handlers.raw = [this](const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size) {
      // A log is read faster than it was recorded: what is silent and what is alive in it, its own times say.
      session_.set_wall_s(is_replay_ ? seconds(wall_utime) : seconds_since(started_at_));
      if (!is_replay_) recorder_.add(channel, wall_utime, data, size);
    };
    handlers.run = [this](const RunDescriptor& m) { session_.handle(m); };
    handlers.tick = [this](const Tick& m) { session_.handle(m); };
    handlers.truth = [this](const Truth& m) { session_.handle(m); };
    handlers.reading = [this](const Reading& m) { session_.handle(m); };
    handlers.estimate = [this](const Estimate& m) { session_.handle(m); };
    handlers.announcement = [this](const Announcement& m) { session_.handle(m); };
    handlers.rejected = [this](const std::string& channel, const std::string& reason) {
      if (++rejected_ <= 10) say(fmt::format("unusable message on {}: {}", plain_line(channel), plain_line(reason, 200)));
    };
    bus_.subscribe(std::move(handlers));
  }

  int run() {
    announce(Presence::kJoined);
    bool alive = true;
    std::string failure;
    while (alive && failure.empty() && !interrupted() && !is_over()) {
      try {
        alive = bus_.poll(100);
      } catch (const Refusal& refusal) {  // a damaged log, a bus that failed: keep what was received
        failure = refusal.what();
      }
      recorder_.flush();
      if (!is_replay_) {
        session_.set_wall_s(seconds_since(started_at_));
        session_.watch();
      }
      if (seconds_since(announced_at_) >= kAlivePeriod_s) announce(Presence::kAlive);
      if (is_tty_ && session_.run() && seconds_since(drawn_at_) >= kRedrawPeriod_s) draw();
    }
    announce(Presence::kLeft);
    const RunRecord* record = session_.run();
    if (!record && !failure.empty()) throw Refusal(failure);
    if (!record)
      throw Refusal(is_replay_ ? options_.lcm_url + ": no run in this log"
                               : "stopped before any run was seen; nothing is written");
    if (is_tty_) draw();
    finish(*record, options_.out, failure.empty() ? "results are in" : "the results of what could be read were written to");
    if (failure.empty()) return 0;
    throw Refusal(failure);
  }

 private:
  // A scenario that cannot be read costs its facts, not the recording.
  RunInfo safely_described(const RunDescriptor& m) {
    try {
      return describe(m);
    } catch (const Refusal& refusal) {
      fmt::print(stderr, "slipstream-monitor: {}\n", plain_line(refusal.what(), 400));
      RunInfo info;
      info.scenario_toml = m.scenario_toml;
      return info;
    }
  }

  void opened(const RunRecord& run) {
    std::error_code error;
    std::filesystem::create_directories(options_.out, error);
    if (error) throw Refusal(fmt::format("--out: cannot make '{}': {}", plain_line(options_.out), error.message()));
    remove_results(options_.out);
    if (!is_replay_) recorder_.open(options_.out + "/" + options_.log_name);
    opened_at_ = Clock::now();
    ended_ = false;
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    started_utc_ = fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                               utc.tm_hour, utc.tm_min, utc.tm_sec);
    live_.begin_run();
    say(fmt::format("run {} on the {} clock", plain_line(run.info().name), plain_line(run.info().clock)));
    announce(Presence::kAlive);  // the plant may be waiting for us
  }

  // Another run begins: what there is of the old one moves aside, because the new one gets the directory.
  void replaced(const RunRecord& run) {
    if (run.truth().utime.empty() && run.estimators().empty()) return;
    const std::string directory = earlier_directory(options_.out);
    std::filesystem::create_directories(directory);
    const std::int64_t events = recorder_.events();
    recorder_.close_before_newest();
    if (!is_replay_) std::filesystem::rename(options_.out + "/" + options_.log_name, directory + "/" + options_.log_name);
    write(run, directory, false, events);
  }

  void finish(const RunRecord& run, const std::string& directory, const char* said) {
    recorder_.flush();
    const std::int64_t events = recorder_.events();
    recorder_.close();
    write(run, directory, true, events);
    fmt::print("{} {}\n", said, directory);
    std::fflush(stdout);
  }

  void write(const RunRecord& run, const std::string& directory, bool with_figures, std::int64_t events) {
    const Scoreboard board = score_run(run);
    const Clock::time_point end = ended_ ? ended_at_ : Clock::now();
    const WallTimes times{started_utc_, std::chrono::duration<double>(end - opened_at_).count(), session_.ignored(), rejected_,
                          events};
    const Results results{run, board, published_, times};
    write_results(directory, results, with_figures);
    fmt::print("\n{}\n", scoreboard_text(results));
  }

  bool is_over() {
    const RunRecord* run = session_.run();
    if (!run || !run->ended() || is_replay_) return false;  // a log is read to its end
    if (session_.activity() != last_activity_ || !ended_) {
      if (!ended_) ended_at_ = Clock::now();
      ended_ = true;
      last_activity_ = session_.activity();
      active_at_ = Clock::now();
    }
    return seconds_since(ended_at_) > kLongestEnd_s || (seconds_since(active_at_) > kQuiet_s && !run->awaits_estimates());
  }

  void announce(Presence presence) {
    announced_at_ = Clock::now();
    if (is_replay_) return;
    Announcement m;
    const RunRecord* run = session_.run();
    m.header = {run ? run->simulated() : 0, announced_++, run ? run->info().run_id : 0};
    m.name = options_.name;
    m.role = "monitor";
    m.presence = presence;
    m.instance = instance_;
    bus_.publish(m);
  }

  void say(const std::string& line) {
    if (is_tty_ && session_.run()) return;  // the table shows it
    fmt::print("{}\n", line);
    std::fflush(stdout);
  }

  // Below the table, which begins anew under it.
  void warn(const std::string& line) {
    live_.let_scroll();
    fmt::print("{}\n", line);
    std::fflush(stdout);
  }

  void draw() {
    drawn_at_ = Clock::now();
    winsize size{};
    const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    const std::size_t width = known ? std::min<std::size_t>(size.ws_col, 100) : 80;
    fmt::print("{}", live_.redraw(*session_.run(), width));
    std::fflush(stdout);
  }

  const Options& options_;
  std::optional<Published> published_;
  bool is_replay_;
  bool is_tty_;
  Bus bus_;
  Recorder<LogWriter> recorder_;
  LiveTable live_;
  Session session_;
  const Clock::time_point started_at_ = Clock::now();
  Clock::time_point opened_at_, ended_at_, active_at_, announced_at_, drawn_at_;
  std::string started_utc_;
  const std::int64_t instance_ = process_instance();
  std::int64_t announced_ = 0, rejected_ = 0, last_activity_ = -1;
  bool ended_ = false;
};

int run_monitor(int argc, char** argv) {
  Options options;
  CommandLine line("slipstream-monitor", "Records a run, scores every estimator against the truth and writes the report.");
  line.option("--lcm-url", options.lcm_url, "where the bus is; file://LOG?speed=0 scores a log");
  line.option("--out", options.out, "directory for run.lcm, scores.json, series.csv, report.html, scenario.toml");
  line.option("--name", options.name, "name among the participants");
  line.option("--log-name", options.log_name, "file name of the log in the directory");
  line.option("--published", options.published, "JSON file of published values to show beside ours");
  line.parse(argc, argv);
  if (!is_valid_name(options.name))
    throw Refusal(fmt::format("--name: found '{}', expected 1 to 32 characters of A-Z a-z 0-9 _ -", plain_line(options.name)));
  if (!is_safe_name(options.log_name) || options.log_name.starts_with("."))
    throw Refusal(fmt::format("--log-name: found '{}', expected a plain file name", plain_line(options.log_name)));
  require_writable(options.out);
  std::optional<Published> published;
  if (!options.published.empty()) published = load_published(options.published);

  catch_interrupts();
  std::signal(SIGPIPE, SIG_IGN);  // results are written even when nobody reads the terminal output
  return Monitor(options, std::move(published)).run();
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-monitor", [&] { return slipstream::run_monitor(argc, argv); });
}
