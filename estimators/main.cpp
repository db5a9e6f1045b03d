// slipstream-estimator: follows the runs on the bus with one algorithm, and publishes its estimates.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "common/refusal.hpp"
#include "estimators/follower.hpp"
#include "estimators/observability.hpp"
#include "estimators/registry.hpp"
#include "io/bus.hpp"
#include "io/command_line.hpp"
#include "io/interrupt.hpp"
#include "io/rejections.hpp"
#include "io/scenario_reader.hpp"

namespace slipstream {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kAlivePeriod_s = 1.0;
constexpr double kSilence_s = 3.0;  // a plant not heard for so long, not even paused, gives way to another

struct Options {
  std::string algorithm = "ekf", name, tuning, config, url = kDefaultLcmUrl, out;
  bool once = false, with_input = false;
};

class Program {
 public:
  explicit Program(const Options& options) : options_(options), bus_(options.url, options.out) {
    Handlers h;
    h.run = [this](const RunDescriptor& r) { on_run(r); };
    h.tick = [this](const Tick& t) { on_tick(t); };
    h.reading = [this](const Reading& r) {
      if (of_this_run(r.header)) session_->on_reading(r);
    };
    h.rejected = [this](const std::string& channel, const std::string& reason) {
      if (session_) session_->on_rejected();
      if (const std::string text = rejections_.line(channel, reason); !text.empty()) say(text);
    };
    if (options_.with_input)
      h.raw = [this](const std::string& channel, std::int64_t, const void* data, std::size_t size) {
        if (channel != "ESTIMATE_" + options_.name) bus_.publish_raw(channel, data, size);
      };
    bus_.subscribe(h);
  }

  int run() {
    announce(Presence::kJoined);
    bool more = true;
    while (more && !interrupted() && !(options_.once && runs_ended_ > 0)) {
      more = bus_.poll(100);
      if (Clock::now() - announced_ >= std::chrono::duration<double>(kAlivePeriod_s)) announce(Presence::kAlive);
    }
    if (!more && runs_seen_ == 0)
      throw Refusal(fmt::format("{}: the log has no run descriptor; nothing to estimate", options_.url));
    announce(Presence::kLeft);
    if (more && interrupted() && !options_.out.empty())
      throw Refusal(fmt::format("stopped before the end of {}; nothing is written", options_.url));
    bus_.complete();
    return 0;
  }

 private:
  bool is_log() const { return options_.url.starts_with("file:"); }
  bool of_this_run(const Header& h) const { return session_ && h.run_id == run_id_; }

  void on_run(const RunDescriptor& r) {
    const bool same = session_ && r.header.run_id == run_id_;
    if (same && r.header.seq > descriptor_seq_) {
      descriptor_seq_ = r.header.seq;
      heard_ = Clock::now();
      announce(Presence::kAlive);  // somebody has just joined and does not know us yet
      return;
    }
    if (same) say("the run starts again");  // a replay that was broken off
    if (session_ && !same && !is_log() && Clock::now() - heard_ < std::chrono::duration<double>(kSilence_s)) {
      if (std::exchange(other_run_, r.header.run_id) != r.header.run_id)
        say(fmt::format("another plant is on this bus with run {}; ignored while the present run goes on", r.name));
      return;
    }
    LoadedScenario loaded;
    try {
      loaded = load_scenario_text(r.scenario_toml, fmt::format("scenario of run {}", r.name));
    } catch (const Refusal& refusal) {
      if (is_log()) throw;
      // Whoever sent this cannot end who waits for a run that can be read.
      if (std::exchange(unreadable_run_, r.header.run_id) != r.header.run_id)
        say(fmt::format("cannot follow a run: {}", refusal.what()));
      return;
    }
    if (!options_.config.empty()) loaded = with_estimator_config(loaded, options_.config);
    const EstimatorConfig& config = loaded.scenario.estimator;
    tuning_ = options_.tuning.empty() ? config.tuning : options_.tuning;
    session_ = make_follower(options_.algorithm, options_.name, r.header.run_id, loaded.scenario, tuning_,
                             {[this](const Estimate& e) { bus_.publish(e); },
                              [this](const std::string& quantity, const std::string& reason) {
                                if (const std::string text = rejections_.line(quantity, reason); !text.empty()) say(text);
                              },
                              [this](const std::string& line) { say(line); }});
    run_id_ = r.header.run_id;
    descriptor_seq_ = r.header.seq;
    heard_ = Clock::now();
    lockstep_ = r.clock == "lockstep";
    progress_seq_ = 0;
    ++runs_seen_;
    say(fmt::format("follows run {} ({}, tuning {})", r.name, options_.algorithm, tuning_));
    if (config.strapdown) return announce(Presence::kAlive);
    if (const std::string line = observability_line(observability_of(loaded.scenario, config.tunings.at(tuning_)));
        !line.empty())
      say(line);
    announce(Presence::kAlive);
  }

