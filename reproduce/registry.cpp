#include "reproduce/experiment.hpp"

namespace slipstream {

// Each is defined in the .cpp of its name.
void reproduce_tyre(const Bench& bench, Outcome& o);
void reproduce_drivetrain(const Bench& bench, Outcome& o);
void reproduce_unimog(const Bench& bench, Outcome& o);

namespace {

// "Fig. 5", "Fig. 6" ...
std::vector<std::string> items(std::initializer_list<std::pair<int, int>> figures, std::initializer_list<int> tables) {
  std::vector<std::string> names;
  for (const auto& [first, last] : figures)
    for (int n = first; n <= last; ++n) names.push_back("Fig. " + std::to_string(n));
  for (const int n : tables) names.push_back("Table " + std::to_string(n));
  return names;
}

constexpr const char* kChapter3 = "Chapter 3: fundamentals";
constexpr const char* kChapter7 = "Chapter 7: Unimog";

}  // namespace

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all{
      {"tyre", kChapter3, "The magic formula on four surfaces", items({{1, 1}}, {1}), 0.01, reproduce_tyre},
      {"drivetrain", kChapter7, "Engine, gears and wheel torque of the Unimog", items({{37, 40}}, {13, 14, 15}), 0.01,
       reproduce_drivetrain},
      {"unimog", kChapter7, "EKF and moving horizon on the Unimog", items({{51, 58}}, {16}), 1.5, reproduce_unimog},
  };
  return all;
}

}  // namespace slipstream
