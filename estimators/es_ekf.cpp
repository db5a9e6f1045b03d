// Error-state extended Kalman filter of document 001, eqs 3.1-3.27, with the biases' six error states beside its nine if
// wanted.
//
//   predict   the mean as in estimators/strapdown_equations.hpp, R = C(q), f and w free of bias
//             dp += dt dv,   dv += A dphi - dt R db_f,   dphi = E dphi - dt C db_w            eq. 3.10, and columns for biases
//             global error:  A = -dt [R f]x,  E = I,            C = R
//             local error:   A = -dt R [f]x,  E = exp(-w dt),   C = I
//             Q = dt^2 diag(f, w) on v and phi (eq. 3.12),  dt diag(f_walk, w_walk) on the biases
//   update    kPoint          dh = dp - [R l]x dphi                               local: - R [l]x dphi
//             kBodyVelocity   dh = R_BS (R' dv + R' [v]x dphi + [l]x db_w)        local: [R' v]x dphi
//             S = H P H' + R,  K = P H' S^-1,  x = x [+] K nu,  P = (I - K H) P (I - K H)' + K R K'     eqs 3.22-3.27, Joseph
//             form
//
// F is of first order in dt, as the document's: dp's dt^2/2 A dphi, C's change during the step, and position noise of the
// order dt^4 are left out. So is the covariance's reset I +- [dphi]x/2 after a correction, of second order in it. L of eq. 3.11
// as printed lacks the attitude's identity. One triangle of P is computed and mirrored: it is symmetric to the last bit.
// What is not finite leaves the belief as it is, and so does a singular S. Q and R are discrete covariances.
#include "common/check.hpp"
#include "estimators/navigation.hpp"
#include "estimators/strapdown_equations.hpp"

namespace slipstream {
namespace {

void check([[maybe_unused]] const ErrorCovariance& p) {
#ifndef NDEBUG
  SLIPSTREAM_CHECK(!p.allFinite() || is_covariance(p));
#endif
}

// to += A b for the first kRows rows of A's three columns, `stride` numbers apart. What all of this file's time goes into: the
// compiler must know how many rows and that nothing overlaps.
template <int kRows>
[[gnu::always_inline]] inline void add_product(double* __restrict to, const double* __restrict a, int stride, double b0,
                                               double b1, double b2) {
  const double* __restrict a1 = a + stride, * __restrict a2 = a + 2 * stride;
  for (int r = 0; r < kRows; ++r) to[r] += a[r] * b0 + a1[r] * b1 + a2[r] * b2;
}

// P's columns to ... to + 2 += those from ... from + 2 times b, in its first N rows.
template <int N>
void add_columns(ErrorCovariance& p, int to, int from, const Matrix3& b) {
  for (int c = 0; c < 3; ++c) add_product<N>(&p(0, to + c), &p(0, from), kErrors, b(0, c), b(1, c), b(2, c));
}
// Its rows to ... to + 2 += b times those from ... from + 2, in the first `columns` columns.
template <int Columns>
void add_rows(ErrorCovariance& p, int to, int from, const Matrix3& b) {
  for (int c = 0; c < Columns; ++c) {
    const double s0 = p(from, c), s1 = p(from + 1, c), s2 = p(from + 2, c);
    for (int r = 0; r < 3; ++r) p(to + r, c) += b(r, 0) * s0 + b(r, 1) * s1 + b(r, 2) * s2;
  }
}
// f<0>(), f<3>(), ... : with sizes known to the compiler its loops have neither heads nor tails.
template <int N, int kBlock = 0, typename F>
void for_blocks(const F& f) {
  f.template operator()<kBlock>();
  if constexpr (kBlock + 3 < N) for_blocks<N, kBlock + 3>(f);
}
template <int N>
void mirror(ErrorCovariance& p) {
  for (int c = 1; c < N; ++c)
    for (int r = 0; r < c; ++r) p(r, c) = p(c, r);
}

// H: identity (or nothing) on the position, and blocks for velocity, attitude and gyro bias where they are not zero.
struct SparseRows {
  bool position = false, velocity = false, attitude = false, gyro_bias = false;
  Matrix3 of_velocity, of_attitude, of_gyro_bias;
  bool needs(int block) const {
    return (block == kPosition && position) || (block == kVelocity && velocity) || (block == kAttitude && attitude) ||
           (block == kGyroBias && gyro_bias);
  }
};
// Fifteen rows, and one more that makes pairs of them.
constexpr int kTallRows = kErrors + 1;
using Tall = Matrix<double, kTallRows, 3>;

template <int N>
void add_product(const ErrorCovariance& p, int from, const Matrix3& h, Tall& to) {
  for (int c = 0; c < 3; ++c) add_product<N>(&to(0, c), &p(0, from), kErrors, h(c, 0), h(c, 1), h(c, 2));
}
// P H'.
template <int N>
void times_transposed(const ErrorCovariance& p, const SparseRows& h, Tall& to) {
  if (h.position) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < N; ++r) to(r, c) = p(r, c);
  } else {
    to.setZero();
  }
  if (h.velocity) add_product<N>(p, kVelocity, h.of_velocity, to);
  if (h.attitude) add_product<N>(p, kAttitude, h.of_attitude, to);
  if (N == kErrors && h.gyro_bias) add_product<N>(p, kGyroBias, h.of_gyro_bias, to);
}
// H A.
template <int N>
Matrix3 times(const SparseRows& h, const Tall& a) {
  Matrix3 to = Matrix3::Zero();
  if (h.position) to = a.block<3, 3>(kPosition, 0);
  if (h.velocity) to += h.of_velocity * a.block<3, 3>(kVelocity, 0);
  if (h.attitude) to += h.of_attitude * a.block<3, 3>(kAttitude, 0);
  if (N == kErrors && h.gyro_bias) to += h.of_gyro_bias * a.block<3, 3>(kGyroBias, 0);
  return to;
}

