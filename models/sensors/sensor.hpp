// What a sensor type is: the name a scenario calls it by, the quantity of the truth it measures, and the key of its absolute
// noise. Its noise law is in noise.hpp; models/sensors/all.hpp lists the types.
#pragma once

#include <string>
#include <string_view>

#include "models/vehicle.hpp"

namespace slipstream {

struct SensorType {
  std::string_view name;
  Quantity quantity;
  std::string_view noise_key;

  // The key of another property in the same unit: key("bias") is "bias_radps" where noise_key is "noise_radps".
  std::string key(const std::string& property) const { return property + std::string(noise_key.substr(noise_key.find('_'))); }
};

}  // namespace slipstream
