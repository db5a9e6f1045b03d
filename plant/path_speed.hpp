// Speed along the path from a planar pose that is sampled unevenly, is noisy and may jump.
//
//   p(t) ~ c0 + c1 tau + c2 tau^2,  tau = t - t_k, |tau| <= window / 2        least squares, each of p = x, y
//   v_k  = c1x cos(yaw_k) + c1y sin(yaw_k),   or |c1| where the yaw is not known
//
// On an even window c1 is the least-squares slope; the parabola keeps an uneven one from mixing acceleration into it. With
// the yaw v is the body's forward speed, negative in reverse; lateral speed does not enter.
//
// NaN where the window has fewer than two samples on either side of t_k (ends, gaps) or where the fit's rms residual
// sqrt(sum(rx^2 + ry^2) / (2n - 6)) exceeds max_residual_m: the pose jumped. A jump of J shows as a residual of about J / 4.
//
// Accuracy, h = window / 2: noise sigma_p of n positions gives sigma_v = sigma_p sqrt(3 / n) / h; a changing acceleration j =
// a' gives j h^2 / 10; turning at the rate w loses the fraction w^2 h^2 / 10. For 0.4 s at 20 Hz, 10 mm, 10 m/s^3, 1 rad/s: 29
// mm/s, 40 mm/s and 0.4 %. Errors of neighbouring samples are correlated over one window.
#pragma once

#include <vector>

#include "models/recorded.hpp"

namespace slipstream {

// One speed in m/s for each sample of the path.
std::vector<double> path_speed_mps(const RecordedPath& path);

}  // namespace slipstream
