#include "studies/desk.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "common/refusal.hpp"
#include "monitor/results.hpp"

namespace slipstream {

Desk::Desk(const Study& study, const std::string& folder, const Shard& shard, const Say& say)
    : study_(study), shard_(shard), say_(say), have_(study.items(), false) {
  claim_folder(folder, study);
  journal_.emplace(folder, shard);
  KnownRuns known(study);
  for (const std::string& path : runs_files(folder)) {
    const std::size_t torn = known.read(path);
    if (torn == 0 || path != journal_->path()) continue;  // another process's last line may just be being written
    journal_->cut(torn);
    say_(fmt::format("{}: cut off a torn last line of {} bytes; its run is repeated", path, torn));
  }
  for (std::size_t item = 0; item < study.items(); ++item) {
    have_[item] = known.has(item);
    if (!shard.has(item)) continue;
    ++all_;
    if (!have_[item]) continue;
    ++known_;
    if (repeat_) continue;
    repeat_ = item;
    repeated_line_ = known.text(item);
    repeated_place_ = known.place(item);
  }
  if (known_ == all_) repeat_.reset();  // nothing is mixed
}

std::optional<std::size_t> Desk::next() {
  if (repeat_ && !repeat_given_) {
    repeat_given_ = true;
    return repeat_;
  }
  while (at_ < have_.size() && (have_[at_] || !shard_.has(at_))) ++at_;
  return at_ < have_.size() ? std::optional(at_++) : std::nullopt;
}

void Desk::finished(std::size_t item, const std::string& line) {
  if (item == repeat_) {
    if (!is_same_result(line, repeated_line_))
      throw Refusal(
          fmt::format("{}: this run comes out differently now: another program has begun this study; start it afresh in "
                      "another folder",
                      repeated_place_));
    return;
  }
  have_[item] = true;
  ++finished_;
  unwritten_ += line + "\n";
}

void Desk::failed(std::size_t item, const std::string& error) {
  if (item != repeat_) failures_[item] = error;  // the repeated one has its result
}

void Desk::flush() {
  journal_->append(unwritten_);
  unwritten_.clear();
}

void Desk::close() {
  flush();
  journal_->sync();
}

Summary summarise(const Study& study, const KnownRuns& known) {
  Summariser summariser(study);
  for (std::size_t item = 0; item < study.items(); ++item)
    if (known.has(item)) summariser.add(known.run(item));
  return summariser.finish();
}

void write_summary(const std::string& folder, const Study& study, const Summary& summary) {
  const std::filesystem::path out(folder);
  const FileLock lock = lock_folder(folder);
  write_file((out / "timings.json").string(), timings_json(study, summary));
  write_file((out / "results.json").string(), results_json(study, summary));
}

std::string some_items(const std::vector<std::size_t>& items) {
  constexpr std::size_t kNamed = 5;
  std::string text = items.size() == 1 ? "item" : "items";
  for (std::size_t i = 0; i < std::min(items.size(), kNamed); ++i) text += fmt::format("{} {}", i == 0 ? "" : ",", items[i]);
  return items.size() > kNamed ? text + fmt::format(" and {} more", items.size() - kNamed) : text;
}

}  // namespace slipstream
