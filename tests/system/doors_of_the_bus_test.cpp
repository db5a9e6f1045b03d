// Refusals that need a network, or the lack of one.
#include <gtest/gtest.h>

#include "tests/system/doors.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

TEST(Doors, NoMulticastRoute) {
  Bench bench;
  const Arguments namespaced{"unshare", "-r", "--net"};
  Process probe = bench.run(namespaced + Arguments{"true"});
  if (probe.wait() != 0) GTEST_SKIP() << "cannot make a network namespace here: " << probe.err();
  const std::string line = "cannot open '" + bench.url +
                           "': no multicast route, or multicast is blocked; on one machine this helps: ip link set lo up; "
                           "ip route add 224.0.0.0/4 dev lo\n";
  EXPECT_EQ(refused_line(bench, namespaced + Arguments{Bench::program("plant"), kUnimog, "--lcm-url", bench.url}),
            "slipstream-plant: " + line);
  EXPECT_EQ(refused_line(bench, namespaced + Arguments{Bench::program("estimator"), "--lcm-url", bench.url}),
            "slipstream-estimator: " + line);
  EXPECT_EQ(refused_line(bench, namespaced + Arguments{Bench::program("monitor"), "--lcm-url", bench.url, "--out", "out"}),
            "slipstream-monitor: " + line);
}

TEST(Doors, NobodyComes) {
  Bench bench;
  Process ekf = bench.estimator({});
  Process plant = bench.plant(kShort + Arguments{"--set", "run.start_timeout_s=1"});
  EXPECT_EQ(plant.wait(), 1);
  EXPECT_EQ(plant.err(),
            "slipstream-plant: after 1 s nobody has announced itself as 'mhe', 'monitor'; start it, or choose others with "
            "--wait-for\n");
}

TEST(Doors, ATuningThatTheScenarioDoesNotHave) {
  Bench bench;
  Observer observer(bench.url);
  Process ekf = bench.estimator({"--tuning", "best"}), plant = bench.plant(kShort);
  EXPECT_EQ(ekf.wait(), 1);
  EXPECT_EQ(ekf.err(), "slipstream-estimator: unknown tuning 'best'; scenario 'unimog' has: document, matched\n");
  plant.signal(SIGTERM);
  EXPECT_EQ(plant.wait(), 0) << "an interrupt ends its waiting in order";
}

TEST(Doors, NoRunWasSeen) {
  Bench bench;
  Observer observer(bench.url);
  Process monitor = bench.monitor();
  ASSERT_TRUE(observer.until([&] { return !observer.announcements.empty(); }));
  monitor.signal(SIGINT);
  EXPECT_EQ(monitor.wait(), 1);
  EXPECT_EQ(monitor.err(), "slipstream-monitor: stopped before any run was seen; nothing is written\n");
  EXPECT_FALSE(std::filesystem::exists(bench.path("out")));
}

}  // namespace
}  // namespace slipstream::test
