// slipstream-study: plays a study, many runs of some scenarios followed by the same estimators, on all processors of this
// machine; or merges what several machines have played.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "common/refusal.hpp"
#include "io/command_line.hpp"
#include "io/interrupt.hpp"
#include "io/study_reader.hpp"
#include "studies/conduct.hpp"
#include "studies/item.hpp"
#include "studies/options.hpp"

namespace slipstream {
namespace {

namespace fs = std::filesystem;

void say(const std::string& line) {
  fmt::print("slipstream-study: {}\n", line);
  std::fflush(stdout);
}

int play_study(int argc, char** argv) {
  std::string path, out, shard_text;
  double jobs = 0;
  CommandLine line(
      "slipstream-study",
      "Plays a study: scenarios x grid x runs, followed by the same estimators. `slipstream-study merge --help` tells "
      "how to merge shards.");
  line.positional("STUDY", path, "study file (TOML)", true);
  line.option("--out", out, "folder of the results (default: out/studies/NAME); a call goes on where an earlier one ended");
  line.option("--jobs", jobs, "runs at a time (default: one for each processor)");
  line.option("--shard", shard_text, "K/N: only every N-th run, beginning with the K-th");
  line.parse(argc, argv);
  const Shard shard = parse_shard(shard_text);
  const int processes = parse_jobs(jobs, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  const Study study = load_study_file(path, require_playable);
  if (out.empty()) out = (fs::path("out/studies") / study.name).string();

  catch_interrupts();
  Desk desk(study, out, shard, say);
  say(begin_text(study, desk, shard, out));
  const bool complete = conduct(study, desk, processes, interrupted);
  conclude(study, out, shard, desk, complete, say);
  return 0;
}

// The study that lies beside a file of runs.
std::string study_beside(const std::string& runs) {
  const std::string file = (fs::path(runs).parent_path() / "study.toml").string();
  if (!fs::exists(file)) throw Refusal(fmt::format("{}: there is no study.toml beside it that says of what", runs));
  return file;
}

std::string first_line(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

int merge_shards(int argc, char** argv) {
  std::vector<std::string> sources, files;
  std::string out;
  bool partial = false;
  CommandLine line("slipstream-study merge",
                   "Merges runs of one study from several folders, with the result of one undivided call.");
  line.positionals("DIR|FILE", sources, "folders of a study, or files runs*.jsonl with their study.toml beside them");
  line.option("--out", out, "folder of the merged study");
  line.flag("--partial", partial, "also if runs are missing");
  line.parse(argc, argv);
  if (sources.empty()) throw Refusal("merge: missing argument 'DIR|FILE'; see --help");
  if (out.empty()) throw Refusal("merge: missing option '--out'; see --help");
  for (const std::string& source : sources) {
    std::vector<std::string> here{source};
    if (fs::is_directory(source)) here = runs_files(source);
    if (here.empty()) throw Refusal(fmt::format("{}: no runs*.jsonl in this folder", source));
    files.insert(files.end(), here.begin(), here.end());
  }
  for (const std::string& file : runs_files(out)) files.push_back(file);  // what is there takes part
  std::set<std::string> seen;
  std::erase_if(files, [&](const std::string& f) { return !seen.insert(fs::weakly_canonical(f).string()).second; });
  const std::string first = study_beside(files.front());
  for (const std::string& file : files)
    if (const std::string other = study_beside(file); first_line(other) != first_line(first))
      throw Refusal(fmt::format("{} and {} are of different studies, or of processors that compute differently ('{}' and '{}')",
                                files.front(), file, first_line(first), first_line(other)));
  const Study study = load_study_file(first, require_playable);
  if (study_head(study) != first_line(first))
    throw Refusal(fmt::format("{}: its first line says '{}', but it reads as '{}': was it changed, or made by another program?",
                              first, first_line(first).substr(0, 40), study_head(study)));
  merge_runs(study, files, out, partial, say);
  return 0;
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-study", [&] {
    const bool merges = argc > 1 && std::strcmp(argv[1], "merge") == 0;
    return merges ? slipstream::merge_shards(argc - 1, argv + 1) : slipstream::play_study(argc, argv);
  });
}
