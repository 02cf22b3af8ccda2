#include "vehicle/link/bus.h"

#include <mutex>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <lcm/lcm.h>

#include "vehicle/link/receiver.h"
#include "vehicle/link/udpm_url.h"

namespace dive::link {
namespace {

struct Destroy {
  void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
};

/// Sends packets by LCM, in the order of their numbers. Thread-safe. LCM reads no packet here: it
/// does so only for a subscription of its own.
class Publisher {
 public:
  Publisher(std::unique_ptr<lcm_t, Destroy> lcm, const BusOptions& options, std::uint64_t self)
      : lcm_(std::move(lcm)), key_(options.key), trailer_{options.role, self, 0} {}

  bool publish(const char* channel, const Packet& packet) {
    const std::lock_guard lock(mutex_);
    if (!key_) return send(channel, packet);
    ++trailer_.counter;
    sealed_ = packet;
    seal(*key_, channel, trailer_, sealed_);
    return send(channel, sealed_);
  }

 private:
  bool send(const char* channel, const Packet& packet) {
    return lcm_publish(lcm_.get(), channel, packet.data(), static_cast<unsigned>(packet.size())) ==
           0;
  }

  std::mutex mutex_;
  std::unique_ptr<lcm_t, Destroy> lcm_;
  std::optional<Key> key_;
  Trailer trailer_;
  Packet sealed_;
};

}  // namespace

struct Bus::Impl {
  Impl(std::unique_ptr<lcm_t, Destroy> lcm, const UdpmUrl& url_in, const BusOptions& options,
       std::uint64_t self)
      : url(url_in), publisher(std::move(lcm), options, self), intake(options.key, self) {}

  [[nodiscard]] tl::expected<void, std::string> receive() {
    auto opened = Receiver::open(url, intake, [this](const Presence& presence) {
      Packet packet;
      if (encode(presence, packet)) publisher.publish(channel::kPresence, packet);
    });
    if (!opened) return tl::unexpected(opened.error());
    receiver = std::move(*opened);
    return {};
  }

  void deliver(const Arrival& arrival) {
    sender = arrival.sender;
    if (!handlers[arrival.subscription](arrival.packet)) ++malformed;
  }

  UdpmUrl url;
  Publisher publisher;
  Intake intake;
  std::vector<Handler> handlers;
  Sender sender;
  std::int64_t malformed = 0;
  std::unique_ptr<Receiver> receiver;  // Last: its thread uses the others.
};

Bus::Bus(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bus::Bus(Bus&&) noexcept = default;
Bus& Bus::operator=(Bus&&) noexcept = default;
Bus::~Bus() = default;

tl::expected<Bus, std::string> Bus::open(const std::string& url, const BusOptions& options) {
  tl::expected<UdpmUrl, std::string> parsed = parse_udpm_url(url);
  if (!parsed) return tl::unexpected(parsed.error());
  if (parsed->receive_bytes == 0) parsed->receive_bytes = options.receive_bytes;
  std::unique_ptr<lcm_t, Destroy> lcm(lcm_create(to_lcm(*parsed).c_str()));
  if (lcm == nullptr) {
    return tl::unexpected(
        fmt::format("cannot open the link over '{}': {}", url, multicast_hint(*parsed)));
  }
  auto impl = std::make_unique<Impl>(std::move(lcm), *parsed, options, new_nonce());
  const tl::expected<void, std::string> receives = impl->receive();
  if (!receives) return tl::unexpected(receives.error());
  return Bus(std::move(impl));
}

void Bus::subscribe(const char* channel, std::size_t max_bytes, Handler handler, Access access) {
  impl_->handlers.push_back(std::move(handler));
  impl_->intake.subscribe(channel, max_bytes, access);
}

bool Bus::publish(const char* channel, const Packet& packet) {
  return impl_->publisher.publish(channel, packet);
}

bool Bus::wait(Clock& clock, Utime deadline, const std::function<bool()>& enough) {
  if (enough && enough()) return true;
  ArrivalQueue& queue = impl_->intake.queue();
  for (;;) {
    std::size_t bytes = 0;
    for (int i = 0; i < kMaxPackets && bytes < kMaxBytes; ++i) {
      const std::optional<Arrival> arrival = queue.pop();
      if (!arrival) break;
      bytes += arrival->packet.size();
      impl_->deliver(*arrival);
      if (enough && enough()) return true;
    }
    const Utime left = clock.real(deadline - clock.now());
    if (left <= 0) return false;
    queue.wait(left);
  }
}

const Sender& Bus::sender() const { return impl_->sender; }

bool Bus::has_key() const { return impl_->intake.has_key(); }

std::int64_t Bus::malformed() const { return rejections().malformed; }

Rejections Bus::rejections() const {
  Rejections rejections = impl_->intake.rejections();
  rejections.malformed += impl_->malformed;
  return rejections;
}

}  // namespace dive::link
