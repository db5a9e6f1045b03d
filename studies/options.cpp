#include "studies/options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "common/refusal.hpp"

namespace slipstream {

Shard parse_shard(const std::string& text) {
  Shard shard;
  if (text.empty()) return shard;
  const char* const end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, shard.index);
  bool good = first == std::errc() && slash != end && *slash == '/';
  if (good) {
    const auto [rest, second] = std::from_chars(slash + 1, end, shard.of);
    good = second == std::errc() && rest == end && shard.index >= 1 && shard.index <= shard.of && shard.of <= 1'000'000;
  }
  if (!good) throw Refusal(fmt::format("--shard: found '{}', expected K/N with K from 1 to N, like 2/3", text));
  return shard;
}

int parse_jobs(double jobs, int by_default) {
  if (jobs < 0 || jobs > 1024 || jobs != std::floor(jobs))
    throw Refusal(fmt::format("--jobs: found {}, expected a whole number from 1 to 1024", jobs));
  return jobs > 0 ? static_cast<int>(jobs) : by_default;
}

std::string begin_text(const Study& study, const Desk& desk, const Shard& shard, const std::string& folder) {
  std::string estimators;
  for (const StudyEstimator& e : study.estimators) estimators += (estimators.empty() ? "" : ", ") + e.name;
  std::string text = fmt::format("{}: {} case{} x {} runs, {}; into {}", study.name, study.cases.size(),
                                 study.cases.size() == 1 ? "" : "s", study.runs, estimators, folder);
  if (shard.of > 1) text += fmt::format(", shard {}/{}: {} runs", shard.index, shard.of, desk.all());
  if (desk.done() > 0) text += fmt::format("; {} of {} are finished already", desk.done(), desk.all());
  return text;
}

}  // namespace slipstream
