// What the estimator process asks of whoever follows one run: messages in, estimates out. Knows no bus.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/messages.hpp"
#include "estimators/estimator.hpp"
#include "models/scenario.hpp"

namespace slipstream {

class RunFollower {
 public:
  virtual ~RunFollower() = default;
  virtual void on_reading(const Reading& reading) = 0;
  // Everything up to utime has been received.
  virtual void on_tick(Utime utime) = 0;
  // A message that never reached on_reading because it could not be decoded.
  virtual void on_rejected() = 0;
  virtual Utime processed_utime() const = 0;  // -1: nothing yet
  virtual ModelNames names() const = 0;
};

struct FollowHooks {
  std::function<void(const Estimate&)> publish;
  // A reading that was refused; and what else the person at the terminal should know. Either may be empty.
  std::function<void(const std::string& quantity, const std::string& reason)> complain{};
  std::function<void(const std::string& line)> say{};
};

// `name` goes into the estimates. Refuses an algorithm or a tuning that is not known, and one that does not fit the model.
std::unique_ptr<RunFollower> make_follower(const std::string& algorithm, const std::string& name, std::int64_t run_id,
                                           const Scenario& scenario, const std::string& tuning, FollowHooks hooks);

}  // namespace slipstream
