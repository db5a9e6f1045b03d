#include "io/bus.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "common/readings.hpp"
#include "common/refusal.hpp"
#include "io/layout.hpp"
#include "io/translate.hpp"
#include "io/transport.hpp"

namespace slipstream {

namespace {

// Inputs and sensors: one number each, or the components of common/readings.hpp. A new one is one line in kReadingChannels.
struct ReadingChannel {
  const char* channel;
  std::string_view quantity;
  const char* layout;
  Values (*decode)(const void* data, int size, Header& header);
  std::vector<std::uint8_t> (*encode)(const Header& header, const Values& value);
};

template <typename M>
M decoded(const void* data, int size) {
  M m{};
  wire::require(m.decode(data, 0, size) >= 0, "not a message of the channel's type");
  return m;
}
template <typename M>
std::vector<std::uint8_t> encoded(const M& m) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}
// `Fields` gives the places of a message's numbers, in the order of the components.
template <typename M, auto Fields>
constexpr ReadingChannel reading(const char* channel, std::string_view quantity, const char* layout) {
  return {channel, quantity, layout,
          [](const void* data, int size, Header& header) {
            M m = decoded<M>(data, size);
            header = wire::header_of(m);
            std::array<double, std::tuple_size_v<decltype(Fields(m))>> value;
            std::ranges::transform(Fields(m), value.begin(), [](const double* from) { return *from; });
            return Values(std::span<const double>(value));
          },
          [](const Header& header, const Values& value) {
            M m = wire::with_header<M>(header);
            const auto fields = Fields(m);
            for (std::size_t i = 0; i < fields.size(); ++i) *fields[i] = value[i];
            return encoded(m);
          }};
}
template <typename M, double M::*Field>
constexpr ReadingChannel scalar(const char* channel, std::string_view quantity) {
  return reading<M, [](M& m) { return std::array{&(m.*Field)}; }>(channel, quantity, "qqqd");
}

constexpr std::array kReadingChannels{
    scalar<slipstream::drive_torque, &slipstream::drive_torque::drive_torque_nm>("DRIVE_TORQUE", "drive_torque_nm"),
    scalar<slipstream::wheel_speed, &slipstream::wheel_speed::wheel_speed_radps>("SENSOR_WHEEL_SPEED", "wheel_speed_radps"),
    scalar<slipstream::accelerometer, &slipstream::accelerometer::a_x_mps2>("SENSOR_ACCELEROMETER", "a_x_mps2"),
    scalar<slipstream::steering_angle, &slipstream::steering_angle::steering_angle_rad>("STEERING_ANGLE", "steering_angle_rad"),
    scalar<slipstream::yaw_rate, &slipstream::yaw_rate::yaw_rate_radps>("SENSOR_YAW_RATE", "yaw_rate_radps"),
    scalar<slipstream::lateral_accelerometer, &slipstream::lateral_accelerometer::a_y_mps2>("SENSOR_LATERAL_ACCELEROMETER",
                                                                                            "a_y_mps2"),
    scalar<slipstream::motor_current, &slipstream::motor_current::motor_current_a>("SENSOR_MOTOR_CURRENT", "motor_current_a"),
    scalar<slipstream::forward_speed, &slipstream::forward_speed::forward_speed_mps>("SENSOR_FORWARD_SPEED",
                                                                                     "forward_speed_mps"),
    scalar<slipstream::east_position, &slipstream::east_position::east_m>("SENSOR_EAST_POSITION", "east_m"),
    scalar<slipstream::north_position, &slipstream::north_position::north_m>("SENSOR_NORTH_POSITION", "north_m"),
    scalar<slipstream::accelerator, &slipstream::accelerator::accelerator>("ACCELERATOR", "accelerator"),
    reading<slipstream::imu,
            [](slipstream::imu& m) {
              return std::array{&m.f_mps2[0], &m.f_mps2[1], &m.f_mps2[2], &m.w_radps[0], &m.w_radps[1], &m.w_radps[2]};
            }>("SENSOR_IMU", kImu, "qqqdddddd"),
    reading<slipstream::gnss,
            [](slipstream::gnss& m) {
              return std::array{&m.latitude_deg, &m.longitude_deg, &m.height_m};
            }>("SENSOR_GNSS", kGnss, "qqqddd"),
    reading<slipstream::lidar,
            [](slipstream::lidar& m) {
              return std::array{&m.position_m[0], &m.position_m[1], &m.position_m[2]};
            }>("SENSOR_LIDAR", kLidar, "qqqddd"),
};

constexpr const char* kEstimatePrefix = "ESTIMATE_";

}  // namespace

bool is_valid_name(const std::string& name) { return wire::all_of(name, 32, "_-"); }

std::int64_t process_instance() {
  using namespace std::chrono;
  const std::int64_t now_us = duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
  return (now_us << 8) ^ ::getpid();
}

struct Bus::Impl {
  std::unique_ptr<Transport> transport;
  Handlers handlers;

  // Everything thrown by the checks becomes a rejection; what a handler throws goes through.
  void on_message(const std::string& channel, std::int64_t wall_utime, const void* data, std::size_t size) {
    if (handlers.raw) handlers.raw(channel, wall_utime, data, size);
    std::function<void()> call;
    try {
      call = checked(channel, data, size);
    } catch (const std::exception& e) {
      if (handlers.rejected) handlers.rejected(channel, e.what());
      return;
    }
    if (call) call();
  }

