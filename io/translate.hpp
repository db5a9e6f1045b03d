// LCM types from and to the plain structs of common/messages.hpp. Only bus.cpp includes this.
#pragma once

#include <algorithm>
#include <slipstream/accelerator.hpp>
#include <slipstream/accelerometer.hpp>
#include <slipstream/announcement.hpp>
#include <slipstream/control.hpp>
#include <slipstream/drive_torque.hpp>
#include <slipstream/east_position.hpp>
#include <slipstream/estimate.hpp>
#include <slipstream/forward_speed.hpp>
#include <slipstream/gnss.hpp>
#include <slipstream/imu.hpp>
#include <slipstream/lateral_accelerometer.hpp>
#include <slipstream/lidar.hpp>
#include <slipstream/motor_current.hpp>
#include <slipstream/north_position.hpp>
#include <slipstream/progress.hpp>
#include <slipstream/run_descriptor.hpp>
#include <slipstream/steering_angle.hpp>
#include <slipstream/tick.hpp>
#include <slipstream/truth.hpp>
#include <slipstream/wheel_speed.hpp>
#include <slipstream/yaw_rate.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/messages.hpp"

namespace slipstream::wire {

// Simulation times and sequence numbers beyond this are refused: sums of them cannot overflow.
inline constexpr std::int64_t kMaxCounter = std::int64_t{1} << 53;

inline void require(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(what);
}

template <typename M>
M with_header(const Header& h) {
  M m{};
  m.utime = h.utime;
  m.seq = h.seq;
  m.run_id = h.run_id;
  return m;
}
template <typename M>
Header header_of(const M& m) {
  require(m.utime >= 0 && m.utime <= kMaxCounter, "utime out of range");
  require(m.seq >= 0 && m.seq <= kMaxCounter, "seq out of range");
  return {m.utime, m.seq, m.run_id};
}

inline bool all_of(const std::string& s, std::size_t most, const char* more) {
  return !s.empty() && s.size() <= most && std::all_of(s.begin(), s.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view(more).find(c) != std::string_view::npos;
  });
}
inline void require_quantities(const std::vector<std::string>& names) {
  for (const std::string& n : names) require(all_of(n, 64, "_"), "a quantity's name is out of form");
}
// Units and labels are shown to people: printable ASCII only.
inline void require_labels(const std::vector<std::string>& labels) {
  for (const std::string& s : labels)
    require(s.size() <= 64 && std::all_of(s.begin(), s.end(), [](char c) { return c >= ' ' && c <= '~'; }),
            "a label is out of form");
}
inline void require_participant(const std::string& name) {
  require(all_of(name, 32, "_-"), "a participant's name is out of form");
}

inline slipstream::run_descriptor to_wire(const RunDescriptor& r) {
  auto m = with_header<slipstream::run_descriptor>(r.header);
  m.name = r.name;
  m.scenario_toml = r.scenario_toml;
  m.clock = r.clock;
  m.n_truth = static_cast<std::int32_t>(r.truth_names.size());
  m.truth_names = r.truth_names;
  m.truth_units = r.truth_units;
  return m;
}
inline RunDescriptor from_wire(const slipstream::run_descriptor& m) {
  require(all_of(m.name, 128, "_-."), "the run's name is out of form");
  require(m.clock == "lockstep" || m.clock == "realtime" || m.clock == "free", "the clock mode is unknown");
  require_quantities(m.truth_names);
  require_labels(m.truth_units);
  return {header_of(m), m.name, m.scenario_toml, m.clock, m.truth_names, m.truth_units};
}

inline slipstream::truth to_wire(const Truth& t) {
  auto m = with_header<slipstream::truth>(t.header);
  m.n = static_cast<std::int32_t>(t.value.size());
  m.value = t.value;
  return m;
}
inline Truth from_wire(const slipstream::truth& m) { return {header_of(m), m.value}; }

inline std::vector<std::vector<double>> rows_of(const std::vector<double>& square, std::size_t n) {
  std::vector<std::vector<double>> rows(n);
  for (std::size_t r = 0; r < n; ++r)
    rows[r].assign(square.begin() + static_cast<std::ptrdiff_t>(r * n),
                   square.begin() + static_cast<std::ptrdiff_t>((r + 1) * n));
  return rows;
}
inline std::vector<double> flat(const std::vector<std::vector<double>>& rows) {
  std::vector<double> square;
  for (const auto& row : rows) square.insert(square.end(), row.begin(), row.end());
  return square;
}

