#include "common/refusal.hpp"
#include "estimators/navigation.hpp"

namespace slipstream {

std::unique_ptr<NavigationFilter> make_es_ekf(const Strapdown&, const StrapdownTuning&) { throw Refusal("not there yet"); }

}  // namespace slipstream
