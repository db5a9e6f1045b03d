#include "estimators/error_covariance.hpp"

#include <cstring>

#include "common/check.hpp"
#include "estimators/strapdown_equations.hpp"

namespace slipstream {
namespace {

void check([[maybe_unused]] const ErrorCovariance& p) {
#ifndef NDEBUG
  SLIPSTREAM_CHECK(!p.allFinite() || is_covariance(p));
#endif
}

// W numbers at once, in one register: compilers do not find them by themselves in such short loops. What one writes the next
// reads in the same packs, or it would wait until the writing is over. W is 2, which every x86-64 and AArch64 has, or 4; bits
// are the same.
template <int W>
struct PackOf {
  using Type [[gnu::vector_size(8 * W)]] = double;
};
template <int W>
using Pack = typename PackOf<W>::Type;
template <typename P>
inline void load(P& to, const double* from) {
  std::memcpy(&to, from, sizeof to);
}
template <typename P>
inline void store(double* to, const P& from) {
  std::memcpy(to, &from, sizeof from);
}

// Fifteen rows, and one more that makes packs of them.
constexpr int kTallRows = kErrors + 1;
struct alignas(32) Tall {
  double at[3 * kTallRows];
  double* column(int c) { return at + c * kTallRows; }
  double operator()(int r, int c) const { return at[r + c * kTallRows]; }
  Matrix3 block(int from) const {
    Matrix3 b;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) b(r, c) = (*this)(from + r, c);
    return b;
  }
};

// to = A b or to += A b, rows kFirst ... kLast - 1 of A's three columns: what all of this file's time goes into.
template <int W, int kFirst, int kLast, bool kAdd = true>
inline void product(double* to, const double* a, double b0, double b1, double b2) {
  for (int r = kFirst; r < kLast; r += W) {
    Pack<W> sum, a0, a1, a2;
    load(a0, a + r);
    load(a1, a + r + kTallRows);
    load(a2, a + r + 2 * kTallRows);
    sum = a0 * b0 + a1 * b1 + a2 * b2;
    if constexpr (kAdd) {
      Pack<W> before;
      load(before, to + r);
      sum += before;
    }
    store(to + r, sum);
  }
}

template <int W, int kLast>
inline void copy(const double* from, double* to) {
  for (int r = 0; r < kLast; r += W) {
    Pack<W> pack;
    load(pack, from + r);
    store(to + r, pack);
  }
}

// W columns of W become rows; with `keep_lower`, only above the diagonal.
template <int W>
inline void transpose(const double* from, double* to, bool keep_lower) {
  if constexpr (W == 2) {
    Pack<2> a, b;
    load(a, from);
    load(b, from + kTallRows);
    store(to, keep_lower ? a : Pack<2>{a[0], b[0]});
    store(to + kTallRows, Pack<2>{a[1], b[1]});
  } else {
    Pack<4> a, b, c, d;
    load(a, from);
    load(b, from + kTallRows);
    load(c, from + 2 * kTallRows);
    load(d, from + 3 * kTallRows);
    store(to, keep_lower ? a : Pack<4>{a[0], b[0], c[0], d[0]});
    store(to + kTallRows, keep_lower ? Pack<4>{a[1], b[1], b[2], b[3]} : Pack<4>{a[1], b[1], c[1], d[1]});
    store(to + 2 * kTallRows, keep_lower ? Pack<4>{a[2], b[2], c[2], c[3]} : Pack<4>{a[2], b[2], c[2], d[2]});
    store(to + 3 * kTallRows, Pack<4>{a[3], b[3], c[3], d[3]});
  }
}

// P while it is worked on: the columns of N error states, rows and columns padded to packs.
template <int N, int W>
struct Padded {
  static constexpr int kRows = (N + W - 1) / W * W, kWhole = N / W * W;
  alignas(32) double at[kRows * kTallRows];

  Padded() = default;
  explicit Padded(const ErrorCovariance& p) {
    Pack<W> pack;
    for (int c = 0; c < N; ++c) {
      for (int r = 0; r < kWhole; r += W) {
        load(pack, &p(r, c));
        store(column(c) + r, pack);
      }
      Pack<W> rest{};
      for (int r = kWhole; r < N; ++r) rest[r - kWhole] = p(r, c);
      store(column(c) + kWhole, rest);
    }
    for (int c = N; c < kRows; ++c)
      for (int r = 0; r < kRows; r += W) store(column(c) + r, Pack<W>{});
  }
  double* column(int c) { return at + c * kTallRows; }
  const double* column(int c) const { return at + c * kTallRows; }

  // The lower triangle, mirrored.
  void store_lower(ErrorCovariance& p) {
    for (int c = 0; c < kRows; c += W)
      for (int r = c; r < kRows; r += W) transpose<W>(column(c) + r, column(r) + c, r == c);
    Pack<W> pack;
    for (int c = 0; c < N; ++c) {
      for (int r = 0; r < kWhole; r += W) {
        load(pack, column(c) + r);
        store(&p(r, c), pack);
      }
      for (int r = kWhole; r < N; ++r) p(r, c) = column(c)[r];
    }
  }

