// The start of a strapdown filter from the first fixes and gravity, when nobody says where the vehicle is and which way it
// looks.
//
// Roll and pitch follow from the mean specific force before the first fix (a vehicle that accelerates by 1 m/s^2 then is 0.1
// rad off: that is the deviation believed). Heading cannot be measured at rest, so K filters begin, one for each heading 2 pi k
// / K, and every fix weighs them by how likely it was: w_k <- w_k N(nu_k; 0, S_k). When the vehicle has moved enough for the
// mixture's heading to be known to kSettled, it is replaced by one Gaussian of its mean and covariance.
//
//   mean: x = x_best [+] sum w_k (x_k [-] x_best),   P = sum w_k (P_k + d_k d_k'),   d_k = x_k [-] x
//
// A Gaussian sum: Sorenson and Alspach, Automatica 7 (1971).
#pragma once

#include <vector>

#include "estimators/navigation_events.hpp"
#include "estimators/navigation_frames.hpp"

namespace slipstream {

class NavigationStart {
 public:
  NavigationStart(const NavigationFrames& frames, const NavigationFilter& filter, const NavigationProcess& process);

  // Events in order of time. True when the heading is known: then `belief` is where the filter goes on from.
  bool add(const NavigationEvent& event);
  bool begun() const { return !hypotheses_.empty(); }
  bool is_sound() const;  // every one of its filters is finite
  const NavigationEntry& mixture() const { return mixture_; }
  void clear();

 private:
  struct Hypothesis {
    NavigationEntry entry;
    double log_weight = 0.0;
  };
  void begin(const NavigationEvent& fix);
  void mix();

  const NavigationFrames& frames_;
  const NavigationFilter& filter_;
  const NavigationProcess& process_;
  std::vector<Hypothesis> hypotheses_;
  NavigationEntry mixture_;
  Vector3 force_ = Vector3::Zero();  // sum of the readings before the first fix
  bool has_reading_ = false;
  Inertial held_;
  Utime held_since_ = 0;
  Utime begun_ = 0;  // the first fix
};

}  // namespace slipstream
