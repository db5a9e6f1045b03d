// scenarios/stand.toml played for a seed: what an identification gets to see, and what it should find.
#pragma once

#include <string>

#include "estimators/identification/stand.hpp"
#include "io/scenario_reader.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream::test {

inline constexpr double kResidualCurrent_a = 0.3;  // of the sensor, added to what it measures

inline Scenario stand_scenario(const std::vector<std::string>& overrides = {}) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/stand.toml", overrides).scenario;
}

inline StandRecord record_of(Scenario scenario, std::uint64_t seed) {
  scenario.run.seed = seed;
  const auto drive = make_simulated_drive(scenario);
  StandRecord record;
  DriveEpoch epoch;
  while (drive->next(epoch)) {
    record.utime.push_back(epoch.utime);
    for (const NamedValue& r : epoch.readings) {
      const std::string& name = drive->quantities()[static_cast<std::size_t>(r.channel)];
      if (name == "wheel_speed_radps") record.wheel_speed_radps.push_back(r.value.scalar());
      if (name == "motor_current_a") record.current_a.push_back(r.value.scalar() + kResidualCurrent_a);
    }
  }
  return record;
}

}  // namespace slipstream::test
