#include "reproduce/localisation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/geodesy.hpp"
#include "common/random.hpp"
#include "models/strapdown.hpp"

namespace slipstream {
namespace {

constexpr const char* kZero = "with lines lc rgb \"#000000\" lw 0.8";

Picture errors(const std::string& item, const std::string& title, const std::vector<Shown>& shown,
               const std::array<NavigationAxis, 3>& states, double scale, const std::string& unit, const std::string& caption,
               const std::vector<double>& marks_s) {
  Sketch sketch(item, title, shown.front().played->tracks[shown.front().track].t_s.back(), marks_s);
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const auto& [played, index, label] = shown[k];
    const Track& track = played->tracks[index];
    for (const NavigationAxis& axis : states) {
      std::vector<double> error = played->error(index, axis.state), low = track.sigma_of(axis.state), high = low;
      std::vector<double> known;
      for (std::size_t i = 0; i < error.size(); ++i) {
        error[i] *= scale;
        high[i] *= 3.0 * scale;
        low[i] = -high[i];
        if (std::isfinite(error[i])) known.insert(known.end(), {error[i], low[i], high[i]});
      }
      const Band range = range_of({known});
      sketch.panel(fmt::format("{} ({})", axis.name, unit), 150)
          .range(range.low, range.high)
          .band(label + ", 3 sigma", track.t_s, low, high, estimator_style(k).colour)
          .level("", 0.0, kZero)
          .line(label + ", error", track.t_s, error, line_of(k, 1.6));
    }
  }
  return sketch.finish(caption);
}

}  // namespace

Picture axis_errors(const std::string& item, const std::string& title, const std::vector<Shown>& shown,
                    const std::string& caption, const std::vector<double>& marks_s) {
  return errors(item, title, shown, kAxes, 1.0, "m", caption, marks_s);
}
Picture angle_errors(const std::string& item, const std::string& title, const std::vector<Shown>& shown,
                     const std::string& caption, const std::vector<double>& marks_s) {
  return errors(item, title, shown, kAngles, kDegPerRad, "deg", caption, marks_s);
}

FixSeries gnss_fixes(const Scenario& scenario, const Played& played) {
  const LocalFrame world(scenario.world.origin);
  const Series& latitude = played.measured.at("latitude_deg");
  FixSeries fixes;
  fixes.t_s = latitude.t_s;
  for (std::size_t i = 0; i < latitude.value.size(); ++i) {
    const Vector<double, 3> p = world.to_enu(
        {latitude.value[i], played.measured.at("longitude_deg").value[i], played.measured.at("height_m").value[i]});
    for (std::size_t a = 0; a < 3; ++a) fixes.axis[a].push_back(p[static_cast<int>(a)]);
  }
  return fixes;
}

double distance_rmse_m(const Played& p, std::size_t track, double from_s) {
  std::array<std::vector<double>, 3> e;
  for (std::size_t a = 0; a < 3; ++a) e[a] = p.error(track, kAxes[a].state);
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < e[0].size(); ++i) {
    const double squared = e[0][i] * e[0][i] + e[1][i] * e[1][i] + e[2][i] * e[2][i];
    if (p.tracks[track].t_s[i] < from_s || !std::isfinite(squared)) continue;
    sum += squared;
    ++n;
  }
  return std::sqrt(sum / static_cast<double>(n));
}

double largest(const std::vector<double>& error) {
  double most = std::nan("");
  for (const double e : error) most = std::fmax(most, std::abs(e));
  return most;
}

double within_three_sigma_percent(const Played& p, std::size_t track, const std::string& state) {
  const std::vector<double> e = p.error(track, state);
  const std::vector<double>& sigma = p.tracks[track].sigma_of(state);
  double inside = 0.0, known = 0.0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    if (!std::isfinite(e[i])) continue;
    known += 1.0;
    // 1e-9: a start that is known to the bit has no width.
    inside += std::abs(e[i]) <= 3.0 * sigma[i] + 1e-9 ? 1.0 : 0.0;
  }
  return 100.0 * inside / known;
}

