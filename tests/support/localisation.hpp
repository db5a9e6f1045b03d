// A strapdown filter followed in process, on a simulated or recorded drive whose messages may be tampered with; and its scores.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/rotation.hpp"
#include "estimators/follower.hpp"
#include "io/recorded_files.hpp"
#include "io/scenario_reader.hpp"
#include "plant/recorded_drive.hpp"
#include "plant/simulated_drive.hpp"

namespace slipstream::test {

inline Scenario shipped(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return load_scenario_file(std::string(SLIPSTREAM_SOURCE_DIR) + "/scenarios/" + name + ".toml", overrides).scenario;
}

// The folder of a recorded drive; empty without the data.
inline std::string recorded_folder(const std::string& name) {
  const std::string data = SLIPSTREAM_DATA_DIR;
  return data.empty() ? data : data + "/" + name;
}
#define SLIPSTREAM_NEEDS_DATA(name) \
  if (recorded_folder(name).empty()) GTEST_SKIP() << "no recorded drives: SLIPSTREAM_DATA is not set"

struct Localised {
  std::vector<Estimate> estimates;
  std::vector<std::string> truth_names;
  std::map<Utime, std::vector<double>> truth;
  std::map<std::string, int> complaints;  // "quantity: reason"
  std::map<std::string, int> said;

