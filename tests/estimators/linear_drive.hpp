// Drives of the linear model, and beliefs of it, that particle filters are compared on.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "common/random.hpp"
#include "estimators/belief.hpp"
#include "models/transition.hpp"
#include "tests/estimators/linear_model.hpp"

namespace slipstream::test {

inline constexpr double kDt = 0.1;

template <typename M = LinearModel>
Belief<M> linear_belief() {
  Belief<M> b;
  b.noise = {{{0.0, 0.3}, {0.0, 0.2}}};
  b.process_variance = {1e-2, 2e-1};
  b.initial_mean = {0.5, -0.2};
  b.initial_variance = {0.04, 0.09};
  return b;
}

// A measurement says little beside the prediction: the weights differ little, and N_eff is near N.
template <typename M = LinearModel>
Belief<M> calm_belief() {
  Belief<M> b = linear_belief<M>();
  b.noise = {{{0.0, 1.0}, {0.0, 1.5}}};
  return b;
}

struct Drive {
  std::vector<std::array<double, 2>> z;
  std::vector<Eigen::Vector2d> truth;
};
// Truth and measurements as the belief says.
template <typename M>
Drive drive(int count, const Belief<M>& b, std::uint64_t seed) {
  RandomStream random(seed, 0, "drive");
  Drive d;
  Eigen::Vector2d x = b.initial_mean;
  for (int i = 0; i < 2; ++i) x[i] += std::sqrt(b.initial_variance[i]) * random.normal();
  for (int k = 0; k < count; ++k) {
    if (k > 0) {
      x = transition(b.model, x, Vector<double, 1>(std::sin(0.3 * (k - 1))), kDt);
      for (int i = 0; i < 2; ++i) x[i] += std::sqrt(b.process_variance[i] * kDt) * random.normal();
    }
    d.truth.push_back(x);
    d.z.push_back({x[0] + b.noise[0].absolute * random.normal(), x[1] + b.noise[1].absolute * random.normal()});
  }
  return d;
}
inline void step(Estimator& e, int k, const std::array<double, 2>& z, std::uint32_t measured = 3U) {
  const double u = std::sin(0.3 * (k - 1));
  e.step({k == 0 ? 0.0 : kDt, {&u, 1}, z, measured});
}
inline std::vector<double> numbers(const Posterior& p) {
  std::vector<double> all;
  for (const auto& s : {p.mean, p.covariance, p.innovation, p.innovation_covariance, p.interval_low, p.interval_high})
    all.insert(all.end(), s.begin(), s.end());
  return all;
}
// Of independent filters: what one quantity has on average, and how far the filters lie apart.
struct Spread {
  std::vector<double> values;
  double mean() const { return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()); }
  double rms() const {
    const double sum = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
    return std::sqrt(sum / static_cast<double>(values.size()));
  }
  // On average zero: within five deviations of the mean of so many, and a bias that falls with 1/N.
  void expect_zero(double bias, const char* what, int k) const {
    EXPECT_LT(std::abs(mean()), 5.0 * rms() / std::sqrt(static_cast<double>(values.size())) + bias) << what << " " << k;
  }
};

}  // namespace slipstream::test
