// The names in models/registry.hpp and models/sensors/all.hpp at run time: what a scenario file may say.
#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/readings.hpp"
#include "models/registry.hpp"
#include "models/sensors/all.hpp"
#include "models/strapdown.hpp"

namespace slipstream {

// Calls f(T{}) for every alternative T of the variant.
template <typename Variant, typename F>
void for_each_alternative(const F& f) {
  [&]<std::size_t... I>(std::index_sequence<I...>) { (f(std::variant_alternative_t<I, Variant>{}), ...); }
  (std::make_index_sequence<std::variant_size_v<Variant>>{});
}

template <typename Variant>
std::vector<std::string> registered_names() {
  std::vector<std::string> names;
  for_each_alternative<Variant>([&](const auto& item) { names.emplace_back(std::remove_cvref_t<decltype(item)>::kName); });
  return names;
}

// The alternative of that kName with default parameters; the name must be a registered one.
template <typename Variant>
Variant make_registered(std::string_view name) {
  Variant made;
  for_each_alternative<Variant>([&](const auto& item) {
    if (std::remove_cvref_t<decltype(item)>::kName == name) made = item;
  });
  return made;
}

template <typename Quantities>
std::vector<std::string> names_of(const Quantities& quantities) {
  std::vector<std::string> names;
  for (const Quantity& q : quantities) names.emplace_back(q.name);
  return names;
}

// Of [sensor.NAME]: the types that measure one number, then those whose readings have several.
inline std::vector<std::string> sensor_names() {
  std::vector<std::string> names;
  for (const SensorType& type : kSensorTypes) names.emplace_back(type.name);
  for (const std::string_view group : {kImu, kGnss, kLidar}) names.emplace_back(group);
  return names;
}

// Every quantity that some vehicle shows as truth, some process model has as state, input or output, or some sensor measures.
inline std::vector<Quantity> known_quantities() {
  std::vector<Quantity> known;
  const auto add = [&](const auto& quantities) {
    for (const Quantity& q : quantities) {
      bool present = false;
      for (const Quantity& k : known) present = present || k.name == q.name;
      if (!present) known.push_back(q);
    }
  };
  for_each_alternative<AnyVehicle>([&](const auto& v) { add(std::remove_cvref_t<decltype(v)>::kTruth); });
  for_each_alternative<AnyProcess>([&](const auto& p) {
    using P = std::remove_cvref_t<decltype(p)>;
    add(P::kStateNames), add(P::kInputNames), add(P::kOutputNames);
  });
  add(Strapdown::kStateNames);
  for (const SensorType& type : kSensorTypes) add(std::vector<Quantity>{type.quantity});
  return known;
}

inline std::string unit_of(std::string_view quantity) {
  for (const Quantity& q : known_quantities())
    if (q.name == quantity) return std::string(q.unit);
  return "";
}

}  // namespace slipstream
