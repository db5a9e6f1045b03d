#include "monitor/diagnosis.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "monitor/innovation_sensors.hpp"

namespace slipstream {
namespace {

constexpr std::array kAxes{"east", "north", "up"};
constexpr std::array kPlace{"east_m", "north_m", "up_m"}, kAttitude{"roll_rad", "pitch_rad", "yaw_rad"},
    kVelocity{"v_east_mps", "v_north_mps", "v_up_mps"};
constexpr std::size_t kLeastPairs = 8, kMostPairs = 4000, kEarlier = 10;
constexpr Utime kPairGap = 1'000'000;

// Columns of these states; empty: the estimator has not all of them.
using Columns = std::vector<std::size_t>;
Columns columns_of(const EstimatorRecord& r, const std::array<const char*, 3>& names) {
  Columns columns;
  for (const char* name : names) {
    const auto found = std::find(r.state_names.begin(), r.state_names.end(), name);
    if (found == r.state_names.end() || r.mean.size() != r.state_names.size()) return {};
    columns.push_back(static_cast<std::size_t>(found - r.state_names.begin()));
  }
  return columns;
}

Vector3 at(const EstimatorRecord& r, const Columns& columns, std::size_t row) {
  return {r.mean[columns[0]][row], r.mean[columns[1]][row], r.mean[columns[2]][row]};
}

// The innovations of a position sensor, and the rest of measurement k after the update with it.
struct Fixes {
  std::string name;
  const SensorRecord* record = nullptr;
  std::array<const InnovationRecord*, 3> axis{};

