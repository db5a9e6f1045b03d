// slipstream-study-mpi: whatever the ranks and hosts, the results are those of one process, to the bit. Skipped where MPI, or
// the right to make network namespaces, is missing.
#include <unistd.h>

#include "tests/system/studies.hpp"

namespace slipstream::test {
namespace {

bool has_program(const std::string& name) { return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0; }
bool has_mpi() { return std::filesystem::exists(Bench::program("study-mpi")) && has_program("mpirun"); }

// As root too, and with more ranks than processors.
Arguments mpirun(int ranks) {
  return {"mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", std::to_string(ranks)};
}

std::string whole(Bench& bench, const std::string& file) {
  Process p = bench.run({Bench::program("study"), file, "--out", bench.path("whole")});
  expect_success(p);
  return results_of(bench, "whole");
}

TEST(StudyMpi, AnyNumberOfRanks) {
  if (!has_mpi()) GTEST_SKIP() << "no MPI: libopenmpi-dev, openmpi-bin";
  Bench bench;
  const std::string file = write_study(bench, 100), results = whole(bench, file);
  for (const int ranks : {1, 2, 3}) {
    const std::string out = "ranks-" + std::to_string(ranks);
    Process p = bench.run(mpirun(ranks) + Arguments{Bench::program("study-mpi"), file, "--out", bench.path(out)});
    expect_success(p);
    EXPECT_TRUE(p.said(std::to_string(ranks) + (ranks == 1 ? " rank" : " ranks"))) << p.out();
    EXPECT_EQ(results_of(bench, out), results) << ranks;
  }
}

TEST(StudyMpi, KilledAndResumedWithOtherRanks) {
  if (!has_mpi()) GTEST_SKIP() << "no MPI: libopenmpi-dev, openmpi-bin";
  Bench bench;
  const std::string file = write_study(bench, 3000), out = bench.path("out"), results = whole(bench, file);
  for (const int ranks : {2, 3}) {
    Process p = bench.run(mpirun(ranks) + Arguments{Bench::program("study-mpi"), file, "--out", out});
    ASSERT_TRUE(begun(out));
    // Of an earlier round there are runs already: wait for this one's ranks.
    std::vector<pid_t> all;
    for (int tries = 0; tries < 500 && all.empty(); ++tries) {
      all = children_named("slipstream-study-mpi", out);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_FALSE(all.empty());
    for (const pid_t pid : all) ::kill(pid, SIGKILL);
    EXPECT_NE(p.wait(), 0);
    EXPECT_EQ(survivors(out), "");
  }
  Process p = bench.run(mpirun(2) + Arguments{Bench::program("study-mpi"), file, "--out", out});
  expect_success(p);
  EXPECT_TRUE(p.said(" of 3000 are finished already"));
  EXPECT_EQ(results_of(bench, "out"), results);
}

TEST(StudyMpi, ARefusalEndsAllRanks) {
  if (!has_mpi()) GTEST_SKIP() << "no MPI: libopenmpi-dev, openmpi-bin";
  Bench bench;
  const std::string file = write_study(bench, 3, "[grid]\n");
  Process p = bench.run(mpirun(3) + Arguments{Bench::program("study-mpi"), file, "--out", bench.path("out")});
  EXPECT_NE(p.wait(), 0);
  const std::string line = "slipstream-study-mpi: " + file +
                           ":8:1: grid: an empty grid; expected keys of the scenarios with lists of values, or no [grid]\n";
  const std::size_t at = p.err().find(line);
  EXPECT_NE(at, std::string::npos) << p.err();
  EXPECT_EQ(p.err().find("slipstream-study-mpi", at + line.size()), p.err().find("slipstream-study-mpi (", at + line.size()));
  EXPECT_FALSE(std::filesystem::exists(bench.path("out")));
}

// Two network namespaces joined by a veth pair stand for two hosts. They go away with this object.
class TwoHosts {
 public:
  TwoHosts() {
    const std::string a = name("a"), b = name("b"), va = "va" + id(), vb = "vb" + id();
    made_ = run("ip netns add " + a) && run("ip netns add " + b) &&
            run("ip link add " + va + " netns " + a + " type veth peer name " + vb + " netns " + b) &&
            run("ip -n " + a + " addr add 10.91.7.1/24 dev " + va) && run("ip -n " + b + " addr add 10.91.7.2/24 dev " + vb) &&
            run("ip -n " + a + " link set lo up") && run("ip -n " + b + " link set lo up") &&
            run("ip -n " + a + " link set " + va + " up") && run("ip -n " + b + " link set " + vb + " up");
  }
  ~TwoHosts() {
    run("ip netns del " + name("a"));
    run("ip netns del " + name("b"));
  }
  bool made() const { return made_; }
  static std::string name(const char* host) { return "slipstream-" + id() + "-" + host; }

 private:
  static std::string id() { return std::to_string(getpid()); }
  static bool run(const std::string& command) { return std::system((command + " >/dev/null 2>&1").c_str()) == 0; }
  bool made_ = false;
};

TEST(StudyMpi, TwoHostsThatShareNothingButANetwork) {
  if (!has_mpi()) GTEST_SKIP() << "no MPI: libopenmpi-dev, openmpi-bin";
  Bench bench;
  const TwoHosts hosts;
  if (!hosts.made()) GTEST_SKIP() << "network namespaces are not allowed here";
  const std::string file = write_study(bench, 100), results = whole(bench, file), marks = bench.path("came");
  // mpirun asks this for a shell on the other host, as it would ask ssh: HOST COMMAND ...
  const std::string agent =
      bench.folder.write("agent", "#!/bin/sh\necho \"$1\" >>" + marks + "\nshift\nexec ip netns exec " + TwoHosts::name("b") +
                                      " unshare --uts sh -c 'hostname other-host; exec sh -c \"$1\"' sh \"$*\"\n");
  std::filesystem::permissions(agent, std::filesystem::perms::owner_all);
  const Arguments network{"--mca",
                          "plm_rsh_agent",
                          agent,
                          "--mca",
                          "oob_tcp_if_include",
                          "10.91.7.0/24",
                          "--mca",
                          "btl",
                          "tcp,self",
                          "--mca",
                          "btl_tcp_if_include",
                          "10.91.7.0/24",
                          "--host",
                          "10.91.7.1:1,10.91.7.2:1"};
  Process p = bench.run(Arguments{"ip", "netns", "exec", TwoHosts::name("a")} + mpirun(2) + network +
                        Arguments{Bench::program("study-mpi"), file, "--out", bench.path("out")});
  EXPECT_EQ(p.wait(40.0), 0) << p.out() << p.err();
  EXPECT_EQ(text_of(marks), "10.91.7.2\n");
  EXPECT_EQ(results_of(bench, "out"), results);
}

}  // namespace
}  // namespace slipstream::test
