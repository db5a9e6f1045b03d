// Strangers on the bus: messages of another run, and bytes that are no messages. Nobody falls over, no number changes, and what
// could not be used is reported.
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <slipstream/announcement.hpp>
#include <slipstream/control.hpp>
#include <slipstream/drive_torque.hpp>
#include <slipstream/estimate.hpp>
#include <slipstream/progress.hpp>
#include <slipstream/run_descriptor.hpp>
#include <slipstream/tick.hpp>
#include <slipstream/truth.hpp>
#include <slipstream/wheel_speed.hpp>

#include "tests/system/bench.hpp"
#include "tests/system/observer.hpp"

namespace slipstream::test {
namespace {

using Bytes = std::string;

// Datagrams as they are: LCM's short message is its magic number, a packet number, the channel with a NUL, the contents.
class Stranger {
 public:
  explicit Stranger(int port) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    const unsigned char ttl = 0;
    setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_aton("239.255.76.67", &to_.sin_addr);
  }
  ~Stranger() { close(socket_); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  void datagram(const Bytes& bytes) {
    const auto sent = sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_);
    EXPECT_EQ(sent, static_cast<ssize_t>(bytes.size()));
  }
  void message(const std::string& channel, const Bytes& contents) {
    datagram("LC02" + Bytes("\0\0\0\1", 4) + channel + Bytes(1, '\0') + contents);
  }

