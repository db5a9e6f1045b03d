// What a sensor type is: the name a scenario calls it by, the quantity of the truth it measures, and the key of its absolute
// noise. Its noise law is in noise.hpp; models/sensors/all.hpp lists the types.
#pragma once

#include <string_view>

#include "models/vehicle.hpp"

namespace slipstream {

struct SensorType {
  std::string_view name;
  Quantity quantity;
  std::string_view noise_key;
};

}  // namespace slipstream
