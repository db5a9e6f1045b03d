// Speed of a wheel under a sampled torque, by the two ways of document 002, section 5.1 (Table 6):
//
//   J w' = T(t) - b w                                                (eq. 5.1; T = k_m i)
//
//   kRungeKutta   classical Runge-Kutta, one step from sample to sample                  ("RK")
//   kExact        the solution itself                                                    ("LSIM")
//     w+ = E w + ((phi - psi) T + psi T+) / J,   E = e^-x,  x = b h / J,
//     phi = h (1 - E) / x,   psi = h (1 - (1 - E) / x) / x     for T linear from T to T+ within h
//
// Hold says what T does between samples: kLinear as above, kConstant keeps T until the next sample.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "common/check.hpp"
#include "common/rk4.hpp"
#include "common/types.hpp"

namespace slipstream {

enum class Method { kRungeKutta, kExact };
enum class Hold { kLinear, kConstant };

struct WheelParameters {
  double inertia_kgm2 = 0.0;  // J > 0
  double friction_nms = 0.0;  // b >= 0
};

// The exact solution over one step of h seconds.
class ExactStep {
 public:
  ExactStep(const WheelParameters& p, double h_s) {
    const double x = p.friction_nms * h_s / p.inertia_kgm2;
    decay_ = std::exp(-x);
    // (1 - e^-x)/x and (1 - that)/x; below 1e-3 their series, whose next term is 1e-12 / 120 of the first.
    const bool small = std::abs(x) < 1e-3;
    const double one = small ? 1.0 - x / 2.0 + x * x / 6.0 - x * x * x / 24.0 : -std::expm1(-x) / x;
    const double two = small ? 0.5 - x / 6.0 + x * x / 24.0 - x * x * x / 120.0 : (1.0 - one) / x;
    from_ = h_s * (one - two) / p.inertia_kgm2;
    to_ = h_s * two / p.inertia_kgm2;
  }
  double operator()(double w, double torque_nm, double next_torque_nm) const {
    return decay_ * w + (from_ * torque_nm + to_ * next_torque_nm);
  }

 private:
  double decay_, from_, to_;
};

class RungeKuttaStep {
 public:
  RungeKuttaStep(const WheelParameters& p, double h_s)
      : h_s_(h_s), rate_(p.friction_nms / p.inertia_kgm2), gain_(1.0 / p.inertia_kgm2) {}
  double operator()(double w, double torque_nm, double next_torque_nm) const {
    const double slope = gain_ * (next_torque_nm - torque_nm) / h_s_;
    const auto f = [&](const Vector<double, 2>& x) { return Vector<double, 2>(x[1] - rate_ * x[0], slope); };  // w, T / J
    return rk4_step<double, 2>(f, {w, gain_ * torque_nm}, h_s_)[0];
  }

 private:
  double h_s_, rate_, gain_;
};

// w at every sample, rad/s, from w = `start_radps` at the first. torque_nm and utime are of one length, at least 1; utime
// grows. `speed_radps` gets that length.
template <typename Step>
void wheel_response(Hold hold, const WheelParameters& p, std::span<const Utime> utime, std::span<const double> torque_nm,
                    double start_radps, std::vector<double>& speed_radps) {
  SLIPSTREAM_CHECK(!utime.empty() && utime.size() == torque_nm.size());
  speed_radps.resize(utime.size());
  speed_radps[0] = start_radps;
  Utime period = 1;  // of `step`: most series have one only
  Step step(p, seconds(period));
  double w = start_radps;
  for (std::size_t k = 1; k < utime.size(); ++k) {
    if (utime[k] - utime[k - 1] != period) {
      period = utime[k] - utime[k - 1];
      step = Step(p, seconds(period));
    }
    w = step(w, torque_nm[k - 1], hold == Hold::kLinear ? torque_nm[k] : torque_nm[k - 1]);
    speed_radps[k] = w;
  }
}

inline void wheel_response(Method method, Hold hold, const WheelParameters& p, std::span<const Utime> utime,
                           std::span<const double> torque_nm, double start_radps, std::vector<double>& speed_radps) {
  if (method == Method::kRungeKutta)
    wheel_response<RungeKuttaStep>(hold, p, utime, torque_nm, start_radps, speed_radps);
  else
    wheel_response<ExactStep>(hold, p, utime, torque_nm, start_radps, speed_radps);
}

}  // namespace slipstream
