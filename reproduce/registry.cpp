#include "reproduce/experiment.hpp"

namespace slipstream {

// Each is defined in the .cpp of its name, those of a section together.
void reproduce_tracking(const Bench& bench, Outcome& o);
void reproduce_localisation(const Bench& bench, Outcome& o);
void reproduce_localisation_city(const Bench& bench, Outcome& o);
void reproduce_localisation_recorded(const Bench& bench, Outcome& o);
void reproduce_tyre(const Bench& bench, Outcome& o);
void reproduce_snow(const Bench& bench, Outcome& o);
void reproduce_stand(const Bench& bench, Outcome& o);
void reproduce_ground_simulation(const Bench& bench, Outcome& o);
void reproduce_ground_experiment(const Bench& bench, Outcome& o);
void reproduce_recorded(const Bench& bench, Outcome& o);
void reproduce_circle(const Bench& bench, Outcome& o);
void reproduce_lane_change(const Bench& bench, Outcome& o);
void reproduce_track(const Bench& bench, Outcome& o);
void reproduce_lateral_track(const Bench& bench, Outcome& o);
void reproduce_slalom(const Bench& bench, Outcome& o);
void reproduce_race_car(const Bench& bench, Outcome& o);
void reproduce_moving_horizon(const Bench& bench, Outcome& o);
void reproduce_drivetrain(const Bench& bench, Outcome& o);
void reproduce_unimog_particles(const Bench& bench, Outcome& o);
void reproduce_unimog(const Bench& bench, Outcome& o);
void reproduce_consistency(const Bench& bench, Outcome& o);
void reproduce_unimog_torque(const Bench& bench, Outcome& o);
void reproduce_unimog_grade(const Bench& bench, Outcome& o);
void reproduce_available_friction(const Bench& bench, Outcome& o);

namespace {

// "Fig. 5", "Fig. 6" ...
std::vector<std::string> items(std::initializer_list<std::pair<int, int>> figures, std::initializer_list<int> tables) {
  std::vector<std::string> names;
  for (const auto& [first, last] : figures)
    for (int n = first; n <= last; ++n) names.push_back("Fig. " + std::to_string(n));
  for (const int n : tables) names.push_back("Table " + std::to_string(n));
  return names;
}

constexpr const char* k000Section4 = "Section 4: tracking a car in the plane";
constexpr const char* k001Chapter4 = "Chapter 4: localisation with IMU and GNSS";
constexpr const char* k001Beyond = "Beyond the document";
constexpr const char* kChapter3 = "Chapter 3: fundamentals";
constexpr const char* kChapter4 = "Chapter 4: particle filter on snow";
constexpr const char* kChapter5 = "Chapter 5: scale car, hierarchical observer";
constexpr const char* kChapter6 = "Chapter 6: lateral dynamics";
constexpr const char* kPastLateral = "Lateral dynamics with nonlinear tyres, past chapter 6";
constexpr const char* kChapter7 = "Chapter 7: Unimog";
constexpr const char* kPastHorizon = "Moving horizon, past chapters 5 to 7";
constexpr const char* kPastUnimog = "Friction of the Unimog, past chapter 7";
constexpr const char* kConsistency = "What the estimators claim, and what can be known";

}  // namespace

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all{
      {"000", "tracking", k000Section4, "Particle filter against unscented Kalman filter",
       [] {
         std::vector<std::string> names = items({{3, 9}}, {1});
         names.emplace_back("Sampling period");
         return names;
       }(),
       0.5, reproduce_tracking, false, 10},
      {"001", "localisation", k001Chapter4, "A car for two seconds, GNSS at 25, 50 and 100 Hz", items({{5, 15}}, {}), 0.1,
       reproduce_localisation, false, 50},
      {"001",
       "localisation_city",
       k001Beyond,
       "A minute of city driving, GNSS at 25, 50 and 100 Hz",
       {"City drive"},
       1.2,
       reproduce_localisation_city,
       false,
       50},
      {"001",
       "localisation_recorded",
       k001Beyond,
       "A recorded drive, with GNSS and LIDAR",
       {"Recorded drive"},
       0.1,
       reproduce_localisation_recorded,
       true},
      {"002", "tyre", kChapter3, "The magic formula on four surfaces", items({{1, 1}}, {1}), 0.01, reproduce_tyre},
      {"002", "snow", kChapter4, "Friction of a light vehicle on snow", items({{5, 13}}, {3, 4}), 0.5, reproduce_snow},
      {"002", "stand", kChapter5, "A suspended wheel, identified by particle swarm", items({{16, 17}}, {5, 6}), 1.0,
       reproduce_stand},
      {"002", "ground_simulation", kChapter5, "The hierarchical observer on a simulated scale car", items({{18, 20}}, {7}), 1.5,
       reproduce_ground_simulation},
      {"002", "ground_experiment", kChapter5, "The hierarchical observer on a richer plant", items({{21, 25}}, {8, 9}), 2.5,
       reproduce_ground_experiment},
      {"002",
       "recorded",
       kChapter5,
       "Recorded drives of a real 1:10 car",
       {"Drive ds5a", "Drive ds3"},
       0.1,
       reproduce_recorded,
       true},
      {"002", "circle", kChapter6, "Circle", items({{26, 28}}, {10, 11}), 2.0, reproduce_circle},
      {"002", "lane_change", kChapter6, "Single lane change", items({{29, 32}}, {}), 1.2, reproduce_lane_change},
      {"002", "track", kChapter6, "Standard track", items({{33, 35}}, {12}), 3.5, reproduce_track},
      {"002", "drivetrain", kChapter7, "Engine, gears and wheel torque of the Unimog", items({{37, 40}}, {13, 14, 15}), 0.01,
       reproduce_drivetrain},
      {"002", "unimog_particles", kChapter7, "Particle filter on the Unimog, from the wheel speed alone", items({{41, 50}}, {}),
       0.3, reproduce_unimog_particles},
      {"002", "unimog", kChapter7, "EKF and moving horizon on the Unimog", items({{51, 58}}, {16}), 1.5, reproduce_unimog},
      {"002",
       "consistency",
       kConsistency,
       "NEES, NIS and observability",
       {"Consistency", "Eq. 5.5", "Observability"},
       1.6,
       reproduce_consistency},
      {"past",
       "unimog_torque",
       kPastUnimog,
       "Friction that follows the torque",
       {"Torque and friction"},
       0.1,
       reproduce_unimog_torque},
      {"past",
       "unimog_grade",
       kPastUnimog,
       "An unknown hill, an unknown load, braking",
       {"Hill and load"},
       0.1,
       reproduce_unimog_grade},
      {"past",
       "available_friction",
       kPastUnimog,
       "How much friction there is, and when that can be known",
       {"Available friction", "Available friction, gentle"},
       0.5,
       reproduce_available_friction},
      {"past",
       "lateral_track",
       kPastLateral,
       "Tyre parameters that respond: the standard track",
       {"Lateral track"},
       0.3,
       reproduce_lateral_track},
      {"past", "slalom", kPastLateral, "Tyre parameters that respond: a slalom", {"Slalom"}, 0.2, reproduce_slalom},
      {"past", "race_car", kPastLateral, "Sideslip of a recorded race car", {"Race car"}, 0.1, reproduce_race_car, true},
      {"past",
       "moving_horizon",
       kPastHorizon,
       "Moving horizon in microseconds",
       {"Moving horizon"},
       0.8,
       reproduce_moving_horizon},
  };
  return all;
}

}  // namespace slipstream
