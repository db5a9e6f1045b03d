// Why a sensor's innovations are inconsistent, in one plain sentence. Pure functions of what an estimator said.
//
// Position sensors that disagree. Let G and L be two position sensors of one estimator, L the suspect: the one whose fixes come
// in a map's frame of their own. Where a fix of one follows directly on a fix of the other, within a second, what they measured
// differs by
//   d = nu_L - r_G   (L second)   or   d = r_L - nu_G   (G second),     r_i = (1 - P_ii/S_ii) nu_i
// nu the innovation, S its covariance, P the position's covariance before; r is what is left of the first innovation after the
// update with it (nu itself if it was gated), because the second one is measured against the updated position. Lever arms
// cancel if they are right, and so does the error of the estimate. Each explanation is fitted by least squares to the d, in W's
// axes:
//   shift       d = t                       the offset of L's map
//   lever arm   d = R_WB l                  where L sits on the body
//   rotation    d = t + phi x (p - p mean)  the angle of L's map; left out are principal directions about which the drive
//                                          says nothing, or whose component of phi is below four
//                                          standard deviations
// The one with the least  3N ln(SS_res) + k ln(3N)  (Schwarz 1978; k = 3, 3, 6) is the cause if it explains half of sum |d|^2,
// and if its parameters are not by chance: (SS_tot - SS_res)/k > 10 SS_res/(3N - k). No mounting begins to be wrong
// during a drive: a shift that begins after ten consistent fixes of the sensor is not yet explained. And none mends itself:
// such a finding has no end, and takes in what the two sensors do later. The fitted phi turns the fixes: R_used = exp(phi)
// R_right. Before all this: the first of the two jumps, if the first outlier of its episode comes after ten consistent fixes,
// is three times the outliers' bound (sensor_watch.hpp) and not below the mean NIS of the episode. The other one then only
// follows the estimate.
//
// One sensor.
//   jumps       at most half of the episode's measurements are outliers (sensor_watch.hpp),
//               and without them the mean NIS is below 1.5 d;
//               or a position sensor jumps as above
//   scale       forward speed: nu = k v, v the estimated speed; the cause if it explains half of sum nu^2
//   otherwise   the sensor's own question (innovation_sensors.hpp)
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/rotation.hpp"
#include "monitor/run_record.hpp"
#include "monitor/sensor_watch.hpp"

namespace slipstream {

enum class Cause { kUnknown, kShift, kLeverArm, kRotation, kJump, kScale, kSilent };
const char* cause_name(Cause cause);

struct Finding {
  std::string sensor;  // the suspect
  std::string other;   // position sensor that it disagrees with; or empty
  Cause cause = Cause::kUnknown;
  double since_s = 0.0;
  std::optional<double> until_s;
  double nis = 0.0, dimension = 0.0;  // means over the episode, of the less consistent one of the two
  std::int64_t measured = 0, outliers = 0, gated = 0;
  std::vector<double> value;  // what was fitted: t or l (m), phi (rad), or k; empty: nothing
  std::string text;           // one sentence without a full stop
};

// Difference of two position sensors at a place.
struct PositionPair {
  Vector3 d, p;
  Matrix3 R_WB;
};

struct PairFit {
  Cause cause = Cause::kUnknown;
  Vector3 value = Vector3::Zero();  // t (m), l (m) or phi (rad)
  double explained = 0.0;           // 1 - SS_res/SS_tot
};
PairFit fit_pairs(std::span<const PositionPair> pairs);

// Of the suspect's and the other's fixes in the rows [begin, end) of the record.
std::vector<PositionPair> position_pairs(const EstimatorRecord& r, const std::string& suspect, const std::string& other,
                                         std::size_t begin, std::size_t end);

// Where the sensor's fixes lie in W by what the estimator said: its position after the update plus r. Empty without such a
// sensor.
std::vector<Vector3> fix_positions(const EstimatorRecord& r, const std::string& sensor);

struct Ailing {
  std::string sensor;
  Episode episode;
};

// One finding for each, but one for position sensors that disagree at the same time. In order of their beginning, disagreements
// first.
std::vector<Finding> diagnose(const EstimatorRecord& r, const std::vector<Ailing>& ailing);

// "GNSS silent since 20.0 s"
Finding silence(const std::string& sensor, Utime since, std::optional<Utime> until);

}  // namespace slipstream
