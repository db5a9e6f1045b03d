#include "estimators/session.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "common/check.hpp"

namespace slipstream {

namespace {

// Whoever hears the first message of a run within this many sensor periods of its start has not missed the start.
constexpr double kGracePeriods = 1.5;

}  // namespace

EstimatorSession::EstimatorSession(std::string name, std::int64_t run_id, const Scenario& scenario, const Tuning& tuning,
                                   std::unique_ptr<Estimator> estimator, std::function<void(const Estimate&)> publish)
    : name_(std::move(name)),
      run_id_(run_id),
      estimator_(std::move(estimator)),
      publish_(std::move(publish)),
      start_given_(tuning.start == "given") {
  double period_s = std::numeric_limits<double>::infinity();
  for (const SensorConfig& s : scenario.sensors) {
    channels_[s.quantity];
    period_s = std::min(period_s, 1.0 / s.rate_hz);
  }
  start_grace_ = std::isfinite(period_s) ? static_cast<Utime>(kGracePeriods * period_s / kSecondsPerUtime) : 0;
  const ModelNames names = estimator_->names();
  for (std::size_t i = 0; i < names.inputs.size(); ++i)
    channels_[std::string(names.inputs[i].name)].input = static_cast<int>(i);
  for (std::size_t i = 0; i < names.outputs.size(); ++i)
    channels_[std::string(names.outputs[i].name)].output = static_cast<int>(i);
  inputs_at_end_ = names.inputs_at_end;
  pending_value_.assign(names.outputs.size(), 0.0);
  pending_input_.assign(names.inputs.size(), 0.0);
  input_.assign(names.inputs.size(), 0.0);
  input_integral_.assign(names.inputs.size(), 0.0);
  step_input_.assign(names.inputs.size(), 0.0);
  message_.name = name_;
}

void EstimatorSession::on_reading(const Reading& r) {
  const auto found = channels_.find(r.quantity);
  if (found == channels_.end()) return;  // not a quantity of this scenario
  Channel& c = found->second;
  const bool repeated = c.sender.seen && r.header.seq < c.sender.next_seq;
  if (r.value.size() != 1 || !std::isfinite(r.value.scalar()) || repeated || (any_ && r.header.utime <= processed_) ||
      (pending_ && r.header.utime < pending_utime_)) {
    ++rejected_;
    return;
  }
  if (c.sender.seen) lost_ += r.header.seq - c.sender.next_seq;
  c.sender.seen = true;
  c.sender.next_seq = r.header.seq + 1;

  if (pending_ && r.header.utime > pending_utime_) process_pending();
  pending_ = true;
  pending_utime_ = r.header.utime;
  if (c.input >= 0) {
    pending_input_[static_cast<std::size_t>(c.input)] = r.value.scalar();
    pending_inputs_ |= 1U << c.input;
  }
  if (c.output >= 0) {
    pending_value_[static_cast<std::size_t>(c.output)] = r.value.scalar();
    pending_measured_ |= 1U << c.output;
  }
}

void EstimatorSession::on_tick(Utime utime) {
  if (pending_ && pending_utime_ <= utime) process_pending();
  processed_ = any_ ? std::max(processed_, utime) : utime;
  any_ = true;
}

void EstimatorSession::accumulate_inputs(Utime until) {
  const double dt_s = seconds(until - integrated_to_);
  for (std::size_t i = 0; i < input_.size(); ++i) input_integral_[i] += input_[i] * dt_s;
  integrated_to_ = until;
}

// The first step: from the tuning's start at the beginning of a run, else from what was measured. Clears the bit of the output
// that the start has used up. False if there is nothing to start from yet.
bool EstimatorSession::start(std::uint32_t& measured) {
  if (start_given_ && pending_utime_ <= start_grace_) {
    estimator_->start_given();
    return true;
  }
  for (std::size_t k = 0; k < pending_value_.size(); ++k) {
    if ((measured >> k & 1U) == 0U || !estimator_->start_measured(static_cast<int>(k), pending_value_[k])) continue;
    measured &= ~(1U << k);
    return true;
  }
  return false;
}

void EstimatorSession::process_pending() {
  const Utime now = pending_utime_;
  std::uint32_t measured = pending_measured_;
  const std::uint32_t all_inputs = (1U << input_.size()) - 1U;
  const bool inputs_ready = ((inputs_known_ | pending_inputs_) & all_inputs) == all_inputs;
  bool stepped = false;
  double step_time_us = 0.0;
  if (measured != 0U && inputs_ready) {
    const bool first = !started_;
    if (first) started_ = start(measured);
    if (started_) {
      // Before the first step nothing has been integrated; the inputs of this instant stand in for the interval's.
      if (!first) accumulate_inputs(now);
      const double dt_s = first ? 0.0 : seconds(now - stepped_);
      for (std::size_t i = 0; i < input_.size(); ++i) {
        const bool is_new = (pending_inputs_ >> i & 1U) != 0U;
        if (inputs_at_end_)
          step_input_[i] = is_new ? pending_input_[i] : input_[i];
        else
          step_input_[i] = dt_s > 0.0 ? input_integral_[i] / dt_s : pending_input_[i];
      }
      const auto before = std::chrono::steady_clock::now();
      estimator_->step({dt_s, step_input_, pending_value_, measured});
      step_time_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - before).count();
      stepped_ = now;
      std::fill(input_integral_.begin(), input_integral_.end(), 0.0);
      integrated_to_ = now;
      stepped = true;
    }
  }
  if (pending_inputs_ != 0U) {
    if (started_ && !stepped) accumulate_inputs(now);
    for (std::size_t i = 0; i < input_.size(); ++i)
      if ((pending_inputs_ >> i & 1U) != 0U) input_[i] = pending_input_[i];
    inputs_known_ |= pending_inputs_;
  }
  const bool has_measurement = pending_measured_ != 0U;
  pending_ = false;
  pending_measured_ = 0;
  pending_inputs_ = 0;
  processed_ = now;
  any_ = true;
  if (has_measurement) publish(stepped ? measured : 0U, step_time_us);  // an input alone changes no estimate
  // What is invalid stays so: start again from the next measurement.
  if (stepped && estimator_->posterior().status == EstimateStatus::kInvalid) started_ = false;
}

