#include "monitor/run_record.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/readings.hpp"
#include "monitor/angles.hpp"
#include "monitor/innovation_sensors.hpp"
#include "monitor/scores.hpp"
#include "monitor/text.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMaxRows = 4'000'000;  // per series: 11 hours at 100 Hz, 2 at 500 Hz
constexpr std::size_t kMaxNames = 64;        // estimators, and quantities
constexpr std::size_t kMaxStates = 64;
constexpr std::size_t kMaxLives = 256;  // of an estimator; the last one stands for all that follow

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool all_safe(const std::vector<std::string>& names) {
  return std::all_of(names.begin(), names.end(), [](const std::string& name) { return is_safe_name(name); });
}

// The entry of a name, made if there is room for it; null if not, or if the name is unsafe.
template <typename Record>
Record* entry(std::map<std::string, Record>& records, const std::string& name) {
  const auto found = records.find(name);
  if (found != records.end()) return &found->second;
  if (!is_safe_name(name) || records.size() >= kMaxNames) return nullptr;
  return &records[name];
}

// Whether a row at utime may follow.
bool is_newer(const std::vector<Utime>& rows, Utime utime, SequenceCheck& sequence) {
  if (rows.empty() || utime > rows.back()) return true;
  ++sequence.out_of_order;
  return false;
}

// Who speaks now under the record's name. Who starts again counts from 0 again; whoever says the same once more does not.
// Returns whether the announcement is of the present process: an older one's late goodbye is not.
bool introduce(EstimatorRecord& r, const Announcement& m) {
  if (!r.lives[r.life].instance) r.lives[r.life].instance = m.instance;
  if (*r.lives[r.life].instance == m.instance) return true;
  const auto seen =
      std::find_if(r.lives.begin(), r.lives.end(), [&](const EstimatorLife& life) { return life.instance == m.instance; });
  if (m.presence == Presence::kLeft && seen != r.lives.end()) return false;
  r.sequence.newest = -1;
  r.name_conflict = r.name_conflict || seen != r.lives.end();
  r.life = static_cast<std::size_t>(seen - r.lives.begin());
  if (seen != r.lives.end()) return true;
  if (r.lives.size() < kMaxLives) r.lives.emplace_back();
  r.life = r.lives.size() - 1;
  r.lives[r.life].instance = m.instance;
  return true;
}

bool fits(const Estimate& m) {
  const std::size_t n = m.mean.size(), measured = m.innovation.size();
  return n > 0 && n <= kMaxStates && m.covariance.size() == n * n && (m.interval_low.empty() || m.interval_low.size() == n) &&
         m.interval_high.size() == m.interval_low.size() && measured <= kMaxStates && m.innovation_of.size() == measured &&
         m.innovation_covariance.size() == measured * measured && (m.gated.empty() || m.gated.size() == measured) &&
         all_safe(m.innovation_of);
}

// NIS of some of the innovations of an estimate, by their block of its innovation covariance; NaN if there is none.
double nis_of(const Estimate& m, const std::vector<std::size_t>& keep) {
  std::vector<double> innovation;
  for (const std::size_t i : keep) innovation.push_back(m.innovation[i]);
  return normalised_square(innovation, sub_block(m.innovation_covariance, m.innovation.size(), keep));
}

// The measurements in an estimate, in its order: the sensor of each, and which of the innovations are its. A quantity that
// comes again is of another measurement.
std::vector<std::pair<std::string, std::vector<std::size_t>>> blocks_of(const Estimate& m) {
  std::vector<std::pair<std::string, std::vector<std::size_t>>> blocks;
  for (std::size_t i = 0; i < m.innovation_of.size(); ++i) {
    const std::string sensor = sensor_of(m.innovation_of[i]);
    const auto same = std::find_if(blocks.rbegin(), blocks.rend(), [&](const auto& block) { return block.first == sensor; });
    const bool is_again = same != blocks.rend() && std::any_of(same->second.begin(), same->second.end(), [&](std::size_t k) {
                            return m.innovation_of[k] == m.innovation_of[i];
                          });
    if (same == blocks.rend() || is_again)
      blocks.emplace_back(sensor, std::vector<std::size_t>{i});
    else
      same->second.push_back(i);
  }
  return blocks;
}

// Names of readings (components: the first stands for all) without whose newest an estimator that uses the sensor is not done.
// A position fix corrects a dead reckoning, which goes on with every reading of the IMU.
std::vector<std::string> readings_behind(const std::string& sensor) {
  const InnovationSensor* known = known_sensor(sensor);
  const std::string quantity =
      known && !components_of(known->name).empty() ? std::string(components_of(known->name)[0].name) : sensor;
  if (known && known->is_position) return {quantity, std::string(kImuComponents[0].name)};
  return {quantity};
}

}  // namespace