inline slipstream::estimate to_wire(const Estimate& e) {
  auto m = with_header<slipstream::estimate>(e.header);
  m.name = e.name;
  m.status = static_cast<std::int8_t>(e.status);
  m.n = static_cast<std::int32_t>(e.mean.size());
  m.mean = e.mean;
  m.covariance = rows_of(e.covariance, e.mean.size());
  m.n_interval = static_cast<std::int32_t>(e.interval_low.size());
  m.interval_low = e.interval_low;
  m.interval_high = e.interval_high;
  m.m = static_cast<std::int32_t>(e.innovation.size());
  m.innovation_of = e.innovation_of;
  m.innovation = e.innovation;
  m.innovation_covariance = rows_of(e.innovation_covariance, e.innovation.size());
  m.gated = e.gated;
  m.gated.resize(e.innovation.size(), 0);
  m.kkt_residual = e.kkt_residual;
  m.step_time_us = e.step_time_us;
  m.messages_lost = e.messages_lost;
  m.messages_rejected = e.messages_rejected;
  return m;
}
inline Estimate from_wire(const slipstream::estimate& m) {
  require_participant(m.name);
  require(m.status >= 0 && m.status <= 3, "the status is unknown");
  require_quantities(m.innovation_of);
  require(m.n_interval == 0 || m.n_interval == m.n, "the interval's size is neither 0 nor that of the mean");
  require(
      m.messages_lost >= 0 && m.messages_lost <= kMaxCounter && m.messages_rejected >= 0 && m.messages_rejected <= kMaxCounter,
      "a counter is out of range");
  return {header_of(m),
          m.name,
          static_cast<EstimateStatus>(m.status),
          m.mean,
          flat(m.covariance),
          m.interval_low,
          m.interval_high,
          m.innovation_of,
          m.innovation,
          flat(m.innovation_covariance),
          m.gated,
          m.kkt_residual,
          m.step_time_us,
          m.messages_lost,
          m.messages_rejected};
}

inline slipstream::announcement to_wire(const Announcement& a) {
  auto m = with_header<slipstream::announcement>(a.header);
  m.name = a.name;
  m.role = a.role;
  m.algorithm = a.algorithm;
  m.tuning = a.tuning;
  m.model = a.model;
  m.n = static_cast<std::int32_t>(a.state_names.size());
  m.state_names = a.state_names;
  m.state_units = a.state_units;
  m.presence = static_cast<std::int8_t>(a.presence);
  m.instance = a.instance;
  return m;
}
inline Announcement from_wire(const slipstream::announcement& m) {
  require_participant(m.name);
  require_labels({m.role, m.algorithm, m.tuning, m.model});
  require_quantities(m.state_names);
  require_labels(m.state_units);
  require(m.presence >= 0 && m.presence <= 2, "the presence is unknown");
  return {header_of(m),  m.name,        m.role,
          m.algorithm,   m.tuning,      m.model,
          m.state_names, m.state_units, static_cast<Presence>(m.presence),
          m.instance};
}

inline slipstream::control to_wire(const Control& c) {
  auto m = with_header<slipstream::control>(c.header);
  m.command = static_cast<std::int8_t>(c.command);
  return m;
}
inline Control from_wire(const slipstream::control& m) {
  require(m.command >= 0 && m.command <= 3, "the command is unknown");
  return {header_of(m), static_cast<Command>(m.command)};
}

inline slipstream::tick to_wire(const Tick& t) {
  auto m = with_header<slipstream::tick>(t.header);
  m.state = static_cast<std::int8_t>(t.state);
  return m;
}
inline Tick from_wire(const slipstream::tick& m) {
  require(m.state >= 0 && m.state <= 3, "the state is unknown");
  return {header_of(m), static_cast<RunState>(m.state)};
}

inline slipstream::progress to_wire(const Progress& p) {
  auto m = with_header<slipstream::progress>(p.header);
  m.name = p.name;
  return m;
}
inline Progress from_wire(const slipstream::progress& m) {
  require_participant(m.name);
  return {header_of(m), m.name};
}

}  // namespace slipstream::wire