void EstimatorSession::publish(std::uint32_t measured, double step_time_us) {
  const ModelNames names = estimator_->names();
  const Posterior p = estimator_->posterior();
  Estimate& m = message_;
  m.header = {processed_, seq_++, run_id_};
  m.status = started_ ? p.status : EstimateStatus::kInitialising;
  m.kkt_residual = started_ ? p.kkt_residual : -1.0;
  m.step_time_us = step_time_us;
  m.messages_lost = lost_;
  m.messages_rejected = rejected_;
  m.innovation_of.clear();
  m.innovation.clear();
  m.innovation_covariance.clear();
  m.gated.clear();
  m.interval_low.clear();
  m.interval_high.clear();
  if (!started_) {
    m.mean.assign(names.states.size(), 0.0);
    m.covariance.assign(names.states.size() * names.states.size(), 0.0);
    publish_(m);
    return;
  }
  m.mean.assign(p.mean.begin(), p.mean.end());
  m.covariance.assign(p.covariance.begin(), p.covariance.end());
  m.interval_low.assign(p.interval_low.begin(), p.interval_low.end());
  m.interval_high.assign(p.interval_high.begin(), p.interval_high.end());
  const std::size_t outputs = names.outputs.size();
  for (std::size_t i = 0; i < outputs; ++i) {
    if ((measured >> i & 1U) == 0U) continue;
    m.innovation_of.emplace_back(names.outputs[i].name);
    m.innovation.push_back(p.innovation[i]);
    m.gated.push_back(0);
    for (std::size_t j = 0; j < outputs; ++j)
      if ((measured >> j & 1U) != 0U) m.innovation_covariance.push_back(p.innovation_covariance[i * outputs + j]);
  }
  publish_(m);
}

}  // namespace slipstream
