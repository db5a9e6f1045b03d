#include "common/chi_square.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/check.hpp"

namespace slipstream {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr int kMaxTerms = 200000;  // about 6 sqrt(a) terms are needed: enough for a = 1e9

// e^-x x^a / Gamma(a)
double front_factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

// P(a, x) = e^-x x^a / Gamma(a) * sum_n x^n / (a (a+1) ... (a+n))
double lower_series(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMaxTerms && term > sum * kEpsilon; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return front_factor(a, x) * sum;
}

// Q(a, x) = e^-x x^a / Gamma(a) * 1/(x+1-a- 1(1-a)/(x+3-a- 2(2-a)/(x+5-a- ...
double upper_fraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double h = d;
  for (int n = 1; n < kMaxTerms; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = an * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    const double factor = d * c;
    h *= factor;
    if (std::abs(factor - 1.0) <= kEpsilon) break;
  }
  return front_factor(a, x) * h;
}

// x ~ k (1 - 2/(9k) + z sqrt(2/(9k)))^3; z, the normal quantile, by Abramowitz and Stegun 26.2.23 (error below 4.5e-4).
double wilson_hilferty(double p, double k) {
  const double tail = std::min(p, 1.0 - p);
  const double t = std::sqrt(-2.0 * std::log(tail));
  double z = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  if (p < 0.5) z = -z;
  const double s = 2.0 / (9.0 * k);
  return k * std::pow(1.0 - s + z * std::sqrt(s), 3);
}

}  // namespace

double chi_square_cdf(double x, double degrees_of_freedom) {
  SLIPSTREAM_CHECK(degrees_of_freedom > 0.0);
  if (!(x > 0.0)) return 0.0;
  const double a = 0.5 * degrees_of_freedom;
  const double half = 0.5 * x;
  return half < a + 1.0 ? lower_series(a, half) : 1.0 - upper_fraction(a, half);
}

double chi_square_quantile(double p, double degrees_of_freedom) {
  SLIPSTREAM_CHECK(p > 0.0 && p < 1.0 && degrees_of_freedom > 0.0);
  const double k = degrees_of_freedom;
  double low = 0.0;
  double high = std::max(2.0 * k, 10.0);
  while (chi_square_cdf(high, k) < p) high *= 2.0;
  double x = wilson_hilferty(p, k);
  for (int i = 0; i < 200; ++i) {
    if (!(x > low && x < high)) x = 0.5 * (low + high);
    const double residual = chi_square_cdf(x, k) - p;
    (residual > 0.0 ? high : low) = x;
    const double density = front_factor(0.5 * k, 0.5 * x) / x;
    const double next = density > 0.0 ? x - residual / density : 0.5 * (low + high);
    if (std::abs(next - x) <= 1e-14 * x || high - low <= 1e-14 * high) return next;
    x = next;
  }
  return x;
}

}  // namespace slipstream
