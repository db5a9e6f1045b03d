// Which sensor an innovation is of: several quantities may be one reading, which is consistent or not as a whole.
//
//   gnss_*, lidar_*       a position fix, three numbers in W's axes
//   nonholonomic_*        no sensor but a constraint: the body moves neither sideways nor upwards
//   any other quantity    a sensor of its own, of that name
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "monitor/text.hpp"

namespace slipstream {

struct InnovationSensor {
  std::string_view name;  // the quantities begin with this and '_'
  std::string_view label;
  std::string_view subject;   // of a sentence; plural
  std::string_view question;  // to ask when it is inconsistent and nothing else explains it
  bool is_position = false;   // its quantities are NAME_east_m, NAME_north_m, NAME_up_m
  bool has_map = false;       // its fixes come in a frame of their own, which may be turned or shifted
  bool is_read = true;        // it has readings, and so may fall silent
};

inline constexpr std::array<InnovationSensor, 3> kInnovationSensors{
    {{"gnss", "GNSS", "GNSS fixes", "are they less accurate than believed?", true, false, true},
     {"lidar", "LIDAR", "LIDAR fixes", "are they less accurate than believed?", true, true, true},
     {"nonholonomic", "nonholonomic", "sideways and upward speeds", "does the car slide, or is the IMU mounted at an angle?",
      false, false, false}}};

// Null: the quantity is a sensor of its own.
inline const InnovationSensor* known_sensor(std::string_view name_or_quantity) {
  for (const InnovationSensor& sensor : kInnovationSensors)
    if (name_or_quantity.starts_with(sensor.name) &&
        (name_or_quantity.size() == sensor.name.size() || name_or_quantity[sensor.name.size()] == '_'))
      return &sensor;
  return nullptr;
}

inline std::string sensor_of(std::string_view quantity) {
  const InnovationSensor* sensor = known_sensor(quantity);
  return std::string(sensor ? sensor->name : quantity);
}

// "GNSS", "forward speed"
inline std::string sensor_label(std::string_view sensor) {
  const InnovationSensor* known = known_sensor(sensor);
  return known ? std::string(known->label) : readable_name(sensor);
}

}  // namespace slipstream