void draw_navigation_start(Scenario& s, const std::string& tuning) {
  StrapdownTuning& t = s.estimator.tunings.at(tuning).strapdown;
  Scenario beginning = s;
  beginning.run.duration_s = 0.1;
  const Played truth = play(beginning, {});
  const auto drawn = [&](const std::string& name, double mean, double deviation) {
    RandomStream random(s.run.seed, 0, "start." + name);
    return mean + deviation * random.normal();
  };
  const auto draw = [&](Vector3& mean, const Vector3& deviation, std::size_t first) {
    for (int i = 0; i < 3; ++i) {
      const std::string state(Strapdown::kStateNames[first + static_cast<std::size_t>(i)].name);
      mean[i] = drawn(state, truth.truth_of(state).front(), deviation[i]);
    }
  };
  draw(t.initial_position_m, t.position_deviation_m, 0);
  draw(t.initial_velocity_mps, t.velocity_deviation_mps, 3);
  draw(t.initial_rpy_rad, t.rpy_deviation_rad, 6);
  // The filter believes that biases are zero: it is the IMU that differs from that.
  for (int i = 0; i < 3; ++i) {
    s.imu->bias_mps2[i] = drawn(fmt::format("accelerometer_bias.{}", i), 0.0, t.accelerometer_bias_deviation_mps2);
    s.imu->bias_radps[i] = drawn(fmt::format("gyro_bias.{}", i), 0.0, t.gyro_bias_deviation_radps);
  }
}

void NeesOverRuns::add(const Track& track) {
  if (runs++ == 0) {
    t_s = track.t_s;
    dimension = track.nees_dimension;
    sum.assign(t_s.size(), 0.0);
  }
  for (std::size_t i = 0; i < std::min(sum.size(), track.nees.size()); ++i) sum[i] += track.nees[i];
  last.push_back(track.nees.back());
}

Row NeesOverRuns::at_the_end(const std::string& item, const std::string& what, const std::string& mismatch) const {
  const Consistency c = score_consistency(last, dimension.back());
  Row row =
      reported(item, fmt::format("mean NEES at the end, {}", what), "", {c.mean},
               fmt::format("{} states, 95 % band {:.2f} to {:.2f}; over the drive the mean of the runs is inside the band at "
                           "{:.0f} % of the instants, 95 % expected",
                           dimension.back(), c.band.low, c.band.high, percent_inside()));
  row.runs = runs;
  row.verdict = c.within ? "inside the 95 % band" : c.mean < c.band.low ? "below the 95 % band" : "above the 95 % band";
  if (!mismatch.empty()) row.verdict += ": the model does not match the plant, because " + mismatch;
  return row;
}

double NeesOverRuns::percent_inside() const {
  double inside = 0.0, known = 0.0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (!std::isfinite(sum[i])) continue;
    known += 1.0;
    inside += mean_chi_square_band(runs, dimension[i]).contains(sum[i] / runs) ? 1.0 : 0.0;
  }
  return 100.0 * inside / known;
}

Picture nees_figure(const std::string& item, const std::string& title,
                    const std::vector<std::pair<std::string, const NeesOverRuns*>>& shown, const std::string& caption) {
  Sketch sketch(item, title, shown.front().second->t_s.back());
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const auto& [label, nees] = shown[k];
    std::vector<double> mean = nees->sum;
    for (double& m : mean) m /= nees->runs;
    const int dimension = nees->dimension.back();
    const Band band = mean_chi_square_band(nees->runs, dimension);
    const std::vector<double> ends{nees->t_s.front(), nees->t_s.back()};
    const double half = 1.5 * (band.high - band.low);
    sketch.panel(label, 170)
        .range(std::max(0.0, dimension - half), dimension + half)
        .band("95 % band of the mean", ends, {band.low, band.low}, {band.high, band.high}, "#9a9a9a")
        .line("mean of the runs", nees->t_s, mean, line_of(0, 1.4));
  }
  return sketch.finish(caption);
}

}  // namespace slipstream
