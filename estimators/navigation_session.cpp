#include "estimators/navigation_session.hpp"

namespace slipstream {

NavigationSession::NavigationSession(std::string name, std::int64_t run_id, const Scenario&, const StrapdownTuning& tuning,
                                     std::unique_ptr<NavigationFilter> filter, FollowHooks hooks)
    : name_(std::move(name)), run_id_(run_id), biases_(tuning.biases), filter_(std::move(filter)), hooks_(std::move(hooks)) {}

void NavigationSession::on_reading(const Reading&) {}

void NavigationSession::on_tick(Utime utime) { processed_ = utime; }

ModelNames NavigationSession::names() const {
  const std::size_t n = biases_ ? Strapdown::kStates : Strapdown::kStatesWithoutBiases;
  return {Strapdown::kName, std::span(Strapdown::kStateNames).first(n), {}, Strapdown::kOutputNames};
}

}  // namespace slipstream
