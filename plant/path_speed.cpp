#include "plant/path_speed.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "common/check.hpp"
#include "common/types.hpp"

namespace slipstream {
namespace {

// The fit of samples [begin, end) around sample k, with time in units of h, which keeps the equations well scaled.
double fitted_speed(const RecordedPath& path, std::size_t begin, std::size_t end, std::size_t k, double h) {
  Matrix<double, 3> normal = Matrix<double, 3>::Zero();
  Matrix<double, 3, 2> right = Matrix<double, 3, 2>::Zero();
  const auto basis = [&](std::size_t i) {
    const double tau = (path.time_s[i] - path.time_s[k]) / h;
    return Vector<double, 3>(1.0, tau, tau * tau);
  };
  const auto position = [&](std::size_t i) {  // relative to sample k, so that large coordinates cost no digits
    return Matrix<double, 1, 2>(path.x_m[i] - path.x_m[k], path.y_m[i] - path.y_m[k]);
  };
  for (std::size_t i = begin; i < end; ++i) {
    normal += basis(i) * basis(i).transpose();
    right += basis(i) * position(i);
  }
  const Matrix<double, 3, 2> c = normal.ldlt().solve(right);

  double squares = 0.0;
  for (std::size_t i = begin; i < end; ++i) squares += (position(i) - basis(i).transpose() * c).squaredNorm();
  const double residual_m = std::sqrt(squares / (2.0 * static_cast<double>(end - begin) - 6.0));
  if (!(residual_m <= path.max_residual_m)) return std::numeric_limits<double>::quiet_NaN();

  const Vector<double, 2> velocity_mps = c.row(1).transpose() / h;
  if (path.yaw_rad.empty()) return velocity_mps.norm();
  return velocity_mps.x() * std::cos(path.yaw_rad[k]) + velocity_mps.y() * std::sin(path.yaw_rad[k]);
}

}  // namespace

std::vector<double> path_speed_mps(const RecordedPath& path) {
  const std::vector<double>& t = path.time_s;
  SLIPSTREAM_CHECK(path.x_m.size() == t.size() && path.y_m.size() == t.size());
  SLIPSTREAM_CHECK(path.yaw_rad.empty() || path.yaw_rad.size() == t.size());
  const double h = 0.5 * path.window_s;
  // A sample on the edge of the window belongs to it whatever the last bit of the time stamps.
  const double reach = h * (1.0 + 1e-9);

  std::vector<double> speed_mps(t.size(), std::numeric_limits<double>::quiet_NaN());
  std::size_t begin = 0, end = 0;
  for (std::size_t k = 0; k < t.size(); ++k) {
    while (t[begin] < t[k] - reach) ++begin;
    while (end < t.size() && t[end] <= t[k] + reach) ++end;
    if (k - begin >= 2 && end - k >= 3) speed_mps[k] = fitted_speed(path, begin, end, k, h);
  }
  return speed_mps;
}

}  // namespace slipstream
