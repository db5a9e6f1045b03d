// What the experiments of document 001 share: its axes and angles, their errors with three standard deviations, and starts
// drawn from what a filter believes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "reproduce/monte_carlo.hpp"

namespace slipstream {

struct NavigationAxis {
  const char* state;
  const char* name;
};
inline constexpr std::array<NavigationAxis, 3> kAxes{{{"east_m", "east"}, {"north_m", "north"}, {"up_m", "up"}}};
inline constexpr std::array<NavigationAxis, 3> kAngles{{{"roll_rad", "roll"}, {"pitch_rad", "pitch"}, {"yaw_rad", "yaw"}}};
inline constexpr double kDegPerRad = 180.0 / kPi;

// One follower of a played drive, to be drawn.
struct Shown {
  const Played* played;
  std::size_t track;
  std::string label;
};

// Three panels each: the error, and three standard deviations to either side of zero. Angles in degrees.
Picture axis_errors(const std::string& item, const std::string& title, const std::vector<Shown>& shown,
                    const std::string& caption, const std::vector<double>& marks_s = {});
Picture angle_errors(const std::string& item, const std::string& title, const std::vector<Shown>& shown,
                     const std::string& caption, const std::vector<double>& marks_s = {});

// The GNSS fixes of a drive, in W; t_s is when they came.
struct FixSeries {
  std::vector<double> t_s;
  std::array<std::vector<double>, 3> axis;
};
FixSeries gnss_fixes(const Scenario& scenario, const Played& played);

// Of the distance between estimate and truth, in metres, from an instant on.
double distance_rmse_m(const Played& p, std::size_t track, double from_s = 0.0);
double largest(const std::vector<double>& error);  // of what is known
// The share of the known errors within three of their standard deviations, per cent.
double within_three_sigma_percent(const Played& p, std::size_t track, const std::string& state);

// The mean of a tuning's start is drawn from its own distribution around the truth, and so are the IMU's true biases.
void draw_navigation_start(Scenario& scenario, const std::string& tuning);

// Sums of NEES over runs, by the row of the estimates: their mean must lie in the band of chi-square means at 95 % of the
// instants.
struct NeesOverRuns {
  std::vector<double> t_s, sum;
  std::vector<int> dimension;
  std::vector<double> last;  // of each run, at its end
  int runs = 0;
  void add(const Track& track);
  Row at_the_end(const std::string& item, const std::string& what, const std::string& mismatch = "") const;
  double percent_inside() const;  // of the instants
};
Picture nees_figure(const std::string& item, const std::string& title,
                    const std::vector<std::pair<std::string, const NeesOverRuns*>>& shown, const std::string& caption);

}  // namespace slipstream