  // Columns to ... to + 2 += columns from ... from + 2 times b'.
  template <int kLast>
  void add_columns(int to, int from, const Matrix3& b) {
    for (int c = 0; c < 3; ++c) product<W, 0, kLast>(column(to + c), column(from), b(c, 0), b(c, 1), b(c, 2));
  }
  // M F' in the first kLast rows: each column before those it needs change.
  template <int kLast>
  void times_transposed(const ErrorTransition& f) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < kLast; r += W) {
        Pack<W> p, v;
        load(p, column(kPosition + c) + r);
        load(v, column(kVelocity + c) + r);
        store(column(kPosition + c) + r, p + f.dt_s * v);
      }
    add_columns<kLast>(kVelocity, kAttitude, f.A);
    if constexpr (N == kErrors) add_columns<kLast>(kVelocity, kAccelerometerBias, f.B_f);
    if (f.has_E) {
      Tall turned;
      for (int c = 0; c < 3; ++c)
        product<W, 0, kLast, false>(turned.column(c), column(kAttitude), f.E(c, 0), f.E(c, 1), f.E(c, 2));
      for (int c = 0; c < 3; ++c) copy<W, kLast>(turned.column(c), column(kAttitude + c));
    }
    if constexpr (N == kErrors) add_columns<kLast>(kAttitude, kGyroBias, f.B_w);
  }
  // -= A B', in the columns of a block from the pack in which its diagonal begins; or all of their rows.
  template <int kBlock>
  void subtract(const Tall& a, const Tall& b, bool all_rows) {
    constexpr int kFirst = kBlock / W * W;
    for (int c = kBlock; c < kBlock + 3; ++c) {
      if (kFirst == 0 || all_rows)
        product<W, 0, kRows>(column(c), a.at, -b(c, 0), -b(c, 1), -b(c, 2));
      else
        product<W, kFirst, kRows>(column(c), a.at, -b(c, 0), -b(c, 1), -b(c, 2));
    }
  }
  // P H'.
  void project(const SparseRows& h, Tall& to) const {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < kRows; r += W) {
        Pack<W> pack{};
        if (h.position) load(pack, column(c) + r);
        store(to.column(c) + r, pack);
      }
    if (h.velocity) add_block(kVelocity, h.of_velocity, to);
    if (h.attitude) add_block(kAttitude, h.of_attitude, to);
    if constexpr (N == kErrors)
      if (h.gyro_bias) add_block(kGyroBias, h.of_gyro_bias, to);
  }
  void add_block(int from, const Matrix3& h, Tall& to) const {
    for (int c = 0; c < 3; ++c) product<W, 0, kRows>(to.column(c), column(from), h(c, 0), h(c, 1), h(c, 2));
  }
};

// M = P F' and then F M, by columns only: M's transpose times F' once more, where F changes M. That is its first nine rows.
template <int N, int W>
inline void propagate_states(ErrorCovariance& p, const ErrorTransition& f, const InertialNoise& noise) {
  constexpr int kChanged = kAttitude + 3, kLast = (kChanged + W - 1) / W * W;
  Padded<N, W> m(p), turned;
  m.template times_transposed<Padded<N, W>::kRows>(f);
  for (int c = 0; c < kLast; c += W)
    for (int r = 0; r < Padded<N, W>::kRows; r += W) transpose<W>(m.column(c) + r, turned.column(r) + c, false);
  turned.template times_transposed<kLast>(f);
  for (int c = 0; c < kChanged; ++c) copy<W, kLast>(turned.column(c), m.column(c));
  m.store_lower(p);
  for (int i = 0; i < 3; ++i) {
    p(kVelocity + i, kVelocity + i) += f.dt_s * f.dt_s * noise.f;
    p(kAttitude + i, kAttitude + i) += f.dt_s * f.dt_s * noise.w;
    if constexpr (N == kErrors) {
      p(kAccelerometerBias + i, kAccelerometerBias + i) += f.dt_s * noise.f_walk;
      p(kGyroBias + i, kGyroBias + i) += f.dt_s * noise.w_walk;
    }
  }
}