  Vector3 innovation(std::size_t k) const { return {axis[0]->innovation[k], axis[1]->innovation[k], axis[2]->innovation[k]}; }
  Vector3 rest(const EstimatorRecord& r, const Columns& place, std::size_t k) const {
    const std::size_t row = record->row[k];
    Vector3 nu = innovation(k);
    if (record->gated[k] != 0) return nu;
    for (std::size_t i = 0; i < 3; ++i) {
      const double S = axis[i]->sigma[k] * axis[i]->sigma[k];
      nu[static_cast<Eigen::Index>(i)] *= row > 0 ? 1.0 - std::min(r.variance(row - 1, place[i], place[i]) / S, 1.0) : NAN;
    }
    return nu;
  }
};

std::optional<Fixes> fixes_of(const EstimatorRecord& r, const std::string& sensor) {
  const auto found = r.sensors.find(sensor);
  if (found == r.sensors.end()) return std::nullopt;
  Fixes fixes{sensor, &found->second};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto innovation = r.innovation_of.find(sensor + "_" + kPlace[i]);
    if (innovation == r.innovation_of.end() || innovation->second.utime.size() != fixes.record->row.size()) return std::nullopt;
    fixes.axis[i] = &innovation->second;
  }
  return fixes;
}

std::string when(const Finding& f) {
  return f.until_s ? fmt::format("from {:.1f} s to {:.1f} s", f.since_s, *f.until_s) : fmt::format("since {:.1f} s", f.since_s);
}

std::string amount(double nis) { return fmt::format("{:.{}f}", nis, nis < 10.0 ? 1 : 0); }

std::string metres(const Vector3& v) { return fmt::format("({:.2f}, {:.2f}, {:.2f}) m", v[0], v[1], v[2]); }

// "2.9 degrees about up"; of a rotation about no single axis its whole angle.
std::string turn(const Vector3& phi) {
  Eigen::Index axis = 0;
  const double largest = phi.cwiseAbs().maxCoeff(&axis);
  const double degrees = 180.0 / kPi;
  if (largest < 0.8 * phi.norm()) return fmt::format("{:.1f} degrees", degrees * phi.norm());
  return fmt::format("{:.1f} degrees about {}", degrees * phi[axis], kAxes[static_cast<std::size_t>(axis)]);
}

std::string subject_of(const std::string& sensor) {
  const InnovationSensor* known = known_sensor(sensor);
  return known ? std::string(known->subject) : sensor_label(sensor) + " readings";
}

// Sums over the measurements of an episode.
struct Tally {
  std::int64_t measured = 0, outliers = 0, gated = 0;
  double nis = 0.0, dimension = 0.0;  // means
  double others_nis = 0.0;            // mean without the outliers; 0 without any
  std::size_t first_outlier = 0;      // e.first if there is none
  bool is_jump = false;               // that one is large, not below the mean, and after ten consistent measurements
};
Tally tally(const SensorRecord& s, const Episode& e) {
  Tally t;
  t.first_outlier = e.first;
  double known = 0.0, ordinary = 0.0;
  for (std::size_t k = e.first; k <= e.last && k < s.nis.size(); ++k) {
    ++t.measured;
    t.gated += s.gated[k];
    if (!std::isfinite(s.nis[k])) continue;
    const bool is_outlier = s.nis[k] > outlier_bound(s.dimension[k]);
    if (is_outlier && t.outliers == 0) t.first_outlier = k;
    t.outliers += is_outlier ? 1 : 0;
    known += 1.0;
    t.nis += s.nis[k];
    t.dimension += s.dimension[k];
    if (is_outlier) continue;
    ordinary += 1.0;
    t.others_nis += s.nis[k];
  }
  t.nis /= std::max(known, 1.0);
  t.dimension /= std::max(known, 1.0);
  t.others_nis /= std::max(ordinary, 1.0);
  const double q = s.nis[t.first_outlier];
  t.is_jump =
      t.outliers > 0 && t.first_outlier >= kEarlier && q >= t.nis && q > 3.0 * outlier_bound(s.dimension[t.first_outlier]);
  return t;
}

// k of nu = k v over the episode; 0: it does not explain half.
double speed_scale(const EstimatorRecord& r, const Ailing& a) {
  const Columns velocity = columns_of(r, kVelocity);
  const auto innovation = r.innovation_of.find(a.sensor);
  if (velocity.empty() || innovation == r.innovation_of.end()) return 0.0;
  const std::vector<std::size_t>& row = r.sensors.at(a.sensor).row;
  double vv = 0.0, nv = 0.0, nn = 0.0;
  for (std::size_t k = a.episode.first; k <= a.episode.last && k < row.size(); ++k) {
    const double v = at(r, velocity, row[k]).norm(), nu = innovation->second.innovation[k];
    vv += v * v;
    nv += nu * v;
    nn += nu * nu;
  }
  return nv * nv > 0.5 * nn * vv ? nv / vv : 0.0;
}

Finding start(const EstimatorRecord& r, const Ailing& a) {
  const Tally t = tally(r.sensors.at(a.sensor), a.episode);
  Finding f{a.sensor, "", Cause::kUnknown, seconds(a.episode.since), {}, t.nis, t.dimension, t.measured, t.outliers, t.gated,
            {},       ""};
  if (a.episode.until) f.until_s = seconds(*a.episode.until);
  return f;
}

Finding jump(const EstimatorRecord& r, const Ailing& a) {
  Finding f = start(r, a);
  const SensorRecord& s = r.sensors.at(a.sensor);
  f.cause = Cause::kJump;
  f.since_s = seconds(r.utime[s.row[tally(s, a.episode).first_outlier]]);
  const InnovationSensor* known = known_sensor(f.sensor);
  const bool left_out = f.gated >= f.outliers;
  const char* question = f.sensor == "gnss"            ? "multipath?"
                         : known && known->is_position ? "is its map right there?"
                                                       : "does it fail?";
  f.text = fmt::format("{} jump: {} of {} {} {}; {}", subject_of(f.sensor), left_out ? f.gated : f.outliers, f.measured,
                       left_out ? "were left out (gated)" : "are outliers", when(f), question);
  return f;
}

Finding diagnose_one(const EstimatorRecord& r, const Ailing& a, bool is_alone) {
  Finding f = start(r, a);
  const Tally t = tally(r.sensors.at(a.sensor), a.episode);
  const InnovationSensor* known = known_sensor(a.sensor);
  const bool rare = 2 * t.outliers <= t.measured && t.others_nis < 1.5 * t.dimension;
  if (t.outliers > 0 && (rare || (known && known->is_position && t.is_jump))) return jump(r, a);
  const std::string badly = fmt::format("NIS {} of {:.3g} {}", amount(f.nis), f.dimension, when(f));
  const double k = is_alone && a.sensor == "forward_speed_mps" ? speed_scale(r, a) : 0.0;
  if (k != 0.0) {
    f.cause = Cause::kScale;
    f.value = {k};
    f.text = fmt::format("forward speed reads {:.1f} % too {}: {}; is the wheel's radius right?", 100.0 * std::abs(k),
                         k > 0.0 ? "high" : "low", badly);
    return f;
  }
  f.text = fmt::format("{} disagree with the prediction: {}{}", subject_of(a.sensor), badly,
                       f.gated > 0 ? fmt::format(", {} of {} left out (gated)", f.gated, f.measured) : "");
  // Two position sensors that disagree show it a little later.
  const bool is_early = known && known->is_position && f.measured < 2 * static_cast<std::int64_t>(kEarlier) &&
                        std::any_of(kInnovationSensors.begin(), kInnovationSensors.end(), [&](const InnovationSensor& s) {
                          return s.is_position && s.has_map != known->has_map && r.sensors.contains(std::string(s.name));
                        });
  if (is_alone && !is_early)
    f.text += fmt::format("; {}", known ? known->question : "is their noise, or the model's, larger than believed?");
  return f;
}

// Two position sensors, at least one of which is inconsistent; nothing if it is not shown that they disagree.
std::optional<Finding> diagnose_two(const EstimatorRecord& r, const std::string& suspect, const std::string& other,
                                    const std::vector<Ailing>& ailing) {
  std::size_t begin = r.utime.size(), end = 0;
  const Ailing* first = nullptr;  // whose episode begins first
  for (const Ailing& a : ailing) {
    const SensorRecord& s = r.sensors.at(a.sensor);
    if (!first) first = &a;
    begin = std::min(begin, s.row[a.episode.first]);
    end = std::max(end, a.episode.until ? s.row[a.episode.last] + 1 : r.utime.size());
  }
  if (tally(r.sensors.at(first->sensor), first->episode).is_jump) return jump(r, *first);
  const PairFit fit = fit_pairs(position_pairs(r, suspect, other, begin, end));
  if (fit.cause == Cause::kUnknown || (fit.cause == Cause::kShift && first->episode.first >= kEarlier)) return std::nullopt;
  Finding f = start(r, *first);
  std::string badly;
  for (const Ailing& a : ailing) {
    const Finding one = start(r, a);
    badly += fmt::format("{}{} of {}", badly.empty() ? "NIS " : " and ", amount(one.nis), sensor_label(a.sensor));
    f.since_s = std::min(f.since_s, one.since_s);
    if (one.nis < f.nis) continue;
    f.nis = one.nis;
    f.dimension = one.dimension;
    f.measured = one.measured;
    f.outliers = one.outliers;
    f.gated = one.gated;
  }
  f.until_s.reset();
  f.cause = fit.cause;
  f.value.assign(fit.value.begin(), fit.value.end());
  f.sensor = suspect;
  f.other = other;
  const char* question = fit.cause == Cause::kRotation ? "is its mounting angle right?"
                         : fit.cause == Cause::kShift  ? "is the offset of its map right?"
                                                       : "is its lever arm right?";
  const std::string as_if = fit.cause == Cause::kRotation ? "turned by " + turn(fit.value)
                            : fit.cause == Cause::kShift  ? "shifted by " + metres(fit.value) + " east, north, up"
                                                          : "its lever arm were off by " + metres(fit.value);
  f.text = fmt::format("{} disagree with {}, as if {}: {}, where {:.3g} is expected, {}{}; {}", subject_of(suspect),
                       sensor_label(other), as_if, badly, f.dimension, when(f),
                       f.gated > 0 ? fmt::format(", {} of {} left out (gated)", f.gated, f.measured) : "", question);
  return f;
}

// Between the sensor that ails[i], with or without an overlapping episode of its rival after it, and any rival: one of a pair
// has a map, the other one has not. `together`: which of them the finding is about.
std::optional<Finding> disagreement(const EstimatorRecord& r, const std::vector<Ailing>& ails, std::size_t i,
                                    std::vector<std::size_t>& together) {
  const Ailing& a = ails[i];
  const InnovationSensor* known = known_sensor(a.sensor);
  if (!known || !known->is_position) return std::nullopt;
  for (const InnovationSensor& rival : kInnovationSensors) {
    if (!rival.is_position || rival.has_map == known->has_map) continue;
    together = {i};
    std::vector<Ailing> two{a};
    for (std::size_t k = i + 1; k < ails.size() && two.size() == 1; ++k) {
      const bool overlaps = !a.episode.until || ails[k].episode.since <= *a.episode.until;
      if (ails[k].sensor != rival.name || !overlaps) continue;
      two.push_back(ails[k]);
      together.push_back(k);
    }
    const InnovationSensor& suspect = rival.has_map ? rival : *known;
    const InnovationSensor& other = rival.has_map ? *known : rival;
    const std::optional<Finding> found = diagnose_two(r, std::string(suspect.name), std::string(other.name), two);
    for (std::size_t k = i + 1; found && !found->other.empty() && k < ails.size(); ++k)
      if ((ails[k].sensor == a.sensor || ails[k].sensor == rival.name) &&
          std::find(together.begin(), together.end(), k) == together.end())
        together.push_back(k);
    if (!found) continue;
    std::sort(together.begin(), together.end());
    return found;
  }
  return std::nullopt;
}

struct Trial {
  Cause cause;
  int parameters;
  Vector3 value;
  double residual;
};

}  // namespace