  template <typename M, typename Handler>
  std::function<void()> checked_as(const void* data, std::size_t size, const char* layout, const Handler& handler) {
    if (!handler) return {};
    wire::require(fits_layout(data, size, layout), "its length does not fit its contents");
    return [message = wire::from_wire(decoded<M>(data, static_cast<int>(size))), &handler] { handler(message); };
  }

  std::function<void()> checked(const std::string& channel, const void* data, std::size_t size) {
    if (channel == "RUN") return checked_as<slipstream::run_descriptor>(data, size, "qqqsssnSS", handlers.run);
    if (channel == "TICK") return checked_as<slipstream::tick>(data, size, "qqqb", handlers.tick);
    if (channel == "TRUTH") return checked_as<slipstream::truth>(data, size, "qqqnD", handlers.truth);
    if (channel == "ANNOUNCE") return checked_as<slipstream::announcement>(data, size, "qqqsssssnSSbq", handlers.announcement);
    if (channel == "PROGRESS") return checked_as<slipstream::progress>(data, size, "qqqs", handlers.progress);
    if (channel == "CONTROL") return checked_as<slipstream::control>(data, size, "qqqb", handlers.control);
    if (channel.rfind(kEstimatePrefix, 0) == 0)
      return checked_as<slipstream::estimate>(data, size, "qqqsbnDMnDDnSDMBddqq", handlers.estimate);
    if (!handlers.reading) return {};
    for (const ReadingChannel& c : kReadingChannels) {
      if (channel != c.channel) continue;
      wire::require(fits_layout(data, size, c.layout), "its length does not fit its contents");
      Reading reading;
      reading.quantity = c.quantity;
      reading.value = c.decode(data, static_cast<int>(size), reading.header);
      if (const char* problem = problem_of(reading.quantity, reading.value)) wire::require(false, problem);
      return [this, reading] { handlers.reading(reading); };
    }
    return {};
  }

  template <typename M>
  void send(const std::string& channel, const M& message) {
    const std::vector<std::uint8_t> bytes = encoded(wire::to_wire(message));
    transport->publish(channel, bytes.data(), bytes.size());
  }
};

Bus::Bus(const std::string& lcm_url, const std::string& log_out) : impl_(std::make_unique<Impl>()) {
  const bool is_log = lcm_url.rfind("file://", 0) == 0;
  if (!log_out.empty() && !is_log) throw Refusal("--out: goes with a log: --lcm-url 'file://LOG?speed=0'");
  impl_->transport = is_log ? open_log(lcm_url, log_out) : open_network(lcm_url);
}

Bus::Bus(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bus Bus::new_log(const std::string& path) {
  auto impl = std::make_unique<Impl>();
  impl->transport = open_new_log(path);
  return Bus(std::move(impl));
}
Bus::Bus(Bus&&) noexcept = default;
Bus::~Bus() = default;

void Bus::subscribe(Handlers handlers) {
  Impl& s = *impl_;
  s.handlers = std::move(handlers);
  std::vector<std::string> channels;
  const Handlers& h = s.handlers;
  if (h.raw) {
    channels = {".*"};
  } else {
    if (h.run) channels.emplace_back("RUN");
    if (h.tick) channels.emplace_back("TICK");
    if (h.truth) channels.emplace_back("TRUTH");
    if (h.announcement) channels.emplace_back("ANNOUNCE");
    if (h.progress) channels.emplace_back("PROGRESS");
    if (h.control) channels.emplace_back("CONTROL");
    if (h.estimate) channels.emplace_back(std::string(kEstimatePrefix) + ".*");
    if (h.reading)
      for (const ReadingChannel& c : kReadingChannels) channels.emplace_back(c.channel);
  }
  s.transport->subscribe(channels, [&s](const std::string& channel, std::int64_t wall_utime, const void* data,
                                        std::size_t size) { s.on_message(channel, wall_utime, data, size); });
}

void Bus::complete() { impl_->transport->complete(); }

bool Bus::poll(int timeout_ms) { return impl_->transport->poll(timeout_ms); }

void Bus::publish_raw(const std::string& channel, const void* data, std::size_t size) {
  impl_->transport->publish(channel, data, size);
}
void Bus::at(std::int64_t utime) { impl_->transport->at(utime); }

void Bus::publish(const RunDescriptor& m) { impl_->send("RUN", m); }
void Bus::publish(const Truth& m) { impl_->send("TRUTH", m); }
void Bus::publish(const Tick& m) { impl_->send("TICK", m); }
void Bus::publish(const Estimate& m) { impl_->send(kEstimatePrefix + m.name, m); }
void Bus::publish(const Announcement& m) { impl_->send("ANNOUNCE", m); }
void Bus::publish(const Progress& m) { impl_->send("PROGRESS", m); }
void Bus::publish(const Control& m) { impl_->send("CONTROL", m); }
void Bus::publish(const Reading& m) {
  for (const ReadingChannel& s : kReadingChannels) {
    if (m.quantity != s.quantity) continue;
    const std::vector<std::uint8_t> bytes = s.encode(m.header, m.value);
    impl_->transport->publish(s.channel, bytes.data(), bytes.size());
    return;
  }
  throw std::logic_error(fmt::format("no channel carries '{}'", m.quantity));
}

}  // namespace slipstream
