// The Kalman steps that every Gaussian algorithm here shares, linearised by dual numbers.
//
//   predict   x- = f(x, u, dt),  F = df/dx,  P- = F P F' + Q(dt)              f: Runge-Kutta of fourth order
//   update    S = H P- H' + R,   K = P- H' S^-1,  nu = z - h(x-)
//             x  = x- + K nu,    P = (I - K H) P- (I - K H)' + K R K'          (Joseph form)
//
// R is diagonal; for noise in per cent of the value it is the expected variance under the prediction,
// R_ii = rel^2 (h_i^2 + (H P- H')_ii) + abs^2: with h alone a prediction near zero would claim a perfect sensor.
// Outputs not measured get a zero row in H, so that all sizes are fixed at compile time.
// The `_into` forms write where the result shall lie (never over an argument): a filter's step spares the copies.
// Q and R are discrete covariances here. Simon, Optimal State Estimation (2006), chapters 5 and 13.
#pragma once

#include <Eigen/Dense>

#include "common/check.hpp"
#include "estimators/belief.hpp"
#include "models/transition.hpp"

namespace slipstream {

template <int N>
bool is_positive_definite(const Matrix<double, N>& p) {
  return p.isApprox(p.transpose(), 1e-9) && p.llt().info() == Eigen::Success;
}

template <int N>
void symmetrise(Matrix<double, N>& p) {
  p = (0.5 * (p + p.transpose())).eval();
}

// A B' where it is known to be symmetric: one triangle is computed and mirrored, so that it is so to the last bit.
template <int N, int K>
Matrix<double, N> symmetric_product(const Matrix<double, N, K>& a, const Matrix<double, N, K>& b) {
  Matrix<double, N> p;
  for (int r = 0; r < N; ++r)
    for (int c = 0; c <= r; ++c) {
      double sum = a(r, 0) * b(c, 0);
      for (int k = 1; k < K; ++k) sum += a(r, k) * b(c, k);
      p(r, c) = p(c, r) = sum;
    }
  return p;
}

template <ProcessModel M>
struct Gaussian {
  Vector<double, M::kStates> mean;
  Matrix<double, M::kStates> covariance;
};

template <ProcessModel M>
[[gnu::flatten]] void predict_into(const Belief<M>& belief, const Gaussian<M>& from, const Vector<double, M::kInputs>& u,
                                   double dt_s, Gaussian<M>& to) {
  Matrix<double, M::kStates> f;
  transition_and_jacobian(belief.model, from.mean, u, dt_s, to.mean, f);
  const Matrix<double, M::kStates> half = f * from.covariance;
  to.covariance = symmetric_product<M::kStates, M::kStates>(half, f);
  to.covariance.diagonal() += belief.process_covariance(dt_s);
}
template <ProcessModel M>
Gaussian<M> predict(const Belief<M>& belief, const Gaussian<M>& from, const Vector<double, M::kInputs>& u, double dt_s) {
  Gaussian<M> to;
  predict_into(belief, from, u, dt_s, to);
  return to;
}

template <ProcessModel M>
struct Innovation {
  Vector<double, M::kOutputs> value;       // nu; zero where not measured
  Matrix<double, M::kOutputs> covariance;  // S; 1 on the diagonal where not measured
  Matrix<double, M::kOutputs, M::kStates> h;
  Matrix<double, M::kStates, M::kOutputs> ph;  // P- H'
  Vector<double, M::kOutputs> noise;           // diagonal of R; 1 where not measured
};

// The measured outputs as the bits of `measured`, z read only there; linearised at x.
template <ProcessModel M>
[[gnu::flatten]] void innovate_into(const Belief<M>& belief, const Gaussian<M>& at, const Vector<double, M::kInputs>& u,
                                    const double* z, std::uint32_t measured, Innovation<M>& i) {
  Vector<double, M::kOutputs> predicted;
  value_and_jacobian<M::kOutputs>([&](const auto& x) { return belief.model.output(x, u); }, at.mean, predicted, i.h);
  for (int k = 0; k < M::kOutputs; ++k) {
    if ((measured >> k & 1U) != 0U) {
      i.value[k] = z[k] - predicted[k];
    } else {
      i.value[k] = 0.0;
      i.h.row(k).setZero();
    }
  }
  i.ph.noalias() = at.covariance * i.h.transpose();
  i.covariance.noalias() = i.h * i.ph;
  for (int k = 0; k < M::kOutputs; ++k) {
    const bool on = (measured >> k & 1U) != 0U;
    i.noise[k] = on ? belief.noise[static_cast<std::size_t>(k)].variance(predicted[k], i.covariance(k, k)) : 1.0;
  }
  i.covariance.diagonal() += i.noise;
}
template <ProcessModel M>
Innovation<M> innovate(const Belief<M>& belief, const Gaussian<M>& at, const Vector<double, M::kInputs>& u, const double* z,
                       std::uint32_t measured) {
  Innovation<M> i;
  innovate_into(belief, at, u, z, measured, i);
  return i;
}

template <ProcessModel M>
[[gnu::flatten]] void update_into(const Gaussian<M>& prior, const Innovation<M>& i, Gaussian<M>& posterior) {
  constexpr int n = M::kStates;
  Matrix<double, M::kOutputs> s_inverse;
  if constexpr (M::kOutputs <= 4) {
    s_inverse = i.covariance.inverse();  // closed form; S is positive: R > 0 (belief.hpp) unless all is zero
  } else {
    s_inverse = i.covariance.llt().solve(Matrix<double, M::kOutputs>::Identity());
  }
  const Matrix<double, M::kStates, M::kOutputs> gain = i.ph * s_inverse;
  posterior.mean = prior.mean + gain * i.value;
  const Matrix<double, n> left = Matrix<double, n>::Identity() - gain * i.h;
  const Matrix<double, n> half = left * prior.covariance;
  const Matrix<double, M::kStates, M::kOutputs> weighted = gain * i.noise.asDiagonal();
  posterior.covariance = symmetric_product<n, n>(half, left) + symmetric_product<n, M::kOutputs>(weighted, gain);
#ifndef NDEBUG
  SLIPSTREAM_CHECK(!posterior.covariance.allFinite() || is_positive_definite(posterior.covariance));
#endif
}
template <ProcessModel M>
Gaussian<M> update(const Gaussian<M>& prior, const Innovation<M>& i) {
  Gaussian<M> posterior;
  update_into(prior, i, posterior);
  return posterior;
}

}  // namespace slipstream
