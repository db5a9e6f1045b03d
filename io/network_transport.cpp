#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <lcm/lcm-cpp.hpp>
#include <regex>
#include <utility>

#include "common/refusal.hpp"
#include "io/transport.hpp"

namespace slipstream {

namespace {

constexpr int kDrainAtMost = 4096;                   // messages a poll, so that a flood cannot hold the caller
constexpr std::uint32_t kLargestMessage = 1U << 28;  // that LCM puts together from fragments

bool is_usable(const std::string& url) {
  static const std::regex form(R"(udpm://(\d{1,3}\.\d{1,3}\.\d{1,3}\.\d{1,3})(:(\d{1,5}))?(\?[A-Za-z0-9_=&]*)?)");
  std::smatch part;
  in_addr group{};
  if (!std::regex_match(url, part, form) || inet_pton(AF_INET, part[1].str().c_str(), &group) != 1) return false;
  const int port = part[3].matched ? std::stoi(part[3].str()) : 1;
  std::string options = part[4].str();
  for (const char* known : {"ttl=(25[0-5]|2[0-4][0-9]|[01]?[0-9]?[0-9])", "recv_buf_size=[0-9]{1,9}"})
    options = std::regex_replace(options, std::regex(std::string("[?&]") + known + "(?=&|$)"), "",
                                 std::regex_constants::format_first_only);
  if (!options.empty() && options != "?") return false;
  return IN_MULTICAST(ntohl(group.s_addr)) && port >= 1 && port <= 65535;
}

// LCM prints its own lines when it cannot start; ours says what to do about it.
class QuietStderr {
 public:
  QuietStderr() : saved_(dup(STDERR_FILENO)) {
    const int null = open("/dev/null", O_WRONLY);
    if (null < 0) return;
    dup2(null, STDERR_FILENO);
    close(null);
  }
  ~QuietStderr() {
    if (saved_ < 0) return;
    dup2(saved_, STDERR_FILENO);
    close(saved_);
  }
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  int saved_;
};

class NetworkTransport final : public Transport {
 public:
  explicit NetworkTransport(const std::string& url) : url_(url) {
    if (!is_usable(url))
      throw Refusal(
          fmt::format("--lcm-url: cannot use '{}'; expected udpm://GROUP:PORT?ttl=N (e.g. udpm://239.255.76.67:7667?ttl=0) "
                      "or file://LOG?speed=0",
                      url));
    std::string full = url;
    if (url.find("recv_buf_size") == std::string::npos)
      full += (url.find('?') == std::string::npos ? "?" : "&") + std::string("recv_buf_size=4194304");
    if (url.find("ttl=") == std::string::npos) full += "&ttl=0";  // stay on this host
    const QuietStderr quiet;
    lcm_ = std::make_unique<lcm::LCM>(full);
    if (!lcm_->good()) throw no_route();
  }

  void subscribe(const std::vector<std::string>& channels, RawHandler handler) override {
    handler_ = std::move(handler);
    for (const std::string& c : channels) {
      const QuietStderr quiet;
      lcm::Subscription* s = lcm_->subscribeFunction(c, &NetworkTransport::on_message, this);
      if (s == nullptr || lcm_->getFileno() < 0) throw no_route();
      s->setQueueCapacity(0);  // unlimited: LCM's default drops the newest silently
    }
  }

  bool poll(int timeout_ms) override {
    int handled = lcm_->handleTimeout(timeout_ms);
    for (int i = 0; handled > 0 && i < kDrainAtMost; ++i) {
      rethrow();
      handled = lcm_->handleTimeout(0);
    }
    rethrow();
    if (handled < 0 && errno != EINTR) throw std::runtime_error(fmt::format("the LCM network {} failed", url_));
    return true;
  }

  void publish(const std::string& channel, const void* data, std::size_t size) override {
    if (lcm_->publish(channel, data, static_cast<unsigned int>(size)) != 0)
      throw std::runtime_error(fmt::format("cannot publish on {} to {}", channel, url_));
  }

 private:
  Refusal no_route() const {
    return Refusal(fmt::format(
        "cannot open '{}': no multicast route, or multicast is blocked; on one machine this helps: ip link set lo up; "
        "ip route add 224.0.0.0/4 dev lo",
        url_));
  }
  // Exceptions must not cross LCM's C code.
  static void on_message(const lcm::ReceiveBuffer* b, const std::string& channel, NetworkTransport* self) {
    // A packet that ends before or within its channel comes with a size that has wrapped below zero.
    if (channel.empty() || b->data_size > kLargestMessage) return;
    try {
      self->handler_(channel, b->recv_utime, b->data, b->data_size);
    } catch (...) {
      if (!self->error_) self->error_ = std::current_exception();
    }
  }
  void rethrow() {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  }

  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
  RawHandler handler_;
  std::exception_ptr error_;
};

}  // namespace

std::unique_ptr<Transport> open_network(const std::string& url) { return std::make_unique<NetworkTransport>(url); }

}  // namespace slipstream