const char* cause_name(Cause cause) {
  constexpr std::array kNames{"unknown", "shift", "lever_arm", "rotation", "jump", "scale", "silent"};
  return kNames[static_cast<std::size_t>(cause)];
}

PairFit fit_pairs(std::span<const PositionPair> pairs) {
  if (pairs.size() < kLeastPairs) return {};
  const double n = static_cast<double>(pairs.size());
  Vector3 t = Vector3::Zero(), l = Vector3::Zero(), p_mean = Vector3::Zero();
  double total = 0.0;
  for (const PositionPair& pair : pairs) {
    t += pair.d / n;
    l += pair.R_WB.transpose() * pair.d / n;
    p_mean += pair.p / n;
    total += pair.d.squaredNorm();
  }
  // d - t = phi x q = -[q]x phi, so the normal equations are (sum [q]x' [q]x) phi = sum q x (d - t), q = p - p mean.
  Matrix3 normal = Matrix3::Zero();
  Vector3 right = Vector3::Zero();
  for (const PositionPair& pair : pairs) {
    const Vector3 q = pair.p - p_mean;
    normal += skew(q).transpose() * skew(q);
    right += q.cross(pair.d - t);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(normal);
  const auto rest = [&](const Vector3& phi) {
    double sum = 0.0;
    for (const PositionPair& pair : pairs) sum += (pair.d - t - phi.cross(pair.p - p_mean)).squaredNorm();
    return sum;
  };
  const Vector3 free = normal.completeOrthogonalDecomposition().solve(right);
  const double variance = rest(free) / (3.0 * n - 6.0);
  Vector3 phi = Vector3::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double lambda = eigen.eigenvalues()[i], component = eigen.eigenvectors().col(i).dot(free);
    const bool is_seen = lambda > 0.01 * eigen.eigenvalues()[2] && component * component * lambda > 16.0 * variance;
    if (is_seen) phi += component * eigen.eigenvectors().col(i);
  }
  std::array<Trial, 3> trials{{{Cause::kShift, 3, t, 0.0}, {Cause::kLeverArm, 3, l, 0.0}, {Cause::kRotation, 6, phi, 0.0}}};
  for (const PositionPair& pair : pairs) {
    trials[0].residual += (pair.d - t).squaredNorm();
    trials[1].residual += (pair.d - pair.R_WB * l).squaredNorm();
  }
  trials[2].residual = rest(phi);
  const auto cost = [&](const Trial& trial) {
    return 3.0 * n * std::log(std::max(trial.residual, 1e-12 * total)) + trial.parameters * std::log(3.0 * n);
  };
  const Trial& best =
      *std::min_element(trials.begin(), trials.end(), [&](const Trial& a, const Trial& b) { return cost(a) < cost(b); });
  const double explained = 1.0 - best.residual / total;
  const double by_chance = 10.0 * best.residual * best.parameters / (3.0 * n - best.parameters);
  if (!(explained >= 0.5) || total - best.residual <= by_chance) return {};
  return {best.cause, best.value, explained};
}

