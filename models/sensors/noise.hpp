// Measurement noise: a per cent of the value plus an absolute part, independent and normal.
//
//   z = h + sigma(h) xi,   sigma(h)^2 = relative^2 h^2 + absolute^2,   xi ~ N(0, 1)
//
// Who does not know h but believes h ~ N(mean, variance) must expect E[sigma^2] = relative^2 (mean^2 + variance) + absolute^2.
#pragma once

#include <string>

namespace slipstream {

struct NoiseLaw {
  double relative = 0.0;
  double absolute = 0.0;  // in the quantity's unit

  double variance(double mean, double variance_of_mean = 0.0) const {
    return relative * relative * (mean * mean + variance_of_mean) + absolute * absolute;
  }
};

}  // namespace slipstream
