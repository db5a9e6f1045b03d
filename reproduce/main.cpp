// slipstream-reproduce: regenerates the experiments of documents 000, 001 and 002 and writes them beside what was published.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "common/random.hpp"
#include "common/refusal.hpp"
#include "io/command_line.hpp"
#include "io/csv.hpp"
#include "io/interrupt.hpp"
#include "io/recorded_files.hpp"
#include "io/scenario_reader.hpp"
#include "io/suggest.hpp"
#include "io/text_file.hpp"
#include "reproduce/experiment.hpp"
#include "reproduce/files.hpp"
#include "reproduce/runner.hpp"
#include "studies/progress_line.hpp"

namespace slipstream {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> names;
  std::string out = "out/reproduce", data, scenarios = "scenarios";
  double seeds = 0, jobs = 0;
  bool list = false, fresh = false;
};

void say(const std::string& line) {
  fmt::print("slipstream-reproduce: {}\n", line);
  std::fflush(stdout);
}

void print_list() {
  std::string document;
  for (const Experiment& e : experiments()) {
    if (e.document != document) fmt::print("document {}\n", document = e.document);
    fmt::print("  {:<22} {}\n  {:<22} {}\n", e.name, e.title, "", fmt::join(e.items, ", "));
  }
}

// By its name, its document or an item: "snow", "past/unimog_torque", "002", "001_fig_6", "002_fig_6", "Table 4". An item
// without a document is one of document 002.
bool is_meant(const Experiment& e, const std::string& name) {
  return name == e.name || name == e.document || name == e.document + "/" + e.name ||
         std::any_of(e.items.begin(), e.items.end(), [&](const std::string& item) {
           const std::string stem = file_stem(name);
           return stem == item_stem(e.document, item) || stem == e.document + "_" + file_stem(item);
         });
}

// Of a name that means nothing: an item's that only another document has, else the nearest experiment's.
std::string suggested(const std::string& name) {
  std::vector<std::string> known;
  for (const Experiment& e : experiments()) {
    known.push_back(e.name);
    for (const std::string& item : e.items)
      if (file_stem(item) == file_stem(name)) return fmt::format("; did you mean '{}'?", item_stem(e.document, item));
  }
  return suggestion(name, known);
}

std::vector<const Experiment*> chosen(const std::vector<std::string>& names) {
  std::vector<const Experiment*> result;
  for (const Experiment& e : experiments()) {
    if (names.empty() || std::any_of(names.begin(), names.end(), [&](const std::string& name) { return is_meant(e, name); }))
      result.push_back(&e);
  }
  for (const std::string& name : names) {
    if (std::none_of(result.begin(), result.end(), [&](const Experiment* e) { return is_meant(*e, name); }))
      throw Refusal(fmt::format("no experiment '{}'{}; --list names them with their figures and tables", printable(name),
                                suggested(name)));
  }
  return result;
}

// Everything a result depends on: this program, the scenarios, the data folder, the number of seeds.
std::string key_of(const Options& o) {
  std::uint64_t h = hash64(read_text_file("/proc/self/exe"));
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(o.scenarios)) files.push_back(entry.path());  // bases, too
  std::sort(files.begin(), files.end());
  for (const fs::path& f : files)
    if (f.extension() == ".toml") h = hash64(read_text_file(f.string()), h);
  h = hash64(fmt::format("{} {}", o.data, o.seeds), h);
  if (!o.data.empty()) {
    std::vector<std::string> data;
    for (const auto& entry : fs::recursive_directory_iterator(o.data))
      if (entry.is_regular_file())
        data.push_back(fmt::format("{} {} {}", entry.path().string(), entry.file_size(),
                                   entry.last_write_time().time_since_epoch().count()));
    std::sort(data.begin(), data.end());
    for (const std::string& file : data) h = hash64(file, h);
  }
  return fmt::format("{:016x}", h);
}

Bench make_bench(const Options& o) {
  Bench bench;
  bench.seeds = static_cast<int>(o.seeds);
  bench.data_dir = o.data;
  bench.scenario = [o](const std::string& name, const std::vector<std::string>& overrides) {
    return load_scenario_file((fs::path(o.scenarios) / (name + ".toml")).string(), overrides).scenario;
  };
  bench.streams = [o](const Scenario& scenario, const std::string& folder) {
    return load_recorded(scenario, (fs::path(o.data) / folder).string());
  };
  bench.columns = [o](const std::string& file, const std::vector<std::string>& columns) {
    const CsvTable table = read_csv((fs::path(o.data) / file).string(), columns);
    std::vector<std::vector<double>> values;
    for (const std::string& column : columns) values.push_back(table[column]);
    return values;
  };
  return bench;
}

// "[1/4]  snow 3 of 20  tyre begins"
class ExperimentsProgress {
 public:
  void show(const std::vector<RunnerHooks::Activity>& running, std::size_t finished, std::size_t all) {
    std::string line = fmt::format("[{}/{}]", finished, all);
    for (const auto& a : running)
      line +=
          a.total > 0 ? fmt::format("  {} {} of {}", a.experiment, a.done, a.total) : fmt::format("  {} begins", a.experiment);
    line_.show(line, finished != finished_);
    finished_ = finished;
  }
  void clear() { line_.clear(); }