std::vector<PositionPair> position_pairs(const EstimatorRecord& r, const std::string& suspect, const std::string& other,
                                         std::size_t begin, std::size_t end) {
  const std::optional<Fixes> L = fixes_of(r, suspect), G = fixes_of(r, other);
  const Columns place = columns_of(r, kPlace), attitude = columns_of(r, kAttitude);
  std::vector<PositionPair> pairs;
  if (!L || !G || place.empty()) return pairs;
  const auto before = [](const Fixes& a, std::size_t i, const Fixes& b, std::size_t k) {
    return std::pair(a.record->row[i], a.record->place[i]) < std::pair(b.record->row[k], b.record->place[k]);
  };
  const auto first_at = [&](const Fixes& f) {
    return static_cast<std::size_t>(std::lower_bound(f.record->row.begin(), f.record->row.end(), begin) -
                                    f.record->row.begin());
  };
  std::size_t i = first_at(*L), k = first_at(*G);
  const Fixes* last = nullptr;
  std::size_t last_number = 0;
  while (pairs.size() < kMostPairs && (i < L->record->row.size() || k < G->record->row.size())) {
    const bool is_L = k >= G->record->row.size() || (i < L->record->row.size() && before(*L, i, *G, k));
    const Fixes& now = is_L ? *L : *G;
    const std::size_t number = is_L ? i++ : k++, row = now.record->row[number];
    if (row >= end) break;
    if (last && last != &now && r.utime[row] - r.utime[last->record->row[last_number]] <= kPairGap) {
      const Vector3 step = now.innovation(number) - last->rest(r, place, last_number);
      PositionPair pair{is_L ? step : Vector3(-step), at(r, place, row), Matrix3::Identity()};
      if (!attitude.empty()) pair.R_WB = from_rpy(at(r, attitude, row)).toRotationMatrix();
      if (pair.d.allFinite() && pair.p.allFinite() && pair.R_WB.allFinite()) pairs.push_back(pair);
    }
    last = &now;
    last_number = number;
  }
  return pairs;
}

