// What else is wrong with a sensor besides its noise (noise.hpp): gain, bias, resolution, delay.
//
//   z(t + delay) = q round(y / q),   y = scale h(t) + bias + sigma(h) xi          q = 0: z = y
//
// A sample keeps the time at which it is published: who receives it is not told the delay. With the defaults z(t) = h + sigma
// xi.
#pragma once

#include <cmath>

namespace slipstream {

struct SensorErrors {
  double scale = 1.0;
  double bias = 0.0;     // in the quantity's unit
  double quantum = 0.0;  // in the quantity's unit
  double delay_s = 0.0;

  // `noise`: sigma(h) xi.
  double reading(double h, double noise) const {
    const double y = scale * h + bias + noise;
    return quantum > 0.0 ? quantum * std::round(y / quantum) : y;
  }
};

}  // namespace slipstream
