#include "studies/conduct.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "common/refusal.hpp"
#include "monitor/results.hpp"
#include "studies/item.hpp"
#include "studies/progress_line.hpp"
#include "studies/workers.hpp"

namespace slipstream {
namespace {

void show_summary(const std::string& folder, const Study& study, const Summary& summary, const Desk::Say& say) {
  fmt::print("\n{}\n", summary_text(study, summary));
  std::fflush(stdout);
  say(fmt::format("results are in {}", (std::filesystem::path(folder) / "results.json").string()));
}

}  // namespace

bool conduct(const Study& study, Desk& desk, int jobs, const std::function<bool()>& interrupted) {
  RunsProgress progress;
  Workers workers(jobs, [&study](std::size_t item) { return to_text(run_item(study, item)); },
                  {[&](std::size_t item, const std::string& line) { desk.finished(item, line); },
                   [&](std::size_t item, const std::string& error) { desk.failed(item, error); }});
  for (bool more = true; more || !workers.is_idle();) {
    while (more && workers.wanted() > 0) {
      const std::optional<std::size_t> item = desk.next();
      more = item.has_value();
      if (item) workers.give(*item);
    }
    workers.wait(200);
    desk.flush();
    progress.show(desk.done(), desk.finished_here(), desk.all());
    if (interrupted()) break;
  }
  progress.clear();
  desk.close();
  return !interrupted();
}

void conclude(const Study& study, const std::string& folder, const Shard& shard, Desk& desk, bool complete,
              const Desk::Say& say) {
  for (const auto& [item, error] : desk.failures())
    say(fmt::format("item {} failed: {} (to see it: {})", item, error, replay_command(study, item)));
  if (!complete)
    throw Refusal(
        fmt::format("interrupted with {} of {} runs finished; the same call goes on from here", desk.done(), desk.all()));
  KnownRuns known(study);
  for (const std::string& path : runs_files(folder)) known.read(path);
  if (known.count() == study.items() || (shard.of == 1 && !desk.failures().empty())) {
    const Summary summary = summarise(study, known);
    write_summary(folder, study, summary);
    show_summary(folder, study, summary, say);
  } else {
    say(fmt::format("shard {}/{} is finished: {} runs; merge the shards with: slipstream-study merge DIR... --out DIR",
                    shard.index, shard.of, desk.done()));
  }
  if (!desk.failures().empty())
    throw Refusal(fmt::format("{} of {} runs failed; the same call tries them again", desk.failures().size(), desk.all()));
}

void merge_runs(const Study& study, const std::vector<std::string>& files, const std::string& folder, bool partial,
                const Desk::Say& say) {
  KnownRuns known(study);
  for (const std::string& path : files)
    if (const std::size_t torn = known.read(path); torn > 0)
      say(fmt::format("{}: left out a torn last line of {} bytes", path, torn));
  if (known.repeated() > 0) say(fmt::format("{} runs are there more than once, with the same result", known.repeated()));
  const Summary summary = summarise(study, known);
  if (!summary.missing.empty()) {
    const std::string line =
        fmt::format("{} of {} runs are missing: {}", summary.missing.size(), study.items(), some_items(summary.missing));
    if (!partial) throw Refusal(line + "; --partial merges what is there");
    say(line);
  }
  std::string merged;
  for (std::size_t item = 0; item < study.items(); ++item)
    if (known.has(item)) merged += known.text(item) + "\n";
  claim_folder(folder, study);
  const Journal journal(folder, {});  // nobody else writes there
  write_file(journal.path(), merged);
  write_summary(folder, study, summary);
  show_summary(folder, study, summary, say);
}

}  // namespace slipstream
