#include "plant/participants.hpp"

#include <gtest/gtest.h>

namespace slipstream {
namespace {

constexpr std::int64_t kRun = 42;
using Names = std::vector<std::string>;

Announcement announcement(const std::string& name, Presence presence = Presence::kJoined, std::int64_t run_id = kRun) {
  Announcement a;
  a.header.run_id = run_id;
  a.name = name;
  a.presence = presence;
  return a;
}
Progress progress(const std::string& name, Utime utime, std::int64_t run_id = kRun) { return {{utime, 0, run_id}, name}; }

TEST(Participants, CountsOnlyWhoKnowsThisRun) {
  Participants p(kRun);
  EXPECT_TRUE(p.empty());
  EXPECT_TRUE(p.on_announcement(announcement("ekf", Presence::kJoined, 0))) << "needs the descriptor";
  // Who follows another plant gets no descriptor for it: two plants on one bus would answer each other for ever.
  EXPECT_FALSE(p.on_announcement(announcement("ekf", Presence::kAlive, kRun - 1)));
  EXPECT_FALSE(p.contains("ekf"));
  EXPECT_FALSE(p.on_announcement(announcement("ekf")));
  EXPECT_TRUE(p.contains("ekf"));
  EXPECT_FALSE(p.empty());
}

TEST(Participants, IsLateUntilItHasProcessedTheTick) {
  Participants p(kRun);
  p.on_announcement(announcement("ekf"));
  p.on_announcement(announcement("mhe"));
  p.on_tick(0);
  EXPECT_EQ(p.late(0), (Names{"ekf", "mhe"}));
  p.on_progress(progress("mhe", 0));
  EXPECT_EQ(p.late(0), (Names{"ekf"}));
  p.on_progress(progress("ekf", 10));
  EXPECT_EQ(p.late(0), (Names{}));
  EXPECT_EQ(p.late(10), (Names{"mhe"}));
  p.on_progress(progress("ekf", 5));  // an old message does not take anything back
  EXPECT_EQ(p.processed("ekf"), 10);
}

TEST(Participants, ProgressOfOthersAndOfOtherRunsDoesNotCount) {
  Participants p(kRun);
  p.on_announcement(announcement("ekf"));
  p.on_progress(progress("ekf", 10, kRun + 1));
  EXPECT_EQ(p.late(0), (Names{"ekf"}));
  p.on_progress(progress("nobody", 10));
  EXPECT_FALSE(p.contains("nobody"));
}

TEST(Participants, LeavesAndIsDroppedAndComesBackFromThere) {
  Participants p(kRun);
  p.on_announcement(announcement("ekf"));
  p.on_tick(100);
  EXPECT_FALSE(p.on_announcement(announcement("ekf", Presence::kLeft)));
  EXPECT_FALSE(p.contains("ekf"));
  EXPECT_EQ(p.late(100), (Names{}));
  p.on_announcement(announcement("ekf"));
  p.drop("ekf");
  EXPECT_FALSE(p.contains("ekf"));
  p.on_announcement(announcement("ekf", Presence::kAlive));
  EXPECT_EQ(p.late(100), (Names{})) << "does not answer for what was before it came back";
  EXPECT_EQ(p.late(200), (Names{"ekf"})) << "but for all that comes";
}

TEST(Participants, ASignOfLifeOfAMemberChangesNothing) {
  Participants p(kRun);
  p.on_announcement(announcement("ekf"));
  p.on_tick(100);
  p.on_announcement(announcement("ekf", Presence::kAlive));
  EXPECT_EQ(p.late(100), (Names{"ekf"})) << "being alive is not having processed";
}

// A member that leaves by another run's farewell is still gone: its process is.
TEST(Participants, FarewellsCountWhateverTheirRun) {
  Participants p(kRun);
  p.on_announcement(announcement("ekf"));
  p.on_announcement(announcement("ekf", Presence::kLeft, 0));
  EXPECT_FALSE(p.contains("ekf"));
}

}  // namespace
}  // namespace slipstream
