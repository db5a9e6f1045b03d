#include "estimators/hierarchical.hpp"

#include <string>

#include "estimators/mhe.hpp"
#include "estimators/registry.hpp"

namespace slipstream {

namespace {

// `first_level` is the algorithm of that name, on the same wheel and with the same tuning by state name; the entries of
// speed_mps are the second level's. Bounds hold in the first level.
std::unique_ptr<Estimator> make_hierarchical(const std::string& first_level, Scenario scenario, Tuning tuning) {
  const AnyProcess process = tuning.process ? *tuning.process : scenario.estimator.process;
  const auto* model = std::get_if<LongitudinalFriction>(&process);
  if (model == nullptr)
    throw Refusal("hierarchical_" + first_level + ": works on model longitudinal_friction only; the scenario's is " +
                  std::string(std::visit([](const auto& m) { return m.kName; }, process)));
  const WheelFriction wheel{model->wheel};
  Belief<LongitudinalFriction> belief = make_belief(*model, scenario, tuning);
  Belief<WheelFriction> first_belief = make_belief(wheel, scenario, tuning);
  if (first_level == "mhe" && tuning.mhe_form == "single_shooting") {
    belief = weights_as_noise(belief, tuning);
    first_belief = weights_as_noise(first_belief, tuning);
    belief.process_variance[0] = belief.process_variance[2] = 0.0;
    first_belief.process_variance.setZero();
  }
  scenario.estimator.process = wheel;
  tuning.process.reset();
  scenario.estimator.tunings = {{"first_level", tuning}};
  return std::make_unique<Hierarchical>(belief, first_belief, make_estimator(first_level, scenario, "first_level"));
}

}  // namespace

std::unique_ptr<Estimator> make_hierarchical_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_hierarchical_mhe(const Scenario& scenario, const Tuning& tuning);

std::unique_ptr<Estimator> make_hierarchical_ekf(const Scenario& scenario, const Tuning& tuning) {
  return make_hierarchical("ekf", scenario, tuning);
}
std::unique_ptr<Estimator> make_hierarchical_mhe(const Scenario& scenario, const Tuning& tuning) {
  return make_hierarchical("mhe", scenario, tuning);
}

}  // namespace slipstream
