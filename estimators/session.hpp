// An estimator's view of one run: turns the messages of the bus into steps, and steps into estimates. Knows no bus.
//
// Messages of one instant are collected and processed together, when a tick says that the instant is complete or a message of a
// later instant arrives. Inputs hold from their instant until the next (zero-order hold); a step uses their mean over the time
// that really passed since the previous measurement, so rates may differ and be irregular; for a model that asks for it, the
// value at the measurement (process.hpp, kInputsAtEnd).
// Out-of-order and not finite messages are refused and counted; gaps in the sequence numbers are counted as lost.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/messages.hpp"
#include "estimators/estimator.hpp"
#include "estimators/follower.hpp"
#include "models/scenario.hpp"

namespace slipstream {

class EstimatorSession final : public RunFollower {
 public:
  // `name` goes into the estimates. The estimator's tuning says how it starts; whoever joins after the first instants of a run
  // starts from a measurement whatever the tuning says.
  EstimatorSession(std::string name, std::int64_t run_id, const Scenario& scenario, const Tuning& tuning,
                   std::unique_ptr<Estimator> estimator, std::function<void(const Estimate&)> publish);

  void on_reading(const Reading& reading) override;
  void on_tick(Utime utime) override;
  void on_rejected() override { ++rejected_; }
  Utime processed_utime() const override { return processed_; }
  ModelNames names() const override { return estimator_->names(); }

 private:
  struct Sender {
    bool seen = false;
    std::int64_t next_seq = 0;
  };
  struct Channel {
    int input = -1;   // index of the model's input, or
    int output = -1;  // index of the model's output, or neither: a sensor the model has no use for
    Sender sender;
  };

  void process_pending();
  void accumulate_inputs(Utime until);
  bool start(std::uint32_t& measured);
  // measured: the outputs that the step used, for the innovation.
  void publish(std::uint32_t measured, double step_time_us);

  std::string name_;
  std::int64_t run_id_;
  std::unique_ptr<Estimator> estimator_;
  std::function<void(const Estimate&)> publish_;
  std::map<std::string, Channel, std::less<>> channels_;
  Utime start_grace_;
  bool start_given_;
  bool inputs_at_end_ = false;

  // The instant being collected.
  bool pending_ = false;
  Utime pending_utime_ = 0;
  std::uint32_t pending_measured_ = 0;
  std::uint32_t pending_inputs_ = 0;
  std::vector<double> pending_value_;  // per output
  std::vector<double> pending_input_;  // per input

  // Inputs in force, and their integral since the last step.
  std::vector<double> input_;
  std::uint32_t inputs_known_ = 0;
  std::vector<double> input_integral_;
  Utime integrated_to_ = 0;

  bool started_ = false;
  bool any_ = false;      // processed_ is an instant of this run
  Utime processed_ = -1;  // the last instant processed
  Utime stepped_ = 0;     // the last instant that had a step
  std::int64_t seq_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t rejected_ = 0;
  Estimate message_;
  std::vector<double> step_input_;
};

}  // namespace slipstream
