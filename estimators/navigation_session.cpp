#include "estimators/navigation_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "common/chi_square.hpp"
#include "common/readings.hpp"

namespace slipstream {
namespace {

constexpr double kLost_s = 2.0;              // every fix left out for so long, ...
constexpr int kLostFixes = 10;               // and at least so many
constexpr double kLongestGap_s = 30.0;       // without any event: where the vehicle is then, nobody knows
constexpr std::size_t kMostPending = 65536;  // readings that no tick has come for
constexpr std::size_t kMostHistory = 20000;  // 50 MB: 10 s at 1 kHz
constexpr std::size_t kMostNoted = 20;       // innovations of an estimate: a monitor takes 64 numbers
constexpr std::int64_t kMostLost = std::int64_t{1} << 53;
constexpr double kGrace_s = 0.1;  // whoever hears the IMU so early has heard the beginning of the run
constexpr Utime kNonholonomicPeriod = 100'000;
constexpr const char* kRepeated = "one of the same time is there already";
constexpr const char* kForwardSpeed = "forward_speed_mps";

InertialNoise noise_of(const Scenario& scenario, const StrapdownTuning& tuning) {
  const bool given = tuning.noise == "given";
  const Imu& imu = *scenario.imu;
  const double f = given ? tuning.accelerometer_mps2 : imu.noise_mps2, w = given ? tuning.gyro_radps : imu.noise_radps;
  const double f_walk = given ? tuning.accelerometer_bias_walk_mps2 : imu.bias_walk_mps2;
  const double w_walk = given ? tuning.gyro_bias_walk_radps : imu.bias_walk_radps;
  const double biased = tuning.biases ? 1.0 : 0.0;
  return {f * f, w * w, biased * f_walk * f_walk, biased * w_walk * w_walk};
}

// Events in `span`, with as much again to spare.
std::size_t capacity_for(const Scenario& scenario, const StrapdownTuning& tuning) {
  double rate_hz = scenario.imu->rate_hz + 100.0;
  if (scenario.gnss) rate_hz += scenario.gnss->rate_hz;
  if (scenario.lidar) rate_hz += scenario.lidar->rate_hz;
  return std::min(static_cast<std::size_t>(2.0 * rate_hz * tuning.history_s) + 64, kMostHistory);
}

// Of a measurement with 1, 2, 3 rows.
std::array<double, 3> gates_of(double probability) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (probability == 0.0) return {kNone, kNone, kNone};
  return {chi_square_quantile(probability, 1), chi_square_quantile(probability, 2), chi_square_quantile(probability, 3)};
}

// Nearly always they are in order: then nothing is moved, and no buffer allocated.
void sort_by_time(std::vector<NavigationEvent>& events) {
  if (!std::is_sorted(events.begin(), events.end())) std::stable_sort(events.begin(), events.end());
}

std::string name_of(NavigationEventKind kind) {
  switch (kind) {
    case NavigationEventKind::kImu:
      return std::string(kImu);
    case NavigationEventKind::kGnss:
      return std::string(kGnss);
    case NavigationEventKind::kLidar:
      return std::string(kLidar);
    case NavigationEventKind::kSpeed:
      return kForwardSpeed;
    case NavigationEventKind::kClock:
      break;
  }
  return "clock";
}

}  // namespace

