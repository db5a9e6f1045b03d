#include "studies/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "common/check.hpp"
#include "common/random.hpp"

namespace slipstream {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kNormal975 = 1.959963984540054;  // Phi^-1(0.975)

double relative_difference(double m_a, double m_b) {
  const double larger = std::max(m_a, m_b);
  return larger > 0.0 ? (m_b - m_a) / larger : 0.0;
}

// Student's t at 0.975: the expansion in 1/nu of Abramowitz and Stegun 26.7.5; for nu >= 9 within 5e-4.
double student_975(double nu) {
  const double z = kNormal975, z2 = z * z;
  const double g1 = z * (z2 + 1.0) / 4.0;
  const double g2 = z * ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
  const double g3 = z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
  return z + (g1 + (g2 + g3 / nu) / nu) / nu;
}

// p of the head.
double tail(double n) { return 0.5 * std::erfc(std::sqrt(n / (n - 1.0)) * student_975(n - 1.0) / std::sqrt(2.0)); }

using Pairs = std::vector<std::pair<double, double>>;

std::pair<double, double> means(const Pairs& e) {
  double a = 0.0, b = 0.0;
  for (const auto& [e_a, e_b] : e) {
    a += e_a;
    b += e_b;
  }
  const double n = static_cast<double>(e.size());
  return {a / n, b / n};
}

std::pair<double, double> bootstrap_interval(const Pairs& e, RandomStream random) {
  const double n = static_cast<double>(e.size());
  std::vector<double> d(Comparison::kResamples);
  for (double& resampled : d) {
    double a = 0.0, b = 0.0;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const auto& [e_a, e_b] = e[static_cast<std::size_t>(random.uniform() * n)];
      a += e_a;
      b += e_b;
    }
    resampled = relative_difference(a, b);
  }
  std::sort(d.begin(), d.end());
  const auto rank = static_cast<std::size_t>(std::max(1.0, std::floor(tail(n) * static_cast<double>(d.size()))));
  return {d[rank - 1], d[d.size() - rank]};
}

// A per cent and what it may be off, both with the digits that this is worth: one, two if it begins with 1, none below 0.001.
std::string per_cent(double value, double off) {
  int digits = 0;
  if (off > 0.0) {
    const int power = static_cast<int>(std::floor(std::log10(off)));
    const bool begins_with_1 = off < 2.0 * std::pow(10.0, power);
    digits = std::clamp((begins_with_1 ? 1 : 0) - power, 0, 3);
  }
  return fmt::format("{:.{}f} % +-{:.{}f}", value, digits, off, digits);
}

}  // namespace

std::string Comparison::sentence() const {
  const bool second_leads = difference < 0.0;
  const std::string& better = second_leads ? second : first;
  const std::string& worse = second_leads ? first : second;
  const double by = 100.0 * std::abs(difference), off = 100.0 * (second_leads ? high - difference : difference - low);
  std::string text;
  if (used == 0)
    text = fmt::format("{} and {} cannot be compared: no run has a number of both", first, second);
  else if (verdict == Verdict::kTooFewRuns)
    text = fmt::format("{} and {} differ by {:.2g} % in {} run{}, too few for an interval (at least {})", first, second, by,
                       used, used == 1 ? "" : "s", kFewest);
  else if (verdict == Verdict::kTie)
    text = fmt::format("tie: {} and {} differ by {}, n = {}", first, second, per_cent(by, off), used);
  else
    text = fmt::format("{} better than {} by {}, n = {}", better, worse, per_cent(by, off), used);
  if (used == runs) return text;
  text += fmt::format("; {} of {} run{} left out: ", runs - used, runs, runs == 1 ? "" : "s");
  if (failed_first > 0 && failed_second > 0)
    return text + fmt::format("{} was without an estimate in {}, {} in {}", first, failed_first, second, failed_second);
  return text + fmt::format("{} was without an estimate", failed_first > 0 ? first : second);
}

Comparison compare(const std::string& first, std::span<const double> a, const std::string& second, std::span<const double> b,
                   std::span<const std::uint64_t> run) {
  SLIPSTREAM_CHECK(a.size() == run.size() && b.size() == run.size());
  Comparison c{first, second, run.size(), 0, 0, 0, kNan, kNan, kNan, kNan, kNan, Comparison::Verdict::kTooFewRuns};
  std::vector<std::size_t> order(run.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return run[i] < run[j]; });
  Pairs e;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    SLIPSTREAM_CHECK(k == 0 || run[order[k - 1]] != run[i]);
    const bool known_a = std::isfinite(a[i]), known_b = std::isfinite(b[i]);
    SLIPSTREAM_CHECK(!(known_a && a[i] < 0.0) && !(known_b && b[i] < 0.0));
    c.failed_first += known_a ? 0U : 1U;
    c.failed_second += known_b ? 0U : 1U;
    if (known_a && known_b) e.emplace_back(a[i], b[i]);
  }
  c.used = e.size();
  if (e.empty()) return c;
  std::tie(c.mean_first, c.mean_second) = means(e);
  c.difference = relative_difference(c.mean_first, c.mean_second);
  if (c.used < Comparison::kFewest) return c;
  std::tie(c.low, c.high) =
      bootstrap_interval(e, RandomStream(0, 0, "comparison." + std::min(first, second) + "." + std::max(first, second)));
  const bool is_tie = std::abs(c.difference) < Comparison::kNegligible || (c.low <= 0.0 && c.high >= 0.0);
  c.verdict = is_tie               ? Comparison::Verdict::kTie
              : c.difference > 0.0 ? Comparison::Verdict::kFirstIsBetter
                                   : Comparison::Verdict::kSecondIsBetter;
  return c;
}

}  // namespace slipstream