  void on_tick(const Tick& t) {
    if (!of_this_run(t.header)) return;
    heard_ = Clock::now();
    session_->on_tick(t.header.utime);
    if (lockstep_) bus_.publish(Progress{{t.header.utime, progress_seq_++, run_id_}, options_.name});
    if (!is_over(t.state)) return;
    say("the run has ended");
    session_.reset();
    ++runs_ended_;
    if (!options_.once && !is_log()) say("is waiting for a run");
  }

  void announce(Presence presence) {
    Announcement a;
    a.header = {session_ ? std::max<Utime>(session_->processed_utime(), 0) : 0, announce_seq_++, session_ ? run_id_ : 0};
    a.name = options_.name;
    a.role = "estimator";
    a.algorithm = options_.algorithm;
    a.tuning = tuning_;
    if (session_) {
      const ModelNames names = session_->names();
      a.model = names.model;
      for (const Quantity& q : names.states) {
        a.state_names.emplace_back(q.name);
        a.state_units.emplace_back(q.unit);
      }
    }
    a.presence = presence;
    a.instance = instance_;
    bus_.publish(a);
    announced_ = Clock::now();
  }

  void say(const std::string& line) const {
    fmt::print("slipstream-estimator {}: {}\n", options_.name, line);
    std::fflush(stdout);
  }

  const Options options_;
  Bus bus_;
  std::unique_ptr<RunFollower> session_;
  std::int64_t run_id_ = 0, unreadable_run_ = 0, other_run_ = 0, descriptor_seq_ = 0;
  std::string tuning_;
  bool lockstep_ = false;
  const std::int64_t instance_ = process_instance();
  std::int64_t announce_seq_ = 0, progress_seq_ = 0;
  Rejections rejections_;
  int runs_seen_ = 0, runs_ended_ = 0;
  Clock::time_point announced_, heard_;  // last announcement of ours, last tick or descriptor of the run
};

int run(int argc, char** argv) {
  Options o;
  CommandLine line("slipstream-estimator", "Follows the runs on the bus with one algorithm, and publishes its estimates.");
  line.option("--algorithm", o.algorithm, fmt::format("one of: {}", fmt::join(algorithm_names(), ", ")));
  line.option("--name", o.name, "name of this participant, unique on the bus; default: the algorithm");
  line.option("--tuning", o.tuning, "one of the scenario's [tuning.NAME]; default: the scenario's choice");
  line.option("--config", o.config, "file whose [estimator] and [tuning] keys stand in place of the scenario's");
  line.option("--lcm-url", o.url, "the bus, or file://LOG?speed=0 to estimate from a log");
  line.option("--out", o.out, "with a log: the log that the estimates are written to");
  line.flag("--with-input", o.with_input, "with --out: what was read goes there too, so that a monitor can score it");
  line.flag("--once", o.once, "exit at the end of the first run");
  line.parse(argc, argv);

  const std::vector<std::string> known = algorithm_names();
  if (std::find(known.begin(), known.end(), o.algorithm) == known.end())
    throw Refusal(fmt::format("--algorithm: unknown algorithm '{}'; expected one of: {}", o.algorithm, fmt::join(known, ", ")));
  if (o.name.empty()) o.name = o.algorithm;
  if (!is_valid_name(o.name))
    throw Refusal(fmt::format("--name: '{}' is no name; expected 1 to 32 of A-Z a-z 0-9 _ -", o.name));
  if (o.with_input && o.out.empty()) throw Refusal("--with-input: goes with --out");
  if (!o.config.empty() && !std::filesystem::is_regular_file(o.config))
    throw Refusal(fmt::format("{}: no such file", o.config));

  catch_interrupts();
  return Program(o).run();
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-estimator", [&] { return slipstream::run(argc, argv); });
}