// P -= A B' in the columns of a block, from row kFirst.
template <int N, int kBlock, int kFirst>
void subtract_products(ErrorCovariance& p, const Tall& a, const Tall& b) {
  for (int c = kBlock; c < kBlock + 3; ++c)
    add_product<N - kFirst>(&p(kFirst, c), &a(kFirst, 0), kTallRows, -b(c, 0), -b(c, 1), -b(c, 2));
}

// N: 15, or 9 where biases are left out, whose blocks are then never touched.
template <int N, OrientationError kError>
class EsEkf final : public NavigationFilter {
 public:
  explicit EsEkf(double gravity_mps2) : gravity_mps2_(gravity_mps2) {}

  OrientationError error() const override { return kError; }

  void predict(NavigationBelief& belief, const Inertial& reading, const InertialNoise& noise, double dt_s) const override {
    if (!is_usable(reading, noise, dt_s)) return;
    const Matrix3 r = belief.x.q_WS.toRotationMatrix();
    const Vector3 f = reading.f - belief.x.b_f;
    const Rotation turn = rotation_exp(dt_s * (reading.w - belief.x.b_w));
    belief.x = moved(belief.x, reading, gravity_mps2_, dt_s, r, turn);

    const Matrix3 a = kGlobal ? Matrix3(skew(-dt_s * (r * f))) : Matrix3(r * skew(-dt_s * f));
    [[maybe_unused]] const Matrix3 bf = -dt_s * r;
    [[maybe_unused]] const Matrix3 bw = kGlobal ? bf : Matrix3(-dt_s * Matrix3::Identity());
    ErrorCovariance& p = belief.P;
    // M = P F': the columns, each before the ones it needs change.
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < N; ++i) p(i, c) += dt_s * p(i, c + kVelocity);
    add_columns<N>(p, kVelocity, kAttitude, a.transpose());
    if constexpr (N == kErrors) add_columns<N>(p, kVelocity, kAccelerometerBias, bf.transpose());
    if constexpr (!kGlobal)
      p.template block<N, 3>(0, kAttitude) = (p.template block<N, 3>(0, kAttitude) * turn.toRotationMatrix()).eval();
    if constexpr (N == kErrors) add_columns<N>(p, kAttitude, kGyroBias, bw.transpose());
    // P = F M, its lower triangle: the rows likewise.
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 3; ++i) p(i, c) += dt_s * p(i + kVelocity, c);
    add_rows<kVelocity + 3>(p, kVelocity, kAttitude, a);
    if constexpr (N == kErrors) add_rows<kVelocity + 3>(p, kVelocity, kAccelerometerBias, bf);
    if constexpr (!kGlobal)
      p.template block<3, kAttitude + 3>(kAttitude, 0) =
          (turn.toRotationMatrix().transpose() * p.template block<3, kAttitude + 3>(kAttitude, 0)).eval();
    if constexpr (N == kErrors) add_rows<kAttitude + 3>(p, kAttitude, kGyroBias, bw);
    mirror<N>(p);
    for (int i = 0; i < 3; ++i) {
      p(kVelocity + i, kVelocity + i) += dt_s * dt_s * noise.f;
      p(kAttitude + i, kAttitude + i) += dt_s * dt_s * noise.w;
      if constexpr (N == kErrors) {
        p(kAccelerometerBias + i, kAccelerometerBias + i) += dt_s * noise.f_walk;
        p(kGyroBias + i, kGyroBias + i) += dt_s * noise.w_walk;
      }
    }
    check(p);
  }

  NavigationInnovation update(NavigationBelief& belief, const NavigationMeasurement& m, double gate) const override {
    NavigationInnovation i;
    const SparseRows h = jacobian(belief.x, m);
    ErrorCovariance& p = belief.P;
    Tall ph;
    times_transposed<N>(p, h, ph);
    Matrix3 s_inverse;
    i.gated = !weigh(m, predicted(belief.x, m), times<N>(h, ph), i, s_inverse) || i.nis > gate;
    if (i.gated) return i;

    Tall gain = Tall::Zero();
    for (int c = 0; c < 3; ++c)
      add_product<N>(&gain(0, c), &ph(0, 0), kTallRows, s_inverse(0, c), s_inverse(1, c), s_inverse(2, c));
    ErrorVector d = ErrorVector::Zero();
    add_product<N>(d.data(), &gain(0, 0), kTallRows, i.nu[0], i.nu[1], i.nu[2]);
    belief.x = plus(belief.x, d, kError);

    // M = (I - K H) P, in full where M H' asks for it; then P = M (I - K H)' + K R K' = M - (M H' - K R) K'.
    for_blocks<N>([&]<int kBlock>() {
      if (h.needs(kBlock))
        subtract_products<N, kBlock, 0>(p, gain, ph);
      else
        subtract_products<N, kBlock, kBlock>(p, gain, ph);
    });
    Tall w;
    times_transposed<N>(p, h, w);
    Matrix3 noise = Matrix3::Zero();
    for (int r = 0; r < m.size; ++r)
      for (int c = 0; c < m.size; ++c) noise(r, c) = m.R(r, c);
    for (int c = 0; c < 3; ++c) add_product<N>(&w(0, c), &gain(0, 0), kTallRows, -noise(0, c), -noise(1, c), -noise(2, c));
    for_blocks<N>([&]<int kBlock>() { subtract_products<N, kBlock, kBlock>(p, w, gain); });
    mirror<N>(p);
    check(p);
    return i;
  }

 private:
  static constexpr bool kGlobal = kError == OrientationError::kGlobal;

  static SparseRows jacobian(const NavigationState& x, const NavigationMeasurement& m) {
    SparseRows h;
    if (m.kind == NavigationMeasurement::kPoint) {
      h.position = true;
      h.attitude = !m.l.isZero(0.0);
      if (h.attitude)
        h.of_attitude = kGlobal ? Matrix3(skew(-(x.q_WS * m.l))) : Matrix3(-(x.q_WS.toRotationMatrix() * skew(m.l)));
      return h;
    }
    const Matrix3 r_t = x.q_WS.toRotationMatrix().transpose();
    const auto rows = [&](const Matrix3& of) {
      Matrix3 selected = Matrix3::Zero();
      for (int i = 0; i < m.size; ++i) selected.row(i) = (m.R_BS * of).row(m.rows[static_cast<std::size_t>(i)]);
      return selected;
    };
    h.velocity = h.attitude = true;
    h.of_velocity = rows(r_t);
    h.of_attitude = rows(kGlobal ? Matrix3(r_t * skew(x.v_WS)) : skew(r_t * x.v_WS));
    h.gyro_bias = !m.l.isZero(0.0);
    if (h.gyro_bias) h.of_gyro_bias = rows(skew(m.l));
    return h;
  }

  double gravity_mps2_;
};

}  // namespace

std::unique_ptr<NavigationFilter> make_es_ekf(const Strapdown& model, const StrapdownTuning& tuning) {
  const double g = model.gravity_mps2;
  constexpr int kWithout = Strapdown::kStatesWithoutBiases;
  if (tuning.orientation_error == "local") {
    if (tuning.biases) return std::make_unique<EsEkf<kErrors, OrientationError::kLocal>>(g);
    return std::make_unique<EsEkf<kWithout, OrientationError::kLocal>>(g);
  }
  if (tuning.biases) return std::make_unique<EsEkf<kErrors, OrientationError::kGlobal>>(g);
  return std::make_unique<EsEkf<kWithout, OrientationError::kGlobal>>(g);
}

}  // namespace slipstream