template <int N, int W>
inline bool correct_states(ErrorCovariance& p, const SparseRows& h, const NavigationMeasurement& z, const Vector3& predicted,
                           double gate, NavigationInnovation& i, ErrorVector& correction) {
  constexpr int kRows = Padded<N, W>::kRows;
  Padded<N, W> m(p);
  Tall ph, gain, w;
  m.project(h, ph);
  Matrix3 hph = h.position ? ph.block(kPosition) : Matrix3(Matrix3::Zero()), s_inverse, r = Matrix3::Zero();
  if (h.velocity) hph += h.of_velocity * ph.block(kVelocity);
  if (h.attitude) hph += h.of_attitude * ph.block(kAttitude);
  if constexpr (N == kErrors)
    if (h.gyro_bias) hph += h.of_gyro_bias * ph.block(kGyroBias);
  if (!weigh(z, predicted, hph, i, s_inverse) || i.nis > gate) return false;

  for (int c = 0; c < 3; ++c)
    product<W, 0, kRows, false>(gain.column(c), ph.at, s_inverse(0, c), s_inverse(1, c), s_inverse(2, c));
  alignas(32) double d[kTallRows]{};
  product<W, 0, kRows, false>(d, gain.at, i.nu[0], i.nu[1], i.nu[2]);
  for (int e = 0; e < kErrors; ++e) correction[e] = e < N ? d[e] : 0.0;
  for (int row = 0; row < z.size; ++row)
    for (int c = 0; c < z.size; ++c) r(row, c) = z.R(row, c);

  // M = (I - K H) P, and P = M (I - K H)' + K R K' = M - (M H' - K R) K': its lower triangle. Of M also what M H' asks for.
  m.template subtract<kPosition>(gain, ph, true);
  m.template subtract<kVelocity>(gain, ph, true);
  m.template subtract<kAttitude>(gain, ph, h.attitude);
  if constexpr (N == kErrors) {
    m.template subtract<kAccelerometerBias>(gain, ph, false);
    m.template subtract<kGyroBias>(gain, ph, h.gyro_bias);
  }
  m.project(h, w);
  for (int c = 0; c < 3; ++c) product<W, 0, kRows>(w.column(c), gain.at, -r(0, c), -r(1, c), -r(2, c));
  m.template subtract<kPosition>(w, gain, false);
  m.template subtract<kVelocity>(w, gain, false);
  m.template subtract<kAttitude>(w, gain, false);
  if constexpr (N == kErrors) {
    m.template subtract<kAccelerometerBias>(w, gain, false);
    m.template subtract<kGyroBias>(w, gain, false);
  }
  m.store_lower(p);
  return true;
}

template <int W>
inline void propagate_any(ErrorCovariance& p, const ErrorTransition& f, const InertialNoise& noise) {
  if (f.biases)
    propagate_states<kErrors, W>(p, f, noise);
  else
    propagate_states<Strapdown::kStatesWithoutBiases, W>(p, f, noise);
}
template <int W>
inline bool correct_any(ErrorCovariance& p, const SparseRows& h, const NavigationMeasurement& z, const Vector3& predicted,
                        double gate, NavigationInnovation& i, ErrorVector& correction) {
  return h.biases ? correct_states<kErrors, W>(p, h, z, predicted, gate, i, correction)
                  : correct_states<Strapdown::kStatesWithoutBiases, W>(p, h, z, predicted, gate, i, correction);
}

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
const bool kHasFours = __builtin_cpu_supports("avx2") != 0;
[[gnu::target("avx2"), gnu::flatten]] void propagate_by_fours(ErrorCovariance& p, const ErrorTransition& f,
                                                              const InertialNoise& noise) {
  propagate_any<4>(p, f, noise);
}
[[gnu::target("avx2"), gnu::flatten]] bool correct_by_fours(ErrorCovariance& p, const SparseRows& h,
                                                            const NavigationMeasurement& z, const Vector3& predicted,
                                                            double gate, NavigationInnovation& i, ErrorVector& correction) {
  return correct_any<4>(p, h, z, predicted, gate, i, correction);
}
#else
constexpr bool kHasFours = false;
constexpr auto propagate_by_fours = propagate_any<2>;
constexpr auto correct_by_fours = correct_any<2>;
#endif
[[gnu::flatten]] void propagate_by_twos(ErrorCovariance& p, const ErrorTransition& f, const InertialNoise& noise) {
  propagate_any<2>(p, f, noise);
}
[[gnu::flatten]] bool correct_by_twos(ErrorCovariance& p, const SparseRows& h, const NavigationMeasurement& z,
                                      const Vector3& predicted, double gate, NavigationInnovation& i, ErrorVector& correction) {
  return correct_any<2>(p, h, z, predicted, gate, i, correction);
}

}  // namespace

void propagate(ErrorCovariance& p, const ErrorTransition& f, const InertialNoise& noise) {
  kHasFours ? propagate_by_fours(p, f, noise) : propagate_by_twos(p, f, noise);
  check(p);
}

bool correct(ErrorCovariance& p, const SparseRows& h, const NavigationMeasurement& z, const Vector3& predicted, double gate,
             NavigationInnovation& i, ErrorVector& correction) {
  const bool used = kHasFours ? correct_by_fours(p, h, z, predicted, gate, i, correction)
                              : correct_by_twos(p, h, z, predicted, gate, i, correction);
  if (used) check(p);
  return used;
}

}  // namespace slipstream
