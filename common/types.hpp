// Eigen aliases used by every room: fixed-size column vectors and square matrices over a scalar T.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace slipstream {

template <typename T, int N>
using Vector = Eigen::Matrix<T, N, 1>;

template <typename T, int Rows, int Cols = Rows>
using Matrix = Eigen::Matrix<T, Rows, Cols>;

// Simulation time, microseconds since the start of the run. It drives everything; the wall clock only paces.
using Utime = std::int64_t;

constexpr double kSecondsPerUtime = 1e-6;
inline double seconds(Utime utime) { return static_cast<double>(utime) * kSecondsPerUtime; }
// The nearest.
inline Utime utime_of(double t_s) { return static_cast<Utime>(std::llround(t_s / kSecondsPerUtime)); }

constexpr double kGravity_mps2 = 9.81;  // document 002, Table 3 and Table 15
constexpr double kPi = 3.14159265358979323846;
constexpr double kRadpsPerRpm = kPi / 30.0;

}  // namespace slipstream
