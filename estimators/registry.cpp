#include "estimators/registry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/refusal.hpp"
#include "estimators/follower.hpp"
#include "estimators/navigation_session.hpp"
#include "estimators/session.hpp"

namespace slipstream {

// Each is defined in the .cpp of its name; the hierarchical ones in hierarchical.cpp.
std::unique_ptr<Estimator> make_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_ukf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_sqrt_ukf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_mhe(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_asir(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_rbpf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_imm(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_hierarchical_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_hierarchical_mhe(const Scenario& scenario, const Tuning& tuning);

namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Estimator> (*make)(const Scenario&, const Tuning&);
};

constexpr Entry kAlgorithms[] = {
    {"ekf", make_ekf},
    {"ukf", make_ukf},
    {"sqrt_ukf", make_sqrt_ukf},
    {"mhe", make_mhe},
    {"pf", make_pf},
    {"asir", make_asir},
    {"rbpf", make_rbpf},
    {"imm", make_imm},
    {"hierarchical_ekf", make_hierarchical_ekf},
    {"hierarchical_mhe", make_hierarchical_mhe},
};

// Of a strapdown model; a name may stand in both lists.
struct NavigationAlgorithm {
  const char* name;
  std::unique_ptr<NavigationFilter> (*make)(const Strapdown&, const StrapdownTuning&);
};

constexpr NavigationAlgorithm kNavigation[] = {
    {"es_ekf", make_es_ekf},
    {"ukf", make_navigation_ukf},
};

const NavigationAlgorithm* find_navigation(const std::string& algorithm) {
  for (const NavigationAlgorithm& e : kNavigation)
    if (algorithm == e.name) return &e;
  return nullptr;
}

bool is_known(const std::string& algorithm) {
  const std::vector<std::string> known = algorithm_names();
  return std::find(known.begin(), known.end(), algorithm) != known.end();
}

std::string unknown_algorithm(const std::string& algorithm) {
  return fmt::format("unknown algorithm '{}'; expected one of: {}", algorithm, fmt::join(algorithm_names(), ", "));
}

template <typename Entries>
std::string names_of(const Entries& entries) {
  std::vector<std::string> names;
  for (const auto& e : entries) names.emplace_back(e.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string misfit(const std::string& algorithm, const Scenario& scenario) {
  const bool strapdown = scenario.estimator.strapdown.has_value();
  return fmt::format("algorithm '{}' does not work on the model of scenario '{}'{}; expected one of: {}", algorithm,
                     scenario.name, strapdown ? " ('strapdown')" : "",
                     strapdown ? names_of(kNavigation) : names_of(kAlgorithms));
}

const Tuning& tuning_of(const Scenario& scenario, const std::string& tuning) {
  const auto found = scenario.estimator.tunings.find(tuning);
  if (found != scenario.estimator.tunings.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [name, unused] : scenario.estimator.tunings) names.push_back(name);
  throw Refusal(fmt::format("unknown tuning '{}'; scenario '{}' has: {}", tuning, scenario.name, fmt::join(names, ", ")));
}

}  // namespace

std::vector<std::string> algorithm_names() {
  std::vector<std::string> names;
  for (const Entry& e : kAlgorithms) names.emplace_back(e.name);
  for (const NavigationAlgorithm& e : kNavigation)
    if (std::find(names.begin(), names.end(), e.name) == names.end()) names.emplace_back(e.name);
  return names;
}

std::unique_ptr<Estimator> make_estimator(const std::string& algorithm, const Scenario& scenario, const std::string& tuning) {
  const Tuning& known = tuning_of(scenario, tuning);
  if (scenario.estimator.strapdown) throw Refusal(misfit(algorithm, scenario));
  for (const Entry& e : kAlgorithms)
    if (algorithm == e.name) return e.make(scenario, known);
  throw Refusal(find_navigation(algorithm) ? misfit(algorithm, scenario) : unknown_algorithm(algorithm));
}

std::unique_ptr<RunFollower> make_follower(const std::string& algorithm, const std::string& name, std::int64_t run_id,
                                           const Scenario& scenario, const std::string& tuning, FollowHooks hooks) {
  const Tuning& known = tuning_of(scenario, tuning);
  if (!scenario.estimator.strapdown)
    return std::make_unique<EstimatorSession>(name, run_id, scenario, known, make_estimator(algorithm, scenario, tuning),
                                              std::move(hooks.publish));
  const NavigationAlgorithm* const navigation = find_navigation(algorithm);
  if (!navigation) throw Refusal(is_known(algorithm) ? misfit(algorithm, scenario) : unknown_algorithm(algorithm));
  return std::make_unique<NavigationSession>(name, run_id, scenario, known.strapdown,
                                             navigation->make(*scenario.estimator.strapdown, known.strapdown),
                                             std::move(hooks));
}

}  // namespace slipstream
