// slipstream-study-mpi: the same as slipstream-study, over the ranks of an MPI job: mpirun -n K slipstream-study-mpi STUDY.toml
//
// Rank 0 alone reads the study and writes its folder, so the hosts need not share a disk. Every rank computes in processes of
// its own, which know nothing of MPI, asks rank 0 for items and sends it their lines:
//
//   0 -> all   the study's key and texts, once
//   r -> 0     "ask N\n" and lines "+ITEM LINE" or "-ITEM REASON"; "end\n" and lines: nothing follows
//   0 -> r     the answer to "ask N", N > 0: at most N items; none: there are no more
//
// The only file that names MPI. Nobody spins on a message: the processors belong to the computing processes.
#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <utility>
#include <vector>

#include "common/refusal.hpp"
#include "io/command_line.hpp"
#include "io/interrupt.hpp"
#include "io/study_reader.hpp"
#include "studies/conduct.hpp"
#include "studies/item.hpp"
#include "studies/options.hpp"
#include "studies/progress_line.hpp"
#include "studies/workers.hpp"

namespace slipstream {
namespace {

constexpr int kWords = 1, kOrders = 2;  // tags
constexpr int kWait_ms = 2;             // between two looks at the messages
constexpr std::chrono::milliseconds kKeepWords{300};

struct Options {
  std::string path, out;
  double jobs = 0;
};

void say(const std::string& line) {
  fmt::print("slipstream-study-mpi: {}\n", line);
  std::fflush(stdout);
}

int rank_of_this() {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  return rank;
}

// A message of this tag that has come, from whichever rank. False if there is none.
bool receive(int tag, std::string& bytes, int& from) {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, tag, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return false;
  int size = 0;
  MPI_Get_count(&status, MPI_CHAR, &size);
  bytes.resize(static_cast<std::size_t>(size));
  from = status.MPI_SOURCE;
  MPI_Recv(bytes.data(), size, MPI_CHAR, from, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return true;
}

void send(int to, int tag, const std::string& bytes) {
  MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_CHAR, to, tag, MPI_COMM_WORLD);
}

// Orders that are on their way, one to a rank: it asks again when it has them. Rank 0 does not wait for who may be waiting for
// it to take its words.
class OrdersSent {
 public:
  explicit OrdersSent(int ranks) : under_way_(static_cast<std::size_t>(ranks)) {}
  void send(int to, std::string bytes) {
    auto& [order, request] = under_way_[static_cast<std::size_t>(to)];
    MPI_Wait(&request, MPI_STATUS_IGNORE);
    order = std::move(bytes);
    MPI_Isend(order.data(), static_cast<int>(order.size()), MPI_CHAR, to, kOrders, MPI_COMM_WORLD, &request);
  }
  void wait() {
    for (auto& [order, request] : under_way_) MPI_Wait(&request, MPI_STATUS_IGNORE);
  }

 private:
  struct Order {
    std::string bytes;
    MPI_Request request = MPI_REQUEST_NULL;
  };
  std::vector<Order> under_way_;
};

void broadcast(std::string& text) {
  std::uint64_t size = text.size();
  MPI_Bcast(&size, 1, MPI_UINT64_T, 0, MPI_COMM_WORLD);
  text.resize(size);
  MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, 0, MPI_COMM_WORLD);
}

std::string take_line(std::string& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string line = text.substr(0, end);
  text.erase(0, std::min(end + 1, text.size()));
  return line;
}

std::size_t number_after(const std::string& line, std::size_t begin) {
  std::size_t number = 0;
  std::from_chars(line.data() + begin, line.data() + line.size(), number);
  return number;
}

Workers::Work work_of(const Study& study) {
  return [&study](std::size_t item) { return to_text(run_item(study, item)); };
}

// --- Rank 0 -----------------------------------------------------------------------------------------------------------

void hear(Desk& desk, const std::string& words) {
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find('\n', begin), words.size());
    const std::string line = words.substr(begin, end - begin);
    const std::string said = line.substr(line.find(' ') + 1);
    if (line[0] == '+') desk.finished(number_after(line, 1), said);
    if (line[0] == '-') desk.failed(number_after(line, 1), said);
    begin = end + 1;
  }
}

// False if it was interrupted.
bool lead(const Study& study, Desk& desk, int jobs, int ranks) {
  RunsProgress progress;
  Workers workers(jobs, work_of(study),
                  {[&](std::size_t item, const std::string& line) { desk.finished(item, line); },
                   [&](std::size_t item, const std::string& error) { desk.failed(item, error); }});
  OrdersSent orders(ranks);
  int others = ranks - 1;
  for (bool more = true; more || others > 0 || !workers.is_idle();) {
    std::string words;
    for (int from = 0; receive(kWords, words, from);) {
      const std::string head = take_line(words);
      hear(desk, words);
      if (head == "end") --others;
      std::vector<std::uint64_t> items;
      const std::size_t asked = head.starts_with("ask ") ? number_after(head, 4) : 0;
      while (items.size() < asked) {
        const std::optional<std::size_t> item = desk.next();
        if (!item) break;
        items.push_back(*item);
      }
      if (asked > 0) orders.send(from, {reinterpret_cast<const char*>(items.data()), items.size() * sizeof items[0]});
    }
    while (more && workers.wanted() > 0) {
      const std::optional<std::size_t> item = desk.next();
      more = item.has_value();
      if (item) workers.give(*item);
    }
    workers.wait(kWait_ms);
    desk.flush();
    progress.show(desk.done(), desk.finished_here(), desk.all());
    if (interrupted()) break;
  }
  if (!interrupted()) orders.wait();
  progress.clear();
  desk.close();
  return !interrupted();
}