 private:
  ProgressLine line_;
  std::size_t finished_ = 0;
};

std::vector<Part> finished_parts(const std::string& out, const std::string& key) {
  std::vector<Part> parts;
  for (const Experiment& e : experiments())
    if (auto part = read_part(out, e.name, key)) parts.push_back(std::move(*part));
  return parts;
}

int run(int argc, char** argv) {
  Options o;
  CommandLine line("slipstream-reproduce",
                   "Regenerates the experiments of documents 000, 001 and 002 beside their published values.");
  line.positionals("NAME", o.names,
                   "documents, experiments, figures or tables: 001, snow, fig_6 (of 002), 001_fig_6 (default: all)");
  line.flag("--list", o.list, "name the experiments and what each regenerates");
  line.option("--out", o.out, "folder for the report, the figures and the tables");
  line.option("--data", o.data, "folder of the recorded drives; without it the experiments on them are left out");
  line.option("--scenarios", o.scenarios, "folder of the scenario files");
  line.option("--seeds", o.seeds, "runs of every Monte Carlo spread (default: 20; of document 001 50, of 000 10 times 100)");
  line.option("--jobs", o.jobs, "experiments at a time (default: one for each processor)");
  line.flag("--fresh", o.fresh, "compute again what an earlier call has finished");
  line.parse(argc, argv);
  if (o.list) {
    print_list();
    return 0;
  }
  std::vector<const Experiment*> wanted = chosen(o.names);
  if (o.data.empty()) {
    for (const Experiment* e : wanted)
      if (e->needs_data && !o.names.empty())
        throw Refusal(fmt::format("experiment '{}' needs the recorded drives: --data DIR", e->name));
    std::erase_if(wanted, [](const Experiment* e) { return e->needs_data; });
  }
  if (o.seeds < 0 || o.seeds > 10000 || o.seeds != std::floor(o.seeds))
    throw Refusal(fmt::format("--seeds: found {}, expected a whole number from 0 to 10000", o.seeds));
  if (o.jobs < 0 || o.jobs > 1024 || o.jobs != std::floor(o.jobs))
    throw Refusal(fmt::format("--jobs: found {}, expected a whole number from 1 to 1024", o.jobs));
  if (!o.data.empty() && !fs::is_directory(o.data)) throw Refusal(fmt::format("--data: no such folder: {}", o.data));
  if (!fs::is_directory(o.scenarios)) throw Refusal(fmt::format("--scenarios: no such folder: {}", o.scenarios));
  prepare_output(o.out);

  const std::string key = key_of(o);
  std::vector<const Experiment*> todo;
  for (const Experiment* e : wanted) {
    if (o.fresh) fs::remove(fs::path(o.out) / "parts" / (e->name + ".json"));
    if (!read_part(o.out, e->name, key)) todo.push_back(e);
  }
  if (todo.size() < wanted.size())
    say(fmt::format("{} of {} experiments are finished already in {}", wanted.size() - todo.size(), wanted.size(), o.out));
  std::string others;
  for (const Experiment& e : experiments())
    if (fs::exists(fs::path(o.out) / "parts" / (e.name + ".json")) && !read_part(o.out, e.name, key)) others += " " + e.name;
  if (!others.empty())
    say(fmt::format("made with another program, scenario, data or --seeds, and left out until they are run again:{}", others));
  if (o.data.empty()) say("no recorded drives (--data DIR): what needs them is left out");

  catch_interrupts();
  ExperimentsProgress progress;
  std::vector<std::string> failed;
  RunnerHooks hooks;
  hooks.interrupted = [] { return interrupted(); };
  hooks.progress = [&](const auto& running, std::size_t finished, std::size_t all) { progress.show(running, finished, all); };
  hooks.finished = [&](const std::string& name, const std::string& error, double elapsed_s) {
    progress.clear();
    if (!error.empty()) failed.push_back(fmt::format("experiment {} failed: {}", name, error));
    say(error.empty() ? fmt::format("{} finished in {:.1f} s", name, elapsed_s) : failed.back());
  };
  const int jobs = o.jobs > 0 ? static_cast<int>(o.jobs) : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const bool complete = run_experiments(todo, make_bench(o), o.out, key, jobs, hooks);
  progress.clear();

  const std::vector<Part> parts = finished_parts(o.out, key);
  std::vector<std::string> warnings = failed;
  if (!complete)
    warnings.emplace_back("This call was interrupted: what it had finished is here, the same call goes on from there.");
  if (o.data.empty()) warnings.emplace_back("Without recorded drives (--data DIR): what needs them is left out.");
  write_results(o.out, parts);
  write_report(o.out, parts, warnings);
  say(fmt::format("{} of {} experiments are in {}", parts.size(), experiments().size(),
                  (fs::path(o.out) / "report.html").string()));
  if (!complete) throw Refusal("interrupted; the same call goes on from here");
  if (!failed.empty()) throw Refusal(fmt::format("{} of {} experiments failed", failed.size(), todo.size()));
  return 0;
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  return slipstream::run_main("slipstream-reproduce", [&] { return slipstream::run(argc, argv); });
}
