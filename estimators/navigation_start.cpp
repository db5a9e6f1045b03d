#include "estimators/navigation_start.hpp"

#include <algorithm>
#include <cmath>

#include "estimators/kalman.hpp"

namespace slipstream {
namespace {

constexpr int kHypotheses = 24;        // 15 degrees apart
constexpr double kHeading_rad = 0.15;  // deviation of each: half the distance and a little
constexpr double kTilt_rad = 0.1;
constexpr double kSpeed_mps = 20.0;    // deviation of the velocity on each axis; up a tenth of it
constexpr double kSettled_rad = 0.06;  // deviation of the mixture's attitude on each axis
constexpr double kShortest_s = 1.0;    // one lucky fix settles nothing

// A body velocity weighs heading by the velocity's direction: while that is mostly noise, each new linearisation would claim to
// know a little more of the heading than it does. It counts once the speed is five times its standard deviation.
bool is_moving(const NavigationBelief& belief) {
  return belief.x.v_WS.squaredNorm() > 25.0 * belief.P.block<3, 3>(kVelocity, kVelocity).diagonal().maxCoeff();
}

}  // namespace

NavigationStart::NavigationStart(const NavigationFrames& frames, const NavigationFilter& filter,
                                 const NavigationProcess& process)
    : frames_(frames), filter_(filter), process_(process) {
  hypotheses_.reserve(kHypotheses);
}

bool NavigationStart::is_sound() const {
  return std::all_of(hypotheses_.begin(), hypotheses_.end(),
                     [](const Hypothesis& h) { return slipstream::is_sound(h.entry.belief); });
}

void NavigationStart::clear() {
  hypotheses_.clear();
  force_.setZero();
  has_reading_ = false;
}

void NavigationStart::begin(const NavigationEvent& fix) {
  begun_ = fix.utime;
  const Vector3 f_B = frames_.R_BS() * force_;
  const double roll = std::atan2(f_B[1], f_B[2]), pitch = std::atan2(-f_B[0], std::hypot(f_B[1], f_B[2]));
  const NavigationMeasurement& m = fix.measurement;
  for (int k = 0; k < kHypotheses; ++k) {
    Hypothesis h;
    const Vector3 rpy(roll, pitch, 2.0 * kPi * k / kHypotheses);
    NavigationBelief& belief = h.entry.belief;
    belief =
        frames_.start(Vector3::Zero(), Vector3::Zero(), rpy, Vector3::Zero(), Vector3(kSpeed_mps, kSpeed_mps, 0.1 * kSpeed_mps),
                      Vector3(kTilt_rad, kTilt_rad, kHeading_rad), held_.w);
    // What is known is the antenna's place: p = z - R l, so dp = noise + A dphi, and the position's error goes with the
    // attitude's.
    const Matrix3 R_WS = belief.x.q_WS.toRotationMatrix();
    belief.x.p_WS = m.z - R_WS * m.l;
    const Matrix3 A = filter_.error() == OrientationError::kGlobal ? skew(R_WS * m.l) : Matrix3(R_WS * skew(m.l));
    ErrorCovariance J = ErrorCovariance::Identity();
    J.block<3, 3>(kPosition, kPosition).setZero();
    J.block<3, 3>(kPosition, kAttitude) = A;
    belief.P = (J * belief.P * J.transpose()).eval();
    belief.P.block<3, 3>(kPosition, kPosition) += m.R;
    symmetrise(belief.P);
    h.entry.event = fix;
    h.entry.event.measures = false;  // the start has used it up
    h.entry.held = held_;
    h.entry.held_since = held_since_;
    hypotheses_.push_back(h);
  }
}

void NavigationStart::mix() {
  const auto best = std::max_element(hypotheses_.begin(), hypotheses_.end(),
                                     [](const Hypothesis& a, const Hypothesis& b) { return a.log_weight < b.log_weight; });
  const double most = best->log_weight;
  double total = 0.0;
  for (Hypothesis& h : hypotheses_) total += std::exp(h.log_weight -= most);
  mixture_ = best->entry;
  NavigationState& x = mixture_.belief.x;
  const NavigationState reference = x;
  ErrorVector mean = ErrorVector::Zero();
  for (const Hypothesis& h : hypotheses_)
    mean += std::exp(h.log_weight) / total * minus(h.entry.belief.x, reference, filter_.error());
  x = plus(reference, mean, filter_.error());
  mixture_.belief.P.setZero();
  for (const Hypothesis& h : hypotheses_) {
    const ErrorVector d = minus(h.entry.belief.x, x, filter_.error());
    mixture_.belief.P += std::exp(h.log_weight) / total * (h.entry.belief.P + d * d.transpose());
  }
}

bool NavigationStart::add(const NavigationEvent& event) {
  const bool is_fix = event.measures && event.measurement.kind == NavigationMeasurement::kPoint;
  if (!begun()) {
    if (event.kind == NavigationEventKind::kImu) {
      force_ += event.reading.f;
      has_reading_ = true;
      held_ = event.reading;
      held_since_ = event.utime;
    }
    if (!is_fix || !has_reading_) return false;
    begin(event);
  } else {
    NavigationEvent usable = event;
    if (event.measures && !is_fix)
      usable.measures =
          std::all_of(hypotheses_.begin(), hypotheses_.end(), [](const Hypothesis& h) { return is_moving(h.entry.belief); });
    NavigationEntry next;
    for (Hypothesis& h : hypotheses_) {
      process_.advance(h.entry, usable, next);
      h.entry = next;
      if (!usable.measures) continue;
      const NavigationInnovation& i = next.innovation;
      double log_det = 0.0;
      const Eigen::LLT<Matrix3> cholesky(i.S);
      for (int k = 0; k < 3; ++k) log_det += 2.0 * std::log(cholesky.matrixLLT()(k, k));
      h.log_weight -= 0.5 * (i.nis + log_det);
    }
  }
  if (!event.measures) {  // nothing new is known; the mixture follows its best member until the next fix
    return false;
  }
  mix();
  const Matrix3 attitude = mixture_.belief.P.block<3, 3>(kAttitude, kAttitude);
  return seconds(event.utime - begun_) >= kShortest_s && attitude.diagonal().maxCoeff() < kSettled_rad * kSettled_rad;
}

}  // namespace slipstream