// --- The others -------------------------------------------------------------------------------------------------------

void follow(const Study& study, int jobs) {
  using Clock = std::chrono::steady_clock;
  std::string words;
  Workers workers(jobs, work_of(study),
                  {[&](std::size_t item, const std::string& line) { words += fmt::format("+{} {}\n", item, line); },
                   [&](std::size_t item, const std::string& error) { words += fmt::format("-{} {}\n", item, error); }});
  bool more = true, asking = false;
  Clock::time_point sent = Clock::now();
  while (more || !workers.is_idle()) {
    const std::size_t asked = more && !asking ? workers.wanted() : 0;
    if (asked > 0 || (!words.empty() && Clock::now() - sent > kKeepWords)) {
      send(0, kWords, fmt::format("ask {}\n{}", asked, std::exchange(words, "")));
      sent = Clock::now();
      asking = asking || asked > 0;
    }
    workers.wait(kWait_ms);
    std::string orders;
    int from = 0;
    if (!asking || !receive(kOrders, orders, from)) continue;
    asking = false;
    more = !orders.empty();
    for (std::size_t i = 0; i < orders.size(); i += sizeof(std::uint64_t)) {
      std::uint64_t item = 0;
      std::copy_n(orders.data() + i, sizeof item, reinterpret_cast<char*>(&item));
      workers.give(item);
    }
  }
  send(0, kWords, "end\n" + words);
}

// --- All --------------------------------------------------------------------------------------------------------------

// Everything that rank 0 knows of the study: its key, its text, and each scenario's name and text, with their sizes.
std::string packed(const Study& study) {
  std::string text = study.key + "\n" + fmt::format("{}\n", study.resolved_toml.size()) + study.resolved_toml;
  for (const StudyScenario& s : study.scenarios) text += fmt::format("{}\n{}\n", s.name, s.toml.size()) + s.toml;
  return text;
}

std::string take_sized(std::string& text) {
  const std::size_t size = number_after(take_line(text), 0);
  std::string part = text.substr(0, size);
  text.erase(0, size);
  return part;
}

Study unpacked(std::string text) {
  const std::string key = take_line(text), toml = take_sized(text);
  std::map<std::string, std::string> scenarios;
  while (!text.empty()) {
    const std::string name = take_line(text);
    scenarios[name] = take_sized(text);
  }
  Study study = load_study_text(toml, scenarios, "study", require_playable);
  if (study.key != key)
    throw Refusal(fmt::format("reads another study ('{}') than rank 0 ('{}'): is its program another one?", study.key, key));
  return study;
}

// True if everything is finished.
int run(int argc, char** argv) {
  Options o;
  CommandLine line("slipstream-study-mpi", "Plays a study over the ranks of an MPI job; see slipstream-study.");
  line.positional("STUDY", o.path, "study file (TOML), of rank 0", true);
  line.option("--out", o.out, "folder of the results, of rank 0 (default: out/studies/NAME)");
  line.option("--jobs", o.jobs, "runs at a time of every rank (default: 1)");
  line.parse(argc, argv);
  const int jobs = parse_jobs(o.jobs, 1);
  int ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  std::string bundle;
  if (rank_of_this() != 0) {
    std::signal(SIGINT, SIG_IGN);  // rank 0 hears it and ends everybody
    broadcast(bundle);
    if (bundle.empty()) return 0;  // rank 0 says why
    follow(unpacked(bundle), jobs);
    return 0;
  }
  try {
    const Study study = load_study_file(o.path, require_playable);
    if (o.out.empty()) o.out = (std::filesystem::path("out/studies") / study.name).string();
    catch_interrupts();
    Desk desk(study, o.out, {}, say);
    say(begin_text(study, desk, {}, o.out) + fmt::format("; {} rank{}", ranks, ranks == 1 ? "" : "s"));
    bundle = packed(study);
    broadcast(bundle);
    const bool complete = lead(study, desk, jobs, ranks);
    conclude(study, o.out, {}, desk, complete, say);
    return 0;
  } catch (const Refusal&) {
    if (bundle.empty()) broadcast(bundle);  // nobody has begun
    throw;
  }
}

}  // namespace
}  // namespace slipstream

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const int rank = slipstream::rank_of_this();
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string name =
      rank == 0 ? "slipstream-study-mpi" : fmt::format("slipstream-study-mpi (rank {} on {})", rank, host.data());
  const int code = slipstream::run_main(name, [&] { return slipstream::run(argc, argv); });
  // Whoever fails ends all: the others wait for messages that never come.
  if (code != 0) MPI_Abort(MPI_COMM_WORLD, code);
  MPI_Finalize();
  return code;
}