NavigationSession::NavigationSession(std::string name, std::int64_t run_id, const Scenario& scenario,
                                     const StrapdownTuning& tuning, std::unique_ptr<NavigationFilter> filter, FollowHooks hooks)
    : name_(std::move(name)),
      run_id_(run_id),
      tuning_(tuning),
      filter_(std::move(filter)),
      hooks_(std::move(hooks)),
      world_(scenario.world.origin),
      frames_(*scenario.estimator.strapdown, tuning, noise_of(scenario, tuning).w),
      imu_period_s_(1.0 / scenario.imu->rate_hz),
      process_(*filter_, noise_of(scenario, tuning), imu_period_s_, scenario.estimator.strapdown->gravity_mps2,
               gates_of(tuning.gate)),
      history_(process_, capacity_for(scenario, tuning), utime_of(tuning.history_s)),
      start_(frames_, *filter_, process_) {
  const Strapdown& model = *scenario.estimator.strapdown;
  const bool given = tuning.noise == "given";
  channels_[std::string(kImu)].kind = NavigationEventKind::kImu;
  if (scenario.gnss) {
    channels_[std::string(kGnss)] = {NavigationEventKind::kGnss, tuning.use_gnss};
    gnss_.l = frames_.in_imu_frame(model.gnss_position_m);
    gnss_.R = (given ? tuning.gnss_m : scenario.gnss->noise_m).cwiseAbs2().asDiagonal();
    start_lag_ = std::max(start_lag_, utime_of(scenario.gnss->delay_s));
  }
  if (scenario.lidar) {
    channels_[std::string(kLidar)] = {NavigationEventKind::kLidar, tuning.use_lidar};
    lidar_.l = frames_.in_imu_frame(model.lidar_position_m);
    lidar_map_ = from_rpy(model.lidar_map_rpy_rad).toRotationMatrix();
    lidar_offset_ = model.lidar_map_offset_m;
    const Vector3 variance = (given ? tuning.lidar_m : scenario.lidar->noise_m).cwiseAbs2();
    lidar_.R = lidar_map_ * variance.asDiagonal() * lidar_map_.transpose();
    start_lag_ = std::max(start_lag_, utime_of(scenario.lidar->delay_s));
  }
  if (scenario.recorded)
    for (const RecordedGroup& g : scenario.recorded->groups)
      if (g.quantity != kImu) start_lag_ = std::max(start_lag_, utime_of(g.lag_s));
  start_lag_ = std::min(start_lag_, utime_of(tuning.history_s));

  speed_.kind = NavigationMeasurement::kBodyVelocity;
  speed_.l = frames_.in_imu_frame(Vector3::Zero());
  speed_.R_BS = frames_.R_BS();
  speed_.R.diagonal().setConstant(tuning.nonholonomic_mps * tuning.nonholonomic_mps);
  for (const SensorConfig& s : scenario.sensors) {
    if (s.quantity != kForwardSpeed) continue;
    channels_[kForwardSpeed] = {NavigationEventKind::kSpeed, tuning.use_forward_speed};
    speed_noise_ = given ? NoiseLaw{0.0, tuning.forward_speed_mps} : s.noise;
    if (speed_noise_.variance(0.0) == 0.0 && tuning.use_forward_speed)
      speed_noise_.absolute = tuning.forward_speed_mps;  // at standstill a noise in per cent vanishes, which nothing can weigh
  }
  nonholonomic_alone_ = tuning.nonholonomic && !(channels_.contains(kForwardSpeed) && tuning.use_forward_speed);
  pending_.reserve(256);
  noted_.reserve(kMostNoted);
  message_.name = name_;
}

ModelNames NavigationSession::names() const {
  const std::size_t n = tuning_.biases ? Strapdown::kStates : Strapdown::kStatesWithoutBiases;
  return {Strapdown::kName, std::span(Strapdown::kStateNames).first(n), {}, Strapdown::kOutputNames};
}

void NavigationSession::refuse(const std::string& quantity, const std::string& reason) {
  ++rejected_;
  if (hooks_.complain) hooks_.complain(quantity, reason);
}

NavigationEvent NavigationSession::event_of(const Channel& channel, const Reading& r) {
  NavigationEvent e;
  e.utime = r.header.utime;
  e.kind = channel.kind;
  const auto triple = [&](std::size_t from) { return Vector3(r.value[from], r.value[from + 1], r.value[from + 2]); };
  switch (channel.kind) {
    case NavigationEventKind::kImu:
      e.reading = {triple(0), triple(3)};
      if (nonholonomic_alone_ && e.utime / kNonholonomicPeriod != (e.utime - utime_of(imu_period_s_)) / kNonholonomicPeriod) {
        e.measures = true;
        e.measurement = speed_;
        e.measurement.size = 2;
        e.measurement.rows = {1, 2, 0};
        e.first_output = 7;
      }
      break;
    case NavigationEventKind::kGnss:
      e.measurement = gnss_;
      e.measurement.z = world_.to_enu({r.value[0], r.value[1], r.value[2]});
      e.measures = true;
      e.first_output = 0;
      break;
    case NavigationEventKind::kLidar:
      e.measurement = lidar_;
      e.measurement.z = lidar_map_ * triple(0) + lidar_offset_;
      e.measures = true;
      e.first_output = 3;
      break;
    case NavigationEventKind::kSpeed:
      e.measurement = speed_;
      e.measurement.size = tuning_.nonholonomic ? 3 : 1;
      e.measurement.z = {r.value.scalar(), 0.0, 0.0};
      e.measurement.R(0, 0) = speed_noise_.variance(r.value.scalar());
      e.measures = true;
      e.first_output = 6;
      break;
    case NavigationEventKind::kClock:
      break;
  }
  return e;
}

