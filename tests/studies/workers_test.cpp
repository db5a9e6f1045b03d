// Work in processes side by side: all of it is done, and what fails is named and takes nothing else down.
#include "studies/workers.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <map>
#include <set>
#include <stdexcept>

namespace slipstream {
namespace {

struct Outcomes {
  std::map<std::size_t, std::string> lines, errors;
  Workers::Hooks hooks() {
    return {[this](std::size_t item, const std::string& line) { EXPECT_TRUE(lines.emplace(item, line).second) << item; },
            [this](std::size_t item, const std::string& error) { EXPECT_TRUE(errors.emplace(item, error).second) << item; }};
  }
};

Outcomes work_through(std::size_t items, int jobs, const Workers::Work& work) {
  Outcomes outcomes;
  Workers workers(jobs, work, outcomes.hooks());
  for (std::size_t next = 0; next < items || !workers.is_idle();) {
    while (next < items && workers.wanted() > 0) workers.give(next++);
    workers.wait(200);
  }
  return outcomes;
}

TEST(Workers, EveryItemIsDoneOnceWhoeverDoesIt) {
  for (const int jobs : {1, 2, 5}) {
    const Outcomes o = work_through(1000, jobs, [](std::size_t item) { return std::to_string(item * item); });
    EXPECT_TRUE(o.errors.empty());
    ASSERT_EQ(o.lines.size(), 1000U);
    for (const auto& [item, line] : o.lines) EXPECT_EQ(line, std::to_string(item * item));
  }
}

TEST(Workers, LongLinesArriveWhole) {
  const Outcomes o = work_through(20, 2, [](std::size_t item) { return std::string(300'000 + item, 'x'); });
  ASSERT_EQ(o.lines.size(), 20U);
  for (const auto& [item, line] : o.lines) EXPECT_EQ(line.size(), 300'000 + item);
}

TEST(Workers, WhatFailsIsNamedAndTheOthersGoOn) {
  const Outcomes o = work_through(200, 3, [](std::size_t item) -> std::string {
    if (item % 50 == 7) throw std::runtime_error("on\npurpose");
    if (item % 50 == 8) std::raise(SIGSEGV);
    if (item % 50 == 9) ::_exit(3);
    return "well";
  });
  ASSERT_EQ(o.errors.size(), 12U);
  for (const auto& [item, error] : o.errors) {
    const std::size_t kind = item % 50;
    EXPECT_EQ(error, kind == 7   ? "on purpose"
                     : kind == 8 ? "its process was ended by signal 11"
                                 : "its process ended with code 3");
  }
  EXPECT_EQ(o.lines.size(), 188U);
}

// What a process had done and not said yet is done again, not lost, and the right item is blamed.
TEST(Workers, TheItemThatItWasDoingIsToBlame) {
  const Outcomes o = work_through(500, 1, [](std::size_t item) -> std::string {
    if (item == 300) std::raise(SIGKILL);
    return "well";
  });
  ASSERT_EQ(o.errors.size(), 1U);
  EXPECT_EQ(o.errors.begin()->first, 300U);
  EXPECT_EQ(o.errors.begin()->second, "its process was ended by signal 9");
  EXPECT_EQ(o.lines.size(), 499U);
}

// Side by side: as many processes as jobs take part when the items take long.
// A machine without memory for processes may end each as it begins.
bool g_ends_at_once = false;
TEST(Workers, ProcessesThatEndBeforeTheyBeginAreNotStartedForEver) {
  ASSERT_EQ(::pthread_atfork(nullptr, nullptr, [] { g_ends_at_once ? ::_exit(5) : void(); }), 0);
  g_ends_at_once = true;
  const Outcomes o = work_through(4, 2, [](std::size_t) { return std::string("well"); });
  g_ends_at_once = false;
  EXPECT_TRUE(o.lines.empty());
  ASSERT_EQ(o.errors.size(), 4U);
  for (const auto& [item, error] : o.errors) EXPECT_EQ(error, "its process ended with code 5") << item;
}

TEST(Workers, AllTakePart) {
  const Outcomes o = work_through(12, 3, [](std::size_t) {
    ::usleep(30'000);  // longer than what is ordered in advance
    return std::to_string(::getpid());
  });
  std::set<std::string> processes;
  for (const auto& [item, line] : o.lines) processes.insert(line);
  EXPECT_EQ(processes.size(), 3U);
}

}  // namespace
}  // namespace slipstream
