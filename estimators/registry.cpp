#include "estimators/registry.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/refusal.hpp"

namespace slipstream {

// Each is defined in the .cpp of its name; the hierarchical ones in hierarchical.cpp.
std::unique_ptr<Estimator> make_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_mhe(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_pf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_hierarchical_ekf(const Scenario& scenario, const Tuning& tuning);
std::unique_ptr<Estimator> make_hierarchical_mhe(const Scenario& scenario, const Tuning& tuning);

namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Estimator> (*make)(const Scenario&, const Tuning&);
};

constexpr Entry kAlgorithms[] = {
    {"ekf", make_ekf},
    {"mhe", make_mhe},
    {"pf", make_pf},
    {"hierarchical_ekf", make_hierarchical_ekf},
    {"hierarchical_mhe", make_hierarchical_mhe},
};

}  // namespace

std::vector<std::string> algorithm_names() {
  std::vector<std::string> names;
  for (const Entry& e : kAlgorithms) names.emplace_back(e.name);
  return names;
}

std::unique_ptr<Estimator> make_estimator(const std::string& algorithm, const Scenario& scenario, const std::string& tuning) {
  const auto found = scenario.estimator.tunings.find(tuning);
  if (found == scenario.estimator.tunings.end()) {
    std::vector<std::string> names;
    for (const auto& [name, unused] : scenario.estimator.tunings) names.push_back(name);
    throw Refusal(fmt::format("unknown tuning '{}'; scenario '{}' has: {}", tuning, scenario.name, fmt::join(names, ", ")));
  }
  for (const Entry& e : kAlgorithms)
    if (algorithm == e.name) return e.make(scenario, found->second);
  throw Refusal(fmt::format("unknown algorithm '{}'; expected one of: {}", algorithm, fmt::join(algorithm_names(), ", ")));
}

}  // namespace slipstream
