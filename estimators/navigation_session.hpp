// A strapdown filter's view of one run: turns the messages of the bus into predictions and updates, and those into estimates.
#pragma once

#include "estimators/follower.hpp"
#include "estimators/navigation.hpp"

namespace slipstream {

class NavigationSession final : public RunFollower {
 public:
  NavigationSession(std::string name, std::int64_t run_id, const Scenario& scenario, const StrapdownTuning& tuning,
                    std::unique_ptr<NavigationFilter> filter, FollowHooks hooks);

  void on_reading(const Reading& reading) override;
  void on_tick(Utime utime) override;
  void on_rejected() override { ++rejected_; }
  Utime processed_utime() const override { return processed_; }
  ModelNames names() const override;

 private:
  std::string name_;
  std::int64_t run_id_;
  bool biases_;
  std::unique_ptr<NavigationFilter> filter_;
  FollowHooks hooks_;
  Utime processed_ = -1;
  std::int64_t rejected_ = 0;
};

}  // namespace slipstream