  // Of the nine states at an instant: linear between two samples at most 0.2 s apart, angles on the circle; empty where there
  // is none.
  std::optional<Eigen::VectorXd> truth_at(Utime utime) const {
    const auto after = truth.lower_bound(utime);
    if (after == truth.end()) return std::nullopt;
    if (after->first == utime) return states_of(after->second);
    if (after == truth.begin()) return std::nullopt;
    const auto before = std::prev(after);
    if (after->first - before->first > 200'000) return std::nullopt;
    const Eigen::VectorXd from = states_of(before->second);
    Eigen::VectorXd way = states_of(after->second) - from;
    for (Eigen::Index i = 6; i < 9; ++i) way[i] = wrap_angle(way[i]);
    return from + static_cast<double>(utime - before->first) / static_cast<double>(after->first - before->first) * way;
  }
  // In the order of the estimator's states; NaN for what this drive does not know.
  Eigen::VectorXd states_of(const std::vector<double>& values) const {
    Eigen::VectorXd x = Eigen::VectorXd::Constant(9, std::nan(""));
    for (std::size_t i = 0; i < 9; ++i)
      for (std::size_t k = 0; k < truth_names.size(); ++k)
        if (truth_names[k] == Strapdown::kStateNames[i].name) x[static_cast<Eigen::Index>(i)] = values[k];
    return x;
  }
  // Calls f(estimate, its error) for the valid estimates with a truth in [from_s, to_s]; angles are wrapped.
  void each(double from_s, double to_s, const std::function<void(const Estimate&, const Eigen::VectorXd&)>& f) const {
    for (const Estimate& e : estimates) {
      const double t = seconds(e.header.utime);
      if (t < from_s || t > to_s || (e.status != EstimateStatus::kValid && e.status != EstimateStatus::kFallback)) continue;
      const auto x = truth_at(e.header.utime);
      if (!x || !x->head<6>().allFinite()) continue;
      Eigen::VectorXd d = Eigen::Map<const Eigen::VectorXd>(e.mean.data(), 9) - *x;
      for (Eigen::Index i = 6; i < 9; ++i) d[i] = wrap_angle(d[i]);
      f(e, d);
    }
  }
  // Root of the mean squared length of the error's components [first, first + count).
  double rmse(int first, int count, double from_s = 0.0, double to_s = 1e9) const {
    double sum = 0.0;
    std::int64_t n = 0;
    each(from_s, to_s, [&](const Estimate&, const Eigen::VectorXd& d) {
      sum += d.segment(first, count).squaredNorm();
      ++n;
    });
    EXPECT_GT(n, 0) << "nothing to score";
    return std::sqrt(sum / static_cast<double>(n));
  }
  double position_rmse(double from_s = 0.0, double to_s = 1e9) const { return rmse(0, 3, from_s, to_s); }
  // NEES of the components [first, first + count); NaN where the covariance is not positive.
  static double nees(const Estimate& e, const Eigen::VectorXd& d, int first, int count) {
    const auto n = static_cast<Eigen::Index>(e.mean.size());
    const Eigen::Map<const Eigen::MatrixXd> P(e.covariance.data(), n, n);
    const Eigen::MatrixXd block = P.block(first, first, count, count);
    const Eigen::LLT<Eigen::MatrixXd> cholesky(block);
    if (cholesky.info() != Eigen::Success) return std::nan("");
    return cholesky.matrixL().solve(d.segment(first, count)).squaredNorm();
  }
  double mean_position_nees(double from_s = 0.0, double to_s = 1e9) const {
    double sum = 0.0;
    std::int64_t n = 0;
    each(from_s, to_s, [&](const Estimate& e, const Eigen::VectorXd& d) {
      const double q = nees(e, d, 0, 3);
      if (!std::isfinite(q)) return;  // the start is believed exactly
      sum += q;
      ++n;
    });
    return sum / static_cast<double>(n);
  }
  std::map<EstimateStatus, int> statuses() const {
    std::map<EstimateStatus, int> count;
    for (const Estimate& e : estimates) ++count[e.status];
    return count;
  }
};

// May change a reading, and says whether it is sent. Its header's utime is the time of measurement.
using Tamper = std::function<bool(Reading& reading)>;

// What becomes of a drive's messages on their way; by default they are handed on as they are.
struct Delivery {
  std::function<void(RunFollower&, Reading&)> reading = [](RunFollower& follower, Reading& r) { follower.on_reading(r); };
  std::function<void(RunFollower&, Utime)> tick = [](RunFollower& follower, Utime utime) { follower.on_tick(utime); };
};

// `scenario` is what the estimator believes of the drive.
inline Localised localise(const Scenario& scenario, DriveSource& drive, const std::string& algorithm, const std::string& tuning,
                          const Delivery& delivery) {
  Localised result;
  result.truth_names = drive.truth_names();
  const auto follower = make_follower(
      algorithm, "test", 1, scenario, tuning,
      {[&](const Estimate& e) { result.estimates.push_back(e); },
       [&](const std::string& quantity, const std::string& reason) { ++result.complaints[quantity + ": " + reason]; },
       [&](const std::string& line) { ++result.said[line]; }});
  std::vector<std::int64_t> seq(drive.quantities().size(), 0);
  DriveEpoch epoch;
  while (drive.next(epoch)) {
    for (const NamedValue& r : epoch.readings) {
      const auto channel = static_cast<std::size_t>(r.channel);
      Reading reading{{r.utime, seq[channel]++, 1}, drive.quantities()[channel], r.value};
      delivery.reading(*follower, reading);
    }
    delivery.tick(*follower, epoch.utime);
    if (!epoch.truth.empty()) result.truth[epoch.utime] = epoch.truth;
  }
  return result;
}

inline Localised localise(const Scenario& scenario, DriveSource& drive, const std::string& algorithm, const std::string& tuning,
                          const Tamper& tamper = nullptr) {
  Delivery delivery;
  if (tamper)
    delivery.reading = [&](RunFollower& follower, Reading& r) {
      if (tamper(r)) follower.on_reading(r);
    };
  return localise(scenario, drive, algorithm, tuning, delivery);
}

inline Localised localise_recorded(const Scenario& scenario, const std::string& folder, const std::string& algorithm,
                                   const std::string& tuning, const Tamper& tamper = nullptr) {
  RecordedDrive drive(load_recorded(scenario, folder), scenario.run.duration_s);
  return localise(scenario, drive, algorithm, tuning, tamper);
}

inline Localised localise_simulated(const Scenario& scenario, const std::string& algorithm, const std::string& tuning,
                                    const Tamper& tamper = nullptr) {
  return localise(scenario, *make_simulated_drive(scenario), algorithm, tuning, tamper);
}

}  // namespace slipstream::test