bool SequenceCheck::accept(std::int64_t seq) {
  if (newest >= 0 && seq <= newest) {
    ++out_of_order;
    return false;
  }
  if (newest >= 0) lost += seq - newest - 1;
  newest = seq;
  return true;
}

std::int64_t EstimatorRecord::reported_lost() const {
  return std::accumulate(lives.begin(), lives.end(), std::int64_t{0},
                         [](std::int64_t sum, const EstimatorLife& l) { return sum + l.lost; });
}

std::int64_t EstimatorRecord::reported_rejected() const {
  return std::accumulate(lives.begin(), lives.end(), std::int64_t{0},
                         [](std::int64_t sum, const EstimatorLife& l) { return sum + l.rejected; });
}

double EstimatorRecord::sigma(std::size_t row, std::size_t state) const {
  const double squared = variance(row, state, state);
  return squared > 0.0 && std::isfinite(squared) ? std::sqrt(squared) : kNan;
}

double EstimatorRecord::variance(std::size_t row, std::size_t i, std::size_t j) const {
  const std::size_t low = std::min(i, j), high = std::max(i, j);
  return covariance[row * states * (states + 1) / 2 + high * (high + 1) / 2 + low];
}

RunRecord::RunRecord(RunInfo info) : info_(std::move(info)) {
  truth_.column.resize(info_.truth_names.size());
  truth_.newest.resize(info_.truth_names.size(), kNan);
}

void RunRecord::add(const Truth& m) {
  if (m.value.size() != truth_.column.size() || truth_.utime.size() >= kMaxRows) {
    ++rejected_;
    return;
  }
  if (!truth_.sequence.accept(m.header.seq) || !is_newer(truth_.utime, m.header.utime, truth_.sequence)) return;
  truth_.utime.push_back(m.header.utime);
  for (std::size_t i = 0; i < m.value.size(); ++i) {
    double value = m.value[i];
    if (is_angle(info_.truth_units[i])) value = nearest_turn(value, truth_.newest[i]);
    if (std::isfinite(value)) truth_.newest[i] = value;
    truth_.column[i].push_back(std::isfinite(value) ? value : kNan);
  }
}

void RunRecord::add(const Reading& m) {
  const std::span<const Component> components = components_of(m.quantity);
  if (components.empty() ? m.value.size() != 1 : m.value.size() != components.size()) {
    ++rejected_;
    return;
  }
  if (components.empty()) return add(m.quantity, m.header, m.value.scalar());
  for (std::size_t i = 0; i < components.size(); ++i) add(std::string(components[i].name), m.header, m.value[i]);
}

void RunRecord::add(const std::string& quantity, const Header& header, double value) {
  ReadingRecord* record = entry(readings_, quantity);
  if (!record || !std::isfinite(value) || record->utime.size() >= kMaxRows) {
    ++rejected_;
    return;
  }
  if (!record->sequence.accept(header.seq)) return;
  const auto at = std::lower_bound(record->utime.begin(), record->utime.end(), header.utime);
  if (at != record->utime.end() && *at == header.utime) {
    ++record->sequence.out_of_order;
    return;
  }
  if (at != record->utime.end()) ++record->late;
  record->value.insert(record->value.begin() + (at - record->utime.begin()), value);
  record->utime.insert(at, header.utime);
}

void RunRecord::add(const Announcement& m) {
  const std::size_t n = m.state_names.size();
  if (n == 0) {  // it does not know its model yet, because it has seen no run
    const auto known = estimators_.find(m.name);
    if (known != estimators_.end() && introduce(known->second, m)) known->second.presence = m.presence;
    return;
  }
  const bool usable = n <= kMaxStates && m.state_units.size() == n && all_safe(m.state_names);
  EstimatorRecord* record = usable ? entry(estimators_, m.name) : nullptr;
  if (!record || (record->states != 0 && record->states != n)) {
    ++announcements_rejected_;
    return;
  }
  if (!introduce(*record, m)) return;
  record->algorithm = plain_line(m.algorithm);
  record->tuning = plain_line(m.tuning);
  record->model = plain_line(m.model);
  record->state_names = m.state_names;
  record->state_units = m.state_units;
  record->presence = m.presence;
}

