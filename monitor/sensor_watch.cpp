#include "monitor/sensor_watch.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "monitor/statistics.hpp"

namespace slipstream {
namespace {

constexpr double kOutlier = 1.0 - 1e-6, kAlarm = 1.0 - 1e-8, kClear = 0.99;
constexpr std::size_t kWindow = 20, kIntervals = 20, kLeastIntervals = 5;
constexpr Utime kSecond = 1'000'000;
constexpr Utime kSameEpisode = 10 * kSecond;

// F^-1(p; k), kept: windows have few different sizes.
double quantile(double p, int k) {
  thread_local std::map<std::pair<double, int>, double> known;
  const auto [at, is_new] = known.try_emplace({p, k}, 0.0);
  if (is_new) at->second = chi_square_quantile(p, k);
  return at->second;
}

}  // namespace

double outlier_bound(int dimension) { return quantile(kOutlier, dimension); }

void SensorWatch::add(Utime utime, double nis, int dimension) {
  if (count_ > 0 && utime > newest_) {
    // A silence counts as what was waited for: sensors that slow down are not called silent again and again.
    intervals_.push_back(patience_ > 0 ? std::min(utime - newest_, patience_) : utime - newest_);
    if (intervals_.size() > kIntervals) intervals_.pop_front();
    std::vector<Utime> sorted(intervals_.begin(), intervals_.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.size() >= kLeastIntervals) patience_ = std::max({5 * sorted[sorted.size() / 2], 2 * sorted.back(), kSecond});
  }
  newest_ = utime;
  const std::size_t number = count_++;
  if (!std::isfinite(nis) || dimension <= 0) return;

  const double x = std::min(nis, outlier_bound(dimension));
  window_.push_back({number, utime, x - dimension, dimension, nis > outlier_bound(dimension)});
  excess_ += x - dimension;
  degrees_ += dimension;
  for (; window_.size() > kWindow && window_.front().utime + kSecond < utime; window_.pop_front()) {
    excess_ -= window_.front().excess;
    degrees_ -= window_.front().dimension;
  }
  if (page_ <= 0.0) page_start_ = window_.back();
  page_ = std::max(0.0, page_ + x - 2.0 * dimension);

  const int degrees = std::max(degrees_, static_cast<int>(kWindow) * dimension);
  if (window_.back().is_outlier) last_outlier_ = window_.back();
  if (is_alarmed()) {
    episode_.last = number;
    if (excess_ >= quantile(kClear, degrees) - degrees) return;
    const Item& end = last_outlier_ ? *last_outlier_ : window_.back();
    episode_.last = end.number;
    episode_.until = end.utime;
    return;
  }
  if (excess_ <= std::max(quantile(kAlarm, degrees) - degrees, static_cast<double>(degrees))) return;
  const bool is_same = episodes_ > 0 && utime < *episode_.until + kSameEpisode;
  episode_.last = number;
  episode_.until.reset();
  if (is_same) return;
  const auto outlier = std::find_if(window_.begin(), window_.end(), [](const Item& item) { return item.is_outlier; });
  const Item& onset =
      outlier == window_.end() || (page_ > 0.0 && page_start_.number < outlier->number) ? page_start_ : *outlier;
  if (outlier == window_.end()) last_outlier_.reset();
  episode_.first = onset.number;
  episode_.since = onset.utime;
  ++episodes_;
}

bool SensorWatch::is_silent(Utime now) const { return patience_ > 0 && now - newest_ > patience_; }

}  // namespace slipstream
