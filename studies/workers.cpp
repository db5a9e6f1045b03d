#include "studies/workers.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <exception>
#include <utility>

#include "common/check.hpp"

namespace slipstream {
namespace {

constexpr double kInAdvance_s = 0.02;
constexpr double kMostInAdvance = 256.0;

// Orders are items in binary. Words are "+ITEM LINE" and "-ITEM REASON".
int be_worker(const Workers::Work& work, int orders, int words) {
  std::size_t item = 0;
  while (::read(orders, &item, sizeof item) == sizeof item) {
    try {
      say_line(words, fmt::format("+{} {}", item, work(item)));
    } catch (const std::exception& e) {
      std::string reason = e.what();
      std::replace(reason.begin(), reason.end(), '\n', ' ');
      say_line(words, fmt::format("-{} {}", item, reason));
    }
  }
  return 0;
}

}  // namespace

Workers::Workers(int jobs, Work work, Hooks hooks)
    : work_(std::move(work)), hooks_(std::move(hooks)), started_(std::chrono::steady_clock::now()) {
  SLIPSTREAM_CHECK(jobs > 0);
  workers_.resize(static_cast<std::size_t>(jobs));
}

void Workers::start(Worker& worker) {
  worker.child = std::make_unique<ChildProcess>([this](int orders, int words) { return be_worker(work_, orders, words); });
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

std::size_t Workers::wanted() const {
  const std::size_t most = depth();
  std::size_t items = 0;
  for (const Worker& w : workers_) items += most - std::min(most, w.under_way.size());
  return items;
}

bool Workers::is_idle() const {
  return std::all_of(workers_.begin(), workers_.end(), [](const Worker& w) { return w.under_way.empty(); });
}

void Workers::give(std::size_t item) {
  Worker& worker = freest();
  if (!worker.child) start(worker);
  worker.under_way.push_back(item);
  worker.child->order({reinterpret_cast<const char*>(&item), sizeof item});
}

void Workers::hear(Worker& worker, const std::string& line) {
  const std::size_t space = line.find(' ');
  std::size_t item = 0;
  std::from_chars(line.data() + 1, line.data() + space, item);
  SLIPSTREAM_CHECK(!worker.under_way.empty() && worker.under_way.front() == item);
  worker.under_way.pop_front();
  ++finished_;
  (line[0] == '+' ? hooks_.finished : hooks_.failed)(item, line.substr(space + 1));
}

// A process that has ended: the item that it was at is lost, what it had in advance goes to a new one.
void Workers::bury(Worker& worker) {
  const std::string reason = worker.child->end();
  worker.child.reset();
  const std::deque<std::size_t> left = std::exchange(worker.under_way, {});
  if (left.empty()) return;
  hooks_.failed(left.front(), reason.empty() ? "its process ended" : "its process " + reason);
  for (std::size_t i = 1; i < left.size(); ++i) give(left[i]);
}

void Workers::wait(int most_ms) {
  std::vector<pollfd> ends;
  std::vector<Worker*> polled;
  for (Worker& w : workers_) {
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