void NavigationSession::on_reading(const Reading& r) {
  const auto found = channels_.find(r.quantity);
  if (found == channels_.end()) return;  // the model has no use for it
  Channel& c = found->second;
  if (const char* problem = problem_of(r.quantity, r.value)) return refuse(r.quantity, problem);
  if (processed_ >= 0 && r.header.utime - processed_ > utime_of(kLongestGap_s))
    return refuse(r.quantity, "its time is more than 30 s ahead of the run");
  const bool overtaken = c.seen && r.header.seq < c.next_seq;  // sent before one that is here: late, or there twice
  if (!c.seen && c.kind == NavigationEventKind::kImu && !running_)
    may_start_given_ = static_cast<double>(r.header.seq) * imu_period_s_ <= kGrace_s;
  if (overtaken && lost_ > 0 && r.header.utime < c.newest) --lost_;
  if (c.seen && !overtaken) lost_ = std::min(kMostLost, lost_ + (r.header.seq - c.next_seq));
  if (!overtaken) c.next_seq = r.header.seq + 1;
  const Utime before = c.newest;
  const bool first = !std::exchange(c.seen, true);
  c.newest = first ? r.header.utime : std::max(c.newest, r.header.utime);
  if (c.kind == NavigationEventKind::kImu && !first && !overtaken && r.header.utime <= before)
    return refuse(r.quantity, r.header.utime == before ? "its time is that of the one before" : "its time goes backwards");
  if (!c.used) return;
  if (pending_.size() >= kMostPending) return refuse(r.quantity, "no tick comes");
  pending_.push_back(event_of(c, r));
}

void NavigationSession::on_tick(Utime utime) {
  const auto before = std::chrono::steady_clock::now();
  sort_by_time(pending_);
  std::size_t taken = 0;
  for (; taken < pending_.size() && pending_[taken].utime <= utime; ++taken) {
    // A start waits for what comes late; how late that is it learns, should the scenario not say.
    if (!running_) start_lag_ = std::clamp(utime - pending_[taken].utime, start_lag_, utime_of(tuning_.history_s));
    process(pending_[taken]);
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(taken));
  if (!running_ && !waiting_.empty()) start_from_waiting(utime);
  // A silent IMU: the estimate goes on with the ticks.
  if (running_ && seconds(utime - history_.newest().held_since) > process_.hold_s() &&
      utime - history_.newest().event.utime >= utime_of(imu_period_s_)) {
    NavigationEvent clock;
    clock.utime = utime;
    process(clock);
  }
  const double step_time_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - before).count();
  if (utime < processed_) published_ = std::min(published_, utime - 1);  // a tick that was far ahead had no run behind it
  processed_ = utime;
  if (taken > 0 || running_) publish(step_time_us);
}

// What waits, in order of time, but not before those that may still come have come.
void NavigationSession::start_from_waiting(Utime utime) {
  sort_by_time(waiting_);
  std::size_t done = 0;
  while (!running_ && done < waiting_.size() && waiting_[done].utime <= utime - start_lag_)
    process_starting(NavigationEvent(waiting_[done++]));  // a copy: starting again clears them
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(std::min(done, waiting_.size())));
  if (!running_) return;
  const std::vector<NavigationEvent> rest = std::exchange(waiting_, {});
  for (const NavigationEvent& e : rest) process(e);
}

void NavigationSession::process(const NavigationEvent& event) {
  if (running_) return process_running(event);
  if (event.kind == NavigationEventKind::kClock) return;
  if (may_start_given_ && tuning_.start == "given") {
    if (event.kind == NavigationEventKind::kImu) start_given(event);
    return;  // a fix at the very start, before the first reading of the IMU, is not waited for
  }
  if (waiting_.size() < kMostPending) waiting_.push_back(event);
}

void NavigationSession::start_given(const NavigationEvent& first) {
  NavigationEntry entry;
  entry.event = first;
  entry.event.measures = false;
  entry.held = first.reading;
  entry.held_since = first.utime;
  entry.belief =
      frames_.start(tuning_.initial_position_m, tuning_.initial_velocity_mps, tuning_.initial_rpy_rad,
                    tuning_.position_deviation_m, tuning_.velocity_deviation_mps, tuning_.rpy_deviation_rad, first.reading.w);
  begin(entry);
}

void NavigationSession::begin(const NavigationEntry& entry) {
  history_.start(entry);
  running_ = true;
  may_start_given_ = false;  // only the beginning of a run is told
  gated_since_.reset();
  newest_started_.reset();
  start_.clear();
}

