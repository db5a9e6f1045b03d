// When can a surface be known? How far a wheel-speed sensor could tell it from the others of Table 1 while the wheel works at
// slip l and friction mu.
//
//   E = min_j  K/2 ((l_j(mu) - l) / sigma)^2,   j: the other surfaces,   mu(l_j; j) = mu
//
// is the expected log-likelihood ratio of K samples with the relative noise sigma between the surface and the nearest of the
// others that would carry the same force: d'^2/2 of signal detection (Van Trees, Detection, Estimation and Modulation Theory I
// (1968), section 2.2.2). A surface that cannot carry mu would let the wheel spin: kSpinning. Excitation is called sufficient
// where E >= kSufficient, a likelihood ratio of 8000 : 1 within 0.1 s of 100 Hz samples: enough against prior odds of 1 : 3000,
// a change that happens every ten seconds. l_j on the rising branch of the curve. On dry asphalt at a tenth of the weight l is
// 0.5 %, l_wet 0.45 %, and E at 5 % noise 5e-4.
#pragma once

#include <algorithm>
#include <limits>

#include "models/parts/pacejka.hpp"

namespace slipstream {

inline constexpr double kSufficientEvidence = 9.0;
inline constexpr double kSpinningSlip = 3.0;

// The slip at which the tyre first reaches the friction, odd in it; +-kSpinningSlip where it does not.
inline double slip_for(const PacejkaTyre& tyre, double friction) {
  constexpr double kStep = 1e-3;  // a tenth of the shortest rise, which ends at 0.12 on the wet road
  const double wanted = std::abs(friction), sign = friction < 0.0 ? -1.0 : 1.0;
  double high = kStep;
  while (high < kSpinningSlip && tyre.friction(high) < wanted) high += kStep;
  if (high >= kSpinningSlip) return sign * kSpinningSlip;
  double low = high - kStep;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (tyre.friction(middle) < wanted ? low : high) = middle;
  }
  return sign * 0.5 * (low + high);
}

// E, of the surface kSurfaces[surface].
inline double surface_evidence(std::size_t surface, double slip, double friction, double relative_noise, int samples) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < kSurfaces.size(); ++j) {
    if (j == surface) continue;
    const double off = (slip_for(kSurfaces[j].tyre, friction) - slip) / relative_noise;
    least = std::min(least, 0.5 * samples * off * off);
  }
  return least;
}

}  // namespace slipstream
