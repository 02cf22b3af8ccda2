#pragma once
// Packets to and from other processes over LCM (UDP multicast): every subscriber of a channel
// receives its packets, perhaps late, twice, out of order or not at all.
//
// With a key all packets are authenticated: a subscriber receives only what a process with the same
// key, and of the channel's role, has just sent, and nothing twice or out of order
// (doc/decisions/authentic-packets.md).

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <tl/expected.hpp>

#include "common/clock.h"
#include "vehicle/link/arrival_queue.h"
#include "vehicle/link/channels.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/envelope.h"
#include "vehicle/link/intake.h"
#include "vehicle/link/key.h"

namespace dive::link {

/// Loopback only: packets leave the machine only with a URL of a larger ttl.
inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0";

struct BusOptions {
  std::optional<Key> key = std::nullopt;
  Role role = Role::kObserver;  ///< With a key: which channels it may publish on.
  /// Size of the system's receive buffer, bytes, unless the URL sets it; 0: 4 MB. The system may
  /// grant less.
  int receive_bytes = 0;
};

/// Not thread-safe: one per thread.
class Bus {
 public:
  /// False if the packet does not belong to the channel.
  using Handler = std::function<bool(PacketView)>;

  /// Fails with a sentence if the URL is not one of udpm_url.h or there is no network. With `ttl=0`
  /// packets of other machines are ignored.
  [[nodiscard]] static tl::expected<Bus, std::string> open(const std::string& url,
                                                           const BusOptions& options = {});
  Bus(Bus&&) noexcept;
  Bus& operator=(Bus&&) noexcept;
  ~Bus();

  /// `handler` gets every packet of the channel of at most `max_bytes`; larger ones are counted.
  /// Its exceptions leave through wait().
  void subscribe(const char* channel, std::size_t max_bytes, Handler handler,
                 Access access = Access::kAuthentic);

  /// The same for decoded values.
  template <typename Value>
  void listen(const char* channel, std::function<void(const Value&)> handler,
              std::size_t max_bytes = kMaxFixedSize, Access access = Access::kAuthentic) {
    const auto decoded = [handler = std::move(handler)](PacketView packet) {
      Value value;
      const bool is_one = decode(packet, value);
      if (is_one) handler(value);
      return is_one;
    };
    subscribe(channel, max_bytes, decoded, access);
  }

  /// While a handler runs: who sent its packet.
  [[nodiscard]] const Sender& sender() const;

  /// False if the system did not accept the packet.
  bool publish(const char* channel, const Packet& packet);

  /// Delivers the packets that have arrived and those that arrive until `deadline` of `clock`;
  /// returns true early once `enough` does (called first, and after every packet). Delivers at most
  /// kMaxPackets and about kMaxBytes of the backlog, so that a flood does not block the caller.
  bool wait(Clock& clock, Utime deadline, const std::function<bool()>& enough = nullptr);

  [[nodiscard]] bool has_key() const;
  /// Packets that were too large for their channel, or did not belong to it.
  [[nodiscard]] std::int64_t malformed() const;
  /// `malformed` as above.
  [[nodiscard]] Rejections rejections() const;

  static constexpr int kMaxPackets = 2000;
  static constexpr std::size_t kMaxBytes = 4U << 20U;
  static constexpr std::size_t kMaxFixedSize = Intake::kMaxFixedSize;

 private:
  struct Impl;
  explicit Bus(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::link