void RunRecord::add(const Estimate& m) {
  EstimatorRecord* record = entry(estimators_, m.name);
  if (!record) {
    ++rejected_;
    return;
  }
  EstimatorRecord& r = *record;
  if (r.states == 0 && fits(m) && (r.state_names.empty() || r.state_names.size() == m.mean.size())) {
    r.states = m.mean.size();
    r.mean.resize(r.states);
  }
  if (!fits(m) || m.mean.size() != r.states || r.utime.size() >= kMaxRows) {
    ++r.rejected;
    return;
  }
  // Within a life these only grow: a smaller one is of a new process whose announcement is still to come.
  EstimatorLife& life = r.lives[r.life];
  life.lost = std::max(life.lost, m.messages_lost);
  life.rejected = std::max(life.rejected, m.messages_rejected);
  if (!r.sequence.accept(m.header.seq) || !is_newer(r.utime, m.header.utime, r.sequence)) return;
  // Lockstep waits for everyone and the free clock for no one: only against a paced clock can an estimate be late.
  const Utime deadline = static_cast<Utime>(info_.deadline_s * 1e6);
  if (info_.clock == "realtime" && tick_utime_ > m.header.utime + deadline) ++r.late;

  const bool usable = m.status == EstimateStatus::kValid || m.status == EstimateStatus::kFallback;
  const bool scored = usable && all_finite(m.mean);
  r.status = usable && !scored ? EstimateStatus::kInvalid : m.status;
  r.utime.push_back(m.header.utime);
  r.row_status.push_back(*r.status);
  for (std::size_t i = 0; i < r.states; ++i) r.mean[i].push_back(scored ? m.mean[i] : kNan);
  for (std::size_t i = 0; i < r.states; ++i)
    for (std::size_t j = 0; j <= i; ++j) r.covariance.push_back(m.covariance[i * r.states + j]);
  r.step_time_us.push_back(m.step_time_us >= 0.0 && std::isfinite(m.step_time_us) ? m.step_time_us : kNan);
  r.kkt_residual.push_back(m.kkt_residual >= 0.0 && std::isfinite(m.kkt_residual) ? m.kkt_residual : kNan);
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < m.innovation.size(); ++i)
    if (m.gated[i] == 0) used.push_back(i);
  r.nis.push_back(scored ? nis_of(m, used) : kNan);
  r.nis_dimension.push_back(static_cast<int>(used.size()));
  if (scored) add_innovations(r, m);
}

void RunRecord::add_innovations(EstimatorRecord& r, const Estimate& m) {
  const std::size_t measured = m.innovation.size();
  for (std::size_t i = 0; i < measured; ++i) {
    InnovationRecord* innovation = entry(r.innovation_of, m.innovation_of[i]);
    if (!innovation) continue;
    const double variance = m.innovation_covariance[i * measured + i];
    innovation->utime.push_back(m.header.utime);
    innovation->innovation.push_back(m.innovation[i]);
    innovation->sigma.push_back(variance > 0.0 ? std::sqrt(variance) : kNan);
  }
  char place = 0;
  for (const auto& [sensor, block] : blocks_of(m)) {
    SensorRecord* record = entry(r.sensors, sensor);
    if (!record) continue;
    record->row.push_back(r.utime.size() - 1);
    record->nis.push_back(nis_of(m, block));
    record->dimension.push_back(static_cast<int>(block.size()));
    record->gated.push_back(std::any_of(block.begin(), block.end(), [&](std::size_t i) { return m.gated[i] != 0; }) ? 1 : 0);
    record->place.push_back(place++);
  }
}

void RunRecord::add(const Tick& m) {
  if (first_tick_seq_ < 0) first_tick_seq_ = m.header.seq;
  newest_tick_seq_ = std::max(newest_tick_seq_, m.header.seq);
  tick_utime_ = std::max(tick_utime_, m.header.utime);
  if (!ended()) state_ = m.state;
}

const std::vector<double>* RunRecord::truth_column(const std::string& name) const {
  const auto found = std::find(info_.truth_names.begin(), info_.truth_names.end(), name);
  if (found == info_.truth_names.end()) return nullptr;
  return &truth_.column[static_cast<std::size_t>(found - info_.truth_names.begin())];
}

bool RunRecord::awaits_estimates() const {
  for (const auto& [name, estimator] : estimators_) {
    if (estimator.presence == Presence::kLeft || estimator.utime.empty()) continue;
    for (const auto& [sensor, unused] : estimator.sensors)
      for (const std::string& quantity : readings_behind(sensor)) {
        const auto reading = readings_.find(quantity);
        if (reading != readings_.end() && reading->second.utime.back() > estimator.utime.back()) return true;
      }
  }
  return false;
}

}  // namespace slipstream