 private:
  int socket_;
  sockaddr_in to_{};
};

template <typename M>
Bytes encoded(const M& m) {
  Bytes bytes(static_cast<std::size_t>(m.getEncodedSize()), '\0');
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}
template <typename M>
M of_run(std::int64_t run_id, Utime utime) {
  M m{};
  m.utime = utime;
  m.seq = 0;
  m.run_id = run_id;
  return m;
}
Bytes with_count(Bytes message, std::size_t at, std::uint32_t count) {
  for (std::size_t i = 0; i < 4; ++i) message[at + i] = static_cast<char>(count >> (24 - 8 * i));
  return message;
}

const std::vector<std::string> kChannels{"RUN",
                                         "TICK",
                                         "TRUTH",
                                         "ANNOUNCE",
                                         "PROGRESS",
                                         "CONTROL",
                                         "DRIVE_TORQUE",
                                         "SENSOR_WHEEL_SPEED",
                                         "SENSOR_ACCELEROMETER",
                                         "ESTIMATE_ekf",
                                         "ESTIMATE_",
                                         "SOMETHING_ELSE"};

// Plays the short run once alone and once with `disturb` called at every 20th instant, and compares.
void expect_undisturbed(const std::function<void(Stranger&, const Tick&, Observer&)>& disturb,
                        const std::function<void(const Process& plant, const Process& ekf, const Process& monitor)>& look) {
  Bench alone, bench;
  play_short(alone);
  Observer observer(bench.url, "observer");
  Stranger stranger(bench.port);
  observer.at_tick = [&](const Tick& t) {
    if (t.header.utime % 200'000 == 0) disturb(stranger, t, observer);
  };
  Process ekf = bench.estimator({"--once"}), mhe = bench.estimator({"--algorithm", "mhe", "--once"}), monitor = bench.monitor(),
          plant = bench.plant(kShort + Arguments{"--wait-for", "observer,ekf,mhe,monitor"});
  ASSERT_TRUE(observer.until_ended());
  for (Process* p : {&plant, &ekf, &mhe, &monitor}) expect_success(*p);
  EXPECT_FALSE(plant.said("is late")) << plant.out();
  nlohmann::json found = without_times(bench.scores()), expected = without_times(alone.scores());
  for (nlohmann::json* scores : {&found, &expected}) {
    (*scores)["run"].erase("id");  // of the scenario, whose wait_for differs
    (*scores)["run"].erase("rejected");
    for (auto& [name, estimator] : (*scores)["estimators"].items()) estimator.erase("rejected");
  }
  EXPECT_EQ(found, expected);
  look(plant, ekf, monitor);

  // The log has the strangers in it too, and is as good as any.
  const std::string log = bench.path("out/run.lcm");
  Process again = bench.from_log(log, {"--out", bench.path("new.lcm")});
  expect_success(again);
  const std::vector<Estimate> live = estimates_in(log, "ekf"), anew = estimates_in(bench.path("new.lcm"), "ekf");
  std::size_t same = 0;
  for (std::size_t i = 0; i < anew.size(); ++i)
    for (const Estimate& e : live) same += bits(e, false) == bits(anew[i], false) ? 1U : 0U;
  EXPECT_EQ(anew.size(), 301U);
  EXPECT_GE(same, 301U);
}

TEST(Hostile, MessagesOfAnotherRunAreIgnored) {
  expect_undisturbed(
      [](Stranger& stranger, const Tick& t, Observer& observer) {
        const std::int64_t other = observer.run_id + 1;
        const Utime now = t.header.utime;
        auto speed = of_run<wheel_speed>(other, now + 10'000);
        speed.wheel_speed_radps = 1000.0;
        stranger.message("SENSOR_WHEEL_SPEED", encoded(speed));
        auto torque = of_run<drive_torque>(other, now + 10'000);
        torque.drive_torque_nm = 1e6;
        stranger.message("DRIVE_TORQUE", encoded(torque));
        auto end = of_run<tick>(other, now + 1'000'000);
        end.state = 2;
        stranger.message("TICK", encoded(end));
        auto stop = of_run<control>(other, now);
        stop.command = 3;
        stranger.message("CONTROL", encoded(stop));
        auto done = of_run<progress>(other, now + 1'000'000'000);
        done.name = "ekf";
        stranger.message("PROGRESS", encoded(done));
        auto state = of_run<truth>(other, now);
        state.n = 10;
        state.value.assign(10, 7.0);
        stranger.message("TRUTH", encoded(state));
        auto e = of_run<estimate>(other, now);
        e.name = "ekf";
        e.n = 1;
        e.mean = {5.0};
        e.covariance = {{1.0}};
        stranger.message("ESTIMATE_ekf", encoded(e));
        auto ghost = of_run<announcement>(other, now);
        ghost.name = "ghost";
        ghost.role = "estimator";
        stranger.message("ANNOUNCE", encoded(ghost));
      },
      [](const Process& plant, const Process&, const Process& monitor) {
        EXPECT_FALSE(plant.said("ghost")) << plant.out();
        EXPECT_FALSE(monitor.said("ghost joined")) << monitor.out();
      });
}

TEST(Hostile, RandomBytesOnEveryChannelAreReportedAndIgnored) {
  std::mt19937_64 random(12345);
  expect_undisturbed(
      [&](Stranger& stranger, const Tick&, Observer&) {
        for (const std::string& channel : kChannels) {
          stranger.message(channel, "");
          Bytes noise(random() % 200, '\0');
          for (char& c : noise) c = static_cast<char>(random());
          stranger.message(channel, noise);
        }
      },
      [](const Process& plant, const Process& ekf, const Process& monitor) {
        EXPECT_TRUE(plant.said("slipstream-plant: ignored a message on CONTROL: its length does not fit its contents\n"))
            << plant.out();
        EXPECT_TRUE(ekf.said(
            "slipstream-estimator ekf: ignored a message on SENSOR_WHEEL_SPEED: its length does not fit its contents\n"))
            << ekf.out();
        EXPECT_TRUE(monitor.said("unusable message on ")) << monitor.out();
      });
}

TEST(Hostile, DamagedMessagesOfThisRunAreReportedAndIgnored) {
  expect_undisturbed(
      [](Stranger& stranger, const Tick& t, Observer& observer) {
        const std::int64_t run = observer.run_id;
        const Utime now = t.header.utime + 10'000;
        for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
          auto speed = of_run<wheel_speed>(run, now);
          speed.wheel_speed_radps = value;
          stranger.message("SENSOR_WHEEL_SPEED", encoded(speed));
        }
        // The right length, another type's fingerprint.
        stranger.message("SENSOR_ACCELEROMETER", encoded(of_run<wheel_speed>(run, now)));
        stranger.message("TICK", encoded(of_run<control>(run, now)));
        // Cut off, and too long.
        auto state = of_run<truth>(run, now);
        state.n = 10;
        state.value.assign(10, 7.0);
        const Bytes whole = encoded(state);
        for (const std::size_t size : {0U, 7U, 8U, 35U, 36U, 100U}) stranger.message("TRUTH", whole.substr(0, size));
        stranger.message("TRUTH", whole + "and more");
        // Counts that would run out of the message: they stand after the fingerprint and the three header fields.
        for (const std::uint32_t count : {0xffffffffU, 0x80000000U, 0x7fffffffU, 100'000U, 11U}) {
          stranger.message("TRUTH", with_count(whole, 32, count));
          stranger.message("PROGRESS", with_count(encoded(of_run<progress>(run, now)), 32, count));
          stranger.message("ANNOUNCE", with_count(encoded(of_run<announcement>(run, now)), 32, count));
          stranger.message("RUN", with_count(encoded(of_run<run_descriptor>(run + 1, now)), 32, count));
          auto e = of_run<estimate>(run, now);
          e.name = "x";
          stranger.message("ESTIMATE_x", with_count(encoded(e), 39, count));
          stranger.message("ESTIMATE_x", with_count(encoded(e), 43, count));
        }
        // Out of range: a time before the start, an unknown command, state and presence, a name that would leave the folder.
        auto early = of_run<tick>(run, -5);
        stranger.message("TICK", encoded(early));
        auto command = of_run<control>(run, now);
        command.command = 9;
        stranger.message("CONTROL", encoded(command));
        auto evil = of_run<announcement>(run, now);
        evil.name = "../../evil";
        evil.role = "estimator";
        stranger.message("ANNOUNCE", encoded(evil));
        // A run that nobody can follow: its scenario is no scenario.
        auto nonsense = of_run<run_descriptor>(run, now);
        nonsense.name = "nonsense";
        nonsense.clock = "whenever";
        stranger.message("RUN", encoded(nonsense));
      },
      [](const Process& plant, const Process& ekf, const Process& monitor) {
        for (const char* reason : {"CONTROL: the command is unknown", "ANNOUNCE: a participant's name is out of form",
                                   "PROGRESS: its length does not fit its contents"})
          EXPECT_TRUE(plant.said(std::string("ignored a message on ") + reason)) << reason << "\n" << plant.out();
        for (const char* reason :
             {"SENSOR_WHEEL_SPEED: its value is not finite", "SENSOR_ACCELEROMETER: not a message of the channel's type",
              "TICK: utime out of range", "RUN: the clock mode is unknown"})
          EXPECT_TRUE(ekf.said(std::string("ignored a message on ") + reason)) << reason << "\n" << ekf.out();
        EXPECT_TRUE(monitor.said("unusable message on ")) << monitor.out();
      });
}

TEST(Hostile, DatagramsThatAreNotLcmAreIgnored) {
  std::mt19937_64 random(54321);
  expect_undisturbed(
      [&](Stranger& stranger, const Tick&, Observer&) {
        stranger.datagram("");
        stranger.datagram("LC02");
        stranger.datagram("LC02" + Bytes("\0\0\0\1", 4));                    // a header only
        stranger.datagram("LC02" + Bytes("\0\0\0\1", 4) + "TRUTH");          // a channel without an end
        stranger.datagram("LC02" + Bytes("\0\0\0\1", 4) + Bytes(300, 'X'));  // and a long one
        stranger.message("", "no channel");
        stranger.message(std::string(64, 'C'), "one letter too many");
        stranger.message(std::string(1000, 'C'), "far too long");
        stranger.message(std::string(63, 'C'), "just short enough");
        stranger.message("line\nbreak\x1b[2J", "not printable");
        stranger.message("SOMETHING", Bytes(60'000, 'x'));
        // The only part of a message in 60,000 parts of 4 GB, and the second of one.
        stranger.datagram("LC03" + Bytes("\0\0\0\2\xff\xff\xff\xff\0\0\0\0\0\0\xea\x60", 16) + "TRUTH" + Bytes(20, '\0'));
        stranger.datagram("LC03" + Bytes("\0\0\0\3\0\0\0\4\xff\xff\xff\xf0\0\1\0\1", 16) + "TRUTH" + Bytes(20, '\0'));
        Bytes noise(random() % 1000, '\0');
        for (char& c : noise) c = static_cast<char>(random());
        stranger.datagram(noise);
      },
      [](const Process&, const Process&, const Process& monitor) {
        EXPECT_EQ(monitor.out().find('\x1b'), std::string::npos) << "nothing of theirs reaches the terminal";
      });
}

TEST(Hostile, ARunThatCannotBeReadEndsNoEstimator) {
  Bench bench;
  Observer observer(bench.url);
  Process ekf = bench.estimator({"--once"}), mhe = bench.estimator({"--algorithm", "mhe", "--once"});
  ASSERT_TRUE(observer.until([&] { return observer.announcements.size() >= 2; }));
  Stranger stranger(bench.port);
  auto run = of_run<run_descriptor>(4711, 0);
  run.name = "nonsense";
  run.clock = "lockstep";
  run.scenario_toml = "this is = not a scenario";
  for (int i = 0; i < 3; ++i) stranger.message("RUN", encoded(run));
  Process monitor = bench.monitor(), plant = bench.plant(kShort);
  for (Process* p : {&plant, &ekf, &mhe, &monitor}) expect_success(*p);
  EXPECT_TRUE(ekf.said("slipstream-estimator ekf: cannot follow a run: scenario of run nonsense:1:")) << ekf.out();
  EXPECT_EQ(bench.scores()["estimators"]["ekf"]["estimates"], 301);
}

}  // namespace
}  // namespace slipstream::test
