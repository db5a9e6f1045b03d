#include "monitor/health.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "monitor/innovation_sensors.hpp"

namespace slipstream {
namespace {
constexpr std::size_t kMostNews = 40, kMostEpisodes = 200;
}

void Health::update(const EstimatorRecord& r) {
  if (watched_.size() != r.sensors.size())
    for (const auto& [sensor, unused] : r.sensors) watched_.try_emplace(sensor);
  for (; next_row_ < r.utime.size(); ++next_row_) {
    for (auto& [sensor, w] : watched_) {
      follow(r, next_row_, sensor, w);
      listen(r.utime[next_row_], sensor, w);
    }
    if (is_due_) examine(r);
    is_due_ = false;
  }
}

void Health::follow(const EstimatorRecord& r, std::size_t row, const std::string& sensor, Watched& w) {
  const SensorRecord& s = r.sensors.at(sensor);
  for (; w.next < s.row.size() && s.row[w.next] == row; ++w.next) {
    w.watch.add(r.utime[row], s.nis[w.next], s.dimension[w.next]);
    const Episode* episode = w.watch.episode();
    if (!episode || ailing_.size() >= kMostEpisodes) continue;
    const bool is_new = w.watch.episodes() > w.episodes;
    if (is_new) ailing_.push_back({sensor, *episode});
    const bool has_ended = w.was_alarmed && !w.watch.is_alarmed();
    w.episodes = w.watch.episodes();
    w.was_alarmed = w.watch.is_alarmed();
    if (!w.was_alarmed && !has_ended) continue;
    for (Ailing& a : ailing_)
      if (a.sensor == sensor && a.episode.first == episode->first) a.episode = *episode;
    if (!is_new && !has_ended && w.watch.measured() < w.diagnose_at) continue;
    const std::size_t length = w.watch.measured() - episode->first;
    w.diagnose_at = w.watch.measured() + std::max<std::size_t>(length, 5);
    is_due_ = true;
  }
}

void Health::listen(Utime now, const std::string& sensor, Watched& w) {
  const InnovationSensor* known = known_sensor(sensor);
  if (known && !known->is_read) return;
  const bool is_silent = w.watch.is_silent(now);
  if (is_silent && !w.was_silent && silences_.size() < kMostEpisodes) {
    silences_.push_back(silence(sensor, w.watch.newest(), {}));
    tell(fmt::format("silent {} {}", sensor, w.watch.newest()), silences_.back().text);
    is_due_ = true;
  }
  if (!is_silent && w.was_silent) {
    for (Finding& f : silences_)
      if (f.sensor == sensor && !f.until_s) f = silence(sensor, static_cast<Utime>(f.since_s * 1e6 + 0.5), now);
    tell(fmt::format("back {} {}", sensor, now), fmt::format("{} back at {:.1f} s", sensor_label(sensor), seconds(now)));
    is_due_ = true;
  }
  w.was_silent = is_silent;
}

void Health::examine(const EstimatorRecord& r) {
  present_.clear();
  for (const Finding& f : findings(r)) {
    if (!f.until_s) present_.push_back(f.text);
    if (f.cause == Cause::kSilent) continue;
    // A mounting fault is one thing, whatever more data say of its beginning.
    const std::string key = f.other.empty()
                                ? fmt::format("{} {} {}", f.sensor, f.since_s, f.until_s ? "over" : cause_name(f.cause))
                                : fmt::format("{} {} {}", f.sensor, f.other, cause_name(f.cause));
    tell(key, f.until_s ? fmt::format("{} consistent again at {:.1f} s", sensor_label(f.sensor), *f.until_s) : f.text);
  }
}

std::vector<Finding> Health::findings(const EstimatorRecord& r) const {
  std::vector<Finding> all = diagnose(r, ailing_);
  all.insert(all.end(), silences_.begin(), silences_.end());
  return all;
}

void Health::tell(const std::string& key, const std::string& line) {
  if (said_.size() < kMostNews && said_.insert(key).second) news_.push_back(line);
}

std::vector<std::string> Health::take_news() { return std::exchange(news_, {}); }

}  // namespace slipstream
