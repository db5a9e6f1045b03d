#include "plant/recorded_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/check.hpp"
#include "common/refusal.hpp"
#include "plant/path_speed.hpp"

namespace slipstream {
namespace {

constexpr double kLatest_s = 1e6;

}  // namespace

RecordedDrive::RecordedDrive(const RecordedStreams& streams, double duration_s) {
  int channel = 0;
  for (const auto* group : {&streams.inputs, &streams.sensors})
    for (const RecordedStream& s : *group) {
      quantities_.push_back(s.quantity);
      add(s.quantity, s.time_s, s.value, channel++);
    }
  for (const RecordedGroupStream& s : streams.groups) {
    quantities_.push_back(s.quantity);
    add(s.quantity, s.time_s, s.value, channel++, s.lag_s);
  }
  for (const RecordedStream& s : streams.truth) {
    truth_names_.push_back(s.quantity);
    truth_units_.push_back(s.unit);
    add(s.quantity, s.time_s, s.value, channel++);
  }
  if (streams.path) {
    truth_names_.push_back("speed_mps");
    truth_units_.push_back("m/s");
    add("speed_mps", streams.path->time_s, path_speed_mps(*streams.path), channel++);
  }

  std::sort(events_.begin(), events_.end(),
            [](const Event& a, const Event& b) { return a.utime != b.utime ? a.utime < b.utime : a.channel < b.channel; });
  if (duration_s > 0.0) std::erase_if(events_, [last = utime_of(duration_s)](const Event& e) { return e.utime > last; });
  if (events_.empty()) throw Refusal("recorded drive: nothing in it before the end of the run");
}

void RecordedDrive::add(const std::string& quantity, const std::vector<double>& time_s, const auto& value, int channel,
                        double lag_s) {
  const Utime lag = utime_of(lag_s);
  SLIPSTREAM_CHECK(time_s.size() == value.size());
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (!(time_s[i] >= 0.0 && time_s[i] <= kLatest_s))
      throw Refusal(
          fmt::format("recorded {}: time of sample {}: found {} s, expected from 0 to 1000000 s", quantity, i + 1, time_s[i]));
    if (i > 0 && utime_of(time_s[i]) <= utime_of(time_s[i - 1]))
      throw Refusal(fmt::format("recorded {}: time of sample {}: found {} s after {} s, expected at least a microsecond more",
                                quantity, i + 1, time_s[i], time_s[i - 1]));
    if (utime_of(time_s[i]) >= lag) events_.push_back({utime_of(time_s[i]), channel, value[i], lag});
  }
}

bool RecordedDrive::next(DriveEpoch& epoch) {
  epoch.readings.clear();
  epoch.truth.clear();
  if (next_ == events_.size()) return false;
  epoch.utime = events_[next_].utime;
  const int first_truth = static_cast<int>(quantities_.size());
  for (; next_ < events_.size() && events_[next_].utime == epoch.utime; ++next_) {
    const Event& event = events_[next_];
    if (event.channel < first_truth) {
      epoch.readings.push_back({event.channel, event.value, event.utime - event.lag});
    } else {
      epoch.truth.resize(truth_names_.size(), std::numeric_limits<double>::quiet_NaN());
      epoch.truth[static_cast<std::size_t>(event.channel - first_truth)] = event.value.scalar();
    }
  }
  return true;
}

}  // namespace slipstream
