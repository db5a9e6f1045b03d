// Watches the innovations of one sensor: is it inconsistent, since when; has it fallen silent.
//
// Inconsistent. q_k is the NIS of measurement k, of dimension d_k; of a consistent one it is chi-square. Clipped, so that no
// single outlier raises the alarm:
//   x_k = min(q_k, F^-1(1 - 1e-6; d_k))
// Over a window of the newest 20 measurements, and all of the last second, N of them, D = max(sum d, 20 d):
//   alarm      E = sum (x - d) > max(F^-1(1 - 1e-8; D) - D, D)     so three gross outliers of 20 suffice, none does by chance
//   all clear  E < F^-1(0.99; D) - D
// For a consistent sensor, one test in 1e8 fails (clipping, and a window that is not yet full, only lower E): below 1e-3 for
// runs of 1e5 measurements. The second bound keeps fast sensors, whose long windows show the slightest misfit, from being
// reported unless their NIS is twice what it should be. Too small a NIS (a cautious estimator) never alarms.
//   onset: the earlier of the first outlier (q > F^-1(1 - 1e-6)) in the window and the start of the present excursion of
//          g_k = max(0, g_(k-1) + x_k - 2 d_k),  Page's cumulative sum, which drifts upwards once the mean of x exceeds 2 d
// The episode ends with its last outlier, if it has one. An alarm that returns within 10 s of that is the same episode.
//
// Silent. With at least six measurements seen: none for longer than 5 times the median of the newest 20 intervals, twice the
// longest of them, and one second, while the estimator's other estimates go on.
#pragma once

#include <deque>
#include <optional>

#include "common/types.hpp"

namespace slipstream {

// x_k's bound; of a q beyond it one speaks as an outlier.
double outlier_bound(int dimension);

// From first to last, of a sensor's measurements by their number.
struct Episode {
  std::size_t first = 0, last = 0;
  Utime since = 0;
  std::optional<Utime> until;  // over
};

class SensorWatch {
 public:
  // The next measurement. A NIS that is not finite counts as a measurement, but not for consistency.
  void add(Utime utime, double nis, int dimension);

  // The newest episode; null: there has been none. `episodes` counts them.
  const Episode* episode() const { return episodes_ > 0 ? &episode_ : nullptr; }
  int episodes() const { return episodes_; }
  bool is_alarmed() const { return episodes_ > 0 && !episode_.until; }

  std::size_t measured() const { return count_; }
  Utime newest() const { return newest_; }
  bool is_silent(Utime now) const;

 private:
  struct Item {
    std::size_t number;
    Utime utime;
    double excess;  // x - d
    int dimension;
    bool is_outlier;
  };

  std::deque<Item> window_;
  double excess_ = 0.0;  // E
  int degrees_ = 0;      // sum d
  std::deque<Utime> intervals_;
  std::size_t count_ = 0;
  Utime newest_ = 0;
  Utime patience_ = 0;  // how long it may be silent
  double page_ = 0.0;
  Item page_start_{};
  Episode episode_;
  std::optional<Item> last_outlier_;  // of the episode
  int episodes_ = 0;
};

}  // namespace slipstream