void NavigationSession::process_starting(const NavigationEvent& event) {
  if (newest_started_ && is_same(event, *newest_started_)) return refuse(name_of(event.kind), kRepeated);
  if (newest_started_ && event < *newest_started_) return refuse(name_of(event.kind), "it comes later than a start waits for");
  newest_started_ = event;
  const bool known = start_.add(event);
  if (start_.begun() && !start_.is_sound()) return start_again("the estimate was not finite");
  if (known) begin(NavigationEntry(start_.mixture()));
}

void NavigationSession::process_running(const NavigationEvent& event) {
  const NavigationEntry& newest = history_.newest();
  if (seconds(event.utime - newest.event.utime) > kLongestGap_s) {
    start_again(fmt::format("nothing was measured for {:.0f} s", seconds(event.utime - newest.event.utime)));
    return process(event);
  }
  switch (history_.insert(event)) {
    case NavigationHistory::Insertion::kDone:
      break;
    case NavigationHistory::Insertion::kRepeated:
      return refuse(name_of(event.kind), kRepeated);
    case NavigationHistory::Insertion::kTooLate:
      return refuse(name_of(event.kind), "it comes later than history_s of the tuning allows");
  }
  const NavigationEntry& entry = history_.inserted();
  if (!is_sound(history_.newest().belief)) {
    status_ = EstimateStatus::kInvalid;
    publish(0.0);
    return start_again("the estimate was not finite");
  }
  if (!entry.event.measures) return;
  note(entry);
  watch_gate(entry);
}

void NavigationSession::watch_gate(const NavigationEntry& entry) {
  if (entry.event.measurement.kind != NavigationMeasurement::kPoint) return;
  if (!entry.innovation.gated) {
    gated_since_.reset();
    return;
  }
  if (!gated_since_) {
    gated_since_ = entry.event.utime;
    gated_ = 0;
  }
  ++gated_;
  if (gated_ >= kLostFixes && seconds(entry.event.utime - *gated_since_) >= kLost_s)
    start_again(fmt::format("the last {} fixes were all too unlikely", gated_));
}

void NavigationSession::start_again(const std::string& why) {
  if (hooks_.say) hooks_.say(why + ": starts again from the fixes");
  running_ = false;
  history_.clear();
  start_.clear();
  waiting_.clear();
  newest_started_.reset();
  gated_since_.reset();
}

void NavigationSession::note(const NavigationEntry& entry) {
  if (noted_.size() < kMostNoted) noted_.push_back(entry);
}

void NavigationSession::publish(double step_time_us) {
  const std::size_t n = names().states.size();
  Estimate& m = message_;
  if (running_) {
    const NavigationEntry& newest = history_.newest();
    if (newest.event.utime <= published_) return;  // only what is past has changed
    published_ = newest.event.utime;
    if (status_ != EstimateStatus::kInvalid)
      status_ = process_.is_coasting(newest) ? EstimateStatus::kFallback : EstimateStatus::kValid;
    const PublishedNavigation p = frames_.publish(newest.belief, newest.held.w);
    m.mean.assign(p.mean.data(), p.mean.data() + n);
    m.covariance.resize(n * n);
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < n; ++c) m.covariance[r * n + c] = p.covariance(static_cast<int>(r), static_cast<int>(c));
  } else {
    if (processed_ <= published_) return;
    published_ = processed_;
    status_ = EstimateStatus::kInitialising;
    m.mean.assign(n, 0.0);
    m.covariance.assign(n * n, 0.0);
  }
  m.header = {published_, seq_++, run_id_};
  m.status = status_;
  m.step_time_us = step_time_us;
  m.messages_lost = lost_;
  m.messages_rejected = rejected_;
  m.innovation_of.clear();
  m.innovation.clear();
  m.gated.clear();
  std::size_t rows = 0;
  for (const NavigationEntry& e : noted_) rows += static_cast<std::size_t>(e.innovation.size);
  m.innovation_covariance.assign(rows * rows, 0.0);
  for (const NavigationEntry& e : noted_) {
    const std::size_t from = m.innovation.size();
    for (int i = 0; i < e.innovation.size; ++i) {
      m.innovation_of.emplace_back(Strapdown::kOutputNames[static_cast<std::size_t>(e.event.first_output + i)].name);
      m.innovation.push_back(e.innovation.nu[i]);
      m.gated.push_back(e.innovation.gated ? 1 : 0);
      for (int j = 0; j < e.innovation.size; ++j)
        m.innovation_covariance[(from + static_cast<std::size_t>(i)) * rows + from + static_cast<std::size_t>(j)] =
            e.innovation.S(i, j);
    }
  }
  noted_.clear();
  status_ = EstimateStatus::kInitialising;
  hooks_.publish(m);
}

}  // namespace slipstream