std::vector<Vector3> fix_positions(const EstimatorRecord& r, const std::string& sensor) {
  const std::optional<Fixes> fixes = fixes_of(r, sensor);
  const Columns place = columns_of(r, kPlace);
  std::vector<Vector3> positions;
  if (!fixes || place.empty()) return positions;
  for (std::size_t k = 0; k < fixes->record->row.size(); ++k)
    positions.emplace_back(at(r, place, fixes->record->row[k]) + fixes->rest(r, place, k));
  return positions;
}

std::vector<Finding> diagnose(const EstimatorRecord& r, const std::vector<Ailing>& ailing) {
  std::vector<Ailing> rest = ailing;
  // By their first outlier: a chance excursion before it must not change their order.
  const auto begins = [&](const Ailing& a) {
    const SensorRecord& s = r.sensors.at(a.sensor);
    return s.row[tally(s, a.episode).first_outlier];
  };
  std::sort(rest.begin(), rest.end(), [&](const Ailing& a, const Ailing& b) { return begins(a) < begins(b); });
  std::vector<Finding> findings;
  for (std::size_t i = 0; i < rest.size();) {
    std::vector<std::size_t> together;
    const std::optional<Finding> found = disagreement(r, rest, i, together);
    if (!found) {
      ++i;
      continue;
    }
    findings.push_back(*found);
    for (auto k = together.rbegin(); k != together.rend(); ++k) rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(*k));
  }
  const bool is_alone = findings.empty();
  for (const Ailing& a : rest) findings.push_back(diagnose_one(r, a, is_alone));
  return findings;
}

Finding silence(const std::string& sensor, Utime since, std::optional<Utime> until) {
  Finding f;
  f.sensor = sensor;
  f.cause = Cause::kSilent;
  f.nis = f.dimension = NAN;
  f.since_s = seconds(since);
  if (until) f.until_s = seconds(*until);
  f.text = fmt::format("{} silent {}", sensor_label(sensor), when(f));
  return f;
}

}  // namespace slipstream
