#include "vehicle/link/bus.h"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <exception>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <lcm/lcm.h>
#include <poll.h>

namespace dive::link {
namespace {

// Maximum number of queued packets per channel; LCM's own limit is 30. Few for packets with lists,
// so that a flood does not fill the memory.
constexpr int kQueue = 500;
constexpr int kListQueue = 16;

struct Subscription {
  std::size_t max_bytes = 0;
  Bus::Handler handler;
  std::size_t bytes = 0;  ///< Bytes delivered.
  std::int64_t malformed = 0;
  std::exception_ptr thrown;
};

std::string with_buffer(const std::string& url, int receive_bytes) {
  constexpr const char* kOption = "recv_buf_size";
  const bool is_udp = url.starts_with("udpm:");
  if (receive_bytes == 0 || !is_udp || url.find(kOption) != std::string::npos) return url;
  const char joint = url.find('?') == std::string::npos ? '?' : '&';
  return fmt::format("{}{}{}={}", url, joint, kOption, receive_bytes);
}

// Called by LCM, which is C: no exception may pass through it.
void receive(const lcm_recv_buf_t* buffer, const char* /*channel*/, void* user) {
  auto* subscription = static_cast<Subscription*>(user);
  subscription->bytes += buffer->data_size;
  if (buffer->data_size > subscription->max_bytes) {
    ++subscription->malformed;
    return;
  }
  try {
    if (!subscription->handler({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size}))
      ++subscription->malformed;
  } catch (...) {
    subscription->thrown = std::current_exception();
  }
}

}  // namespace

struct Bus::Impl {
  struct Destroy {
    void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  };

  /// Delivers one packet, if there is one.
  bool hand_on() {
    if (lcm_handle_timeout(lcm.get(), 0) <= 0) return false;
    for (const auto& subscription : subscriptions) {
      if (subscription->thrown) {
        std::rethrow_exception(std::exchange(subscription->thrown, nullptr));
      }
    }
    return true;
  }

  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& subscription : subscriptions) sum += subscription->bytes;
    return sum;
  }

  std::vector<std::unique_ptr<Subscription>> subscriptions;  // LCM stores their addresses.
  std::unique_ptr<lcm_t, Destroy> lcm;
};

Bus::Bus(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bus::Bus(Bus&&) noexcept = default;
Bus& Bus::operator=(Bus&&) noexcept = default;
Bus::~Bus() = default;

tl::expected<Bus, std::string> Bus::open(const std::string& url, int receive_bytes) {
  auto impl = std::make_unique<Impl>();
  impl->lcm.reset(lcm_create(with_buffer(url, receive_bytes).c_str()));
  if (impl->lcm == nullptr) {
    return tl::unexpected(
        fmt::format("no link over '{}': is it an LCM URL such as {}, and is multicast routed?", url,
                    kDefaultUrl));
  }
  return Bus(std::move(impl));
}

void Bus::subscribe(const char* channel, std::size_t max_bytes, Handler handler) {
  impl_->subscriptions.push_back(std::make_unique<Subscription>());
  Subscription* subscription = impl_->subscriptions.back().get();
  subscription->max_bytes = max_bytes;
  subscription->handler = std::move(handler);
  lcm_subscription_t* with_lcm = lcm_subscribe(impl_->lcm.get(), channel, receive, subscription);
  lcm_subscription_set_queue_capacity(with_lcm, max_bytes > kMaxFixedSize ? kListQueue : kQueue);
}

bool Bus::publish(const char* channel, const Packet& packet) {
  return lcm_publish(impl_->lcm.get(), channel, packet.data(),
                     static_cast<unsigned>(packet.size())) == 0;
}

bool Bus::wait(Clock& clock, Utime deadline, const std::function<bool()>& enough) {
  const int descriptor = lcm_get_fileno(impl_->lcm.get());
  for (;;) {
    const std::size_t most = impl_->bytes() + kMaxBytes;
    for (int i = 0; i < kMaxPackets && impl_->bytes() < most && impl_->hand_on(); ++i) {
      if (enough && enough()) return true;
    }
    const Utime left = clock.real(deadline - clock.now());
    if (left <= 0) return false;
    pollfd readable{descriptor, POLLIN, 0};
    const timespec timeout{left / kMicrosecondsPerSecond, (left % kMicrosecondsPerSecond) * 1000};
    ::ppoll(&readable, 1, &timeout, nullptr);  // a signal or an error only shortens the wait
  }
}

std::int64_t Bus::malformed() const {
  std::int64_t count = 0;
  for (const auto& subscription : impl_->subscriptions) count += subscription->malformed;
  return count;
}

}  // namespace dive::link
