#include "studies/workers.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <exception>
#include <new>
#include <utility>

#include "common/check.hpp"

namespace slipstream {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kInAdvance_s = 0.02;
constexpr double kMostInAdvance = 256.0;
constexpr std::chrono::milliseconds kSilence{5};  // of a process that has something to say, while its items are short
constexpr std::chrono::milliseconds kShort{1};
constexpr int kDeathsBetweenItems = 3;  // that are put up with
constexpr std::size_t kNothing = static_cast<std::size_t>(-1);

// Orders are items in binary. Words are "+ITEM LINE" and "-ITEM REASON".
int be_worker(const Workers::Work& work, std::atomic<std::size_t>& at, int orders, int words) {
  std::array<std::size_t, 64> items;
  std::string unsaid;
  Clock::time_point spoke = Clock::now();
  for (;;) {
    if (!unsaid.empty()) say(words, std::exchange(unsaid, ""));
    const ssize_t bytes = ::read(orders, items.data(), sizeof items);
    if (bytes <= 0) return 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(bytes) / sizeof items[0]; ++i) {
      at = items[i];
      const Clock::time_point begun = Clock::now();
      try {
        unsaid += fmt::format("+{} {}\n", items[i], work(items[i]));
      } catch (const std::exception& e) {
        std::string reason = e.what();
        std::replace(reason.begin(), reason.end(), '\n', ' ');
        unsaid += fmt::format("-{} {}\n", items[i], reason);
      }
      at = kNothing;
      const Clock::time_point now = Clock::now();
      if (now - begun < kShort && now - spoke < kSilence) continue;
      say(words, std::exchange(unsaid, ""));
      spoke = now;
    }
  }
}

}  // namespace

SharedItem::SharedItem() {
  static_assert(std::atomic<std::size_t>::is_always_lock_free);
  void* const memory = ::mmap(nullptr, sizeof *item_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  item_ = new (memory) std::atomic<std::size_t>(kNothing);
}
SharedItem::~SharedItem() { ::munmap(item_, sizeof *item_); }

Workers::Workers(int jobs, Work work, Hooks hooks)
    : work_(std::move(work)), hooks_(std::move(hooks)), started_(std::chrono::steady_clock::now()) {
  SLIPSTREAM_CHECK(jobs > 0);
  workers_.resize(static_cast<std::size_t>(jobs));
}

void Workers::start(Worker& worker) {
  worker.at = std::make_unique<SharedItem>();
  worker.child = std::make_unique<ChildProcess>(
      [this, &at = worker.at->item()](int orders, int words) { return be_worker(work_, at, orders, words); });
}

// Items that one worker has at a time.
std::size_t Workers::depth() const {
  if (finished_ == 0) return 1;
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
  const double item_s = elapsed_s * static_cast<double>(workers_.size()) / static_cast<double>(finished_);
  return static_cast<std::size_t>(std::clamp(1.0 + kInAdvance_s / std::max(item_s, 1e-9), 1.0, kMostInAdvance));
}

Workers::Worker& Workers::freest() {
  return *std::min_element(workers_.begin(), workers_.end(),
                           [](const Worker& a, const Worker& b) { return a.under_way.size() < b.under_way.size(); });
}

// A worker asks again when half of what it had is done.
std::size_t Workers::wanted() const {
  const std::size_t most = depth();
  std::size_t items = 0;
  for (const Worker& w : workers_)
    if (w.under_way.size() <= most / 2 || w.unordered > 0) items += most - std::min(most, w.under_way.size());
  return items;
}

bool Workers::is_idle() const {
  return std::all_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.under_way.empty(); });
}

void Workers::give(std::size_t item) {
  Worker& worker = freest();
  worker.under_way.push_back(item);
  ++worker.unordered;
}

void Workers::order(Worker& worker) {
  if (worker.unordered == 0) return;
  if (!worker.child) start(worker);
  const std::vector<std::size_t> items(worker.under_way.end() - static_cast<std::ptrdiff_t>(worker.unordered),
                                       worker.under_way.end());
  worker.child->order({reinterpret_cast<const char*>(items.data()), items.size() * sizeof items[0]});
  worker.unordered = 0;
}

void Workers::hear(Worker& worker, const std::string& line) {
  const std::size_t space = line.find(' ');
  std::size_t item = 0;
  std::from_chars(line.data() + 1, line.data() + space, item);
  SLIPSTREAM_CHECK(!worker.under_way.empty() && worker.under_way.front() == item);
  worker.under_way.pop_front();
  worker.deaths_between_items = 0;
  ++finished_;
  (line[0] == '+' ? hooks_.finished : hooks_.failed)(item, line.substr(space + 1));
}

// A process that has ended: what it was doing has failed, what it had in advance or had not said yet goes to others. One that
// ends again and again between two items: the next has failed.
void Workers::bury(Worker& worker) {
  const std::string reason = worker.child->end();
  std::size_t culprit = worker.at->item();
  if (culprit == kNothing && !worker.under_way.empty() && ++worker.deaths_between_items >= kDeathsBetweenItems) {
    worker.deaths_between_items = 0;
    culprit = worker.under_way.front();
  }
  worker.child.reset();
  worker.unordered = 0;
  for (const std::size_t item : std::exchange(worker.under_way, {})) {
    if (item == culprit)
      hooks_.failed(item, reason.empty() ? "its process ended" : "its process " + reason);
    else
      give(item);
  }
}

void Workers::wait(int most_ms) {
  std::vector<pollfd> ends;
  std::vector<Worker*> polled;
  for (Worker& w : workers_) {
    order(w);
    if (!w.child) continue;
    ends.push_back({w.child->words(), POLLIN, 0});
    polled.push_back(&w);
  }
  if (::poll(ends.data(), ends.size(), most_ms) <= 0) return;
  for (std::size_t i = 0; i < ends.size(); ++i)
    if (ends[i].revents != 0 && !polled[i]->child->read([&](const std::string& line) { hear(*polled[i], line); }))
      bury(*polled[i]);
}

}  // namespace slipstream
