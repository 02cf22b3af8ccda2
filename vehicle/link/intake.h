#pragma once
// From datagrams of unknown origin to packets that may be handled: each is parsed, put together,
// bounded by its channel, authenticated and only then queued. Needs no network: any bytes may be
// given to it.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/clock.h"
#include "vehicle/link/arrival_queue.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/datagram.h"
#include "vehicle/link/envelope.h"
#include "vehicle/link/key.h"
#include "vehicle/link/packet_assembly.h"
#include "vehicle/link/peers.h"

namespace dive::link {

/// Whose packets a subscription receives if there is a key. Without one it receives all.
enum class Access {
  kAuthentic,  ///< Trust::kAuthentic
  kAnyone,     ///< All, with their Trust.
};

/// Numbers of packets on subscribed channels that were not delivered.
struct Rejections {
  std::int64_t malformed = 0;        ///< Too large for their channel.
  std::int64_t unauthenticated = 0;  ///< Without a valid code, or from the wrong role.
  std::int64_t repeated = 0;         ///< Sent before one that was accepted.
  std::int64_t unconfirmed = 0;      ///< From senders not known to be present.
  std::int64_t crowded_out = 0;      ///< Beyond their sender's allowance.
};

/// take() and presence() belong to one thread; everything else may be called from another.
class Intake {
 public:
  /// Largest packet without a list, bytes.
  static constexpr std::size_t kMaxFixedSize = kMaxFixedPacket;
  /// Maximum number of packets of one sender that wait for one subscription: without a list, with
  /// one, and of all that are not authentic although there is a key.
  static constexpr std::size_t kQueue = 500;
  static constexpr std::size_t kListQueue = 16;
  static constexpr std::size_t kAnonymousQueue = 8;

  /// `self`: our own sender number, whose packets are not delivered if there is a key.
  Intake(std::optional<Key> key, std::uint64_t self) : key_(key), self_(self), peers_(self) {}

  /// Returns the number of the subscription, counted from 0.
  std::size_t subscribe(std::string channel, std::size_t max_bytes, Access access);

  /// Takes a datagram that arrived from `address` at `now`, of a monotonic clock.
  void take(std::span<const std::uint8_t> datagram, std::uint64_t address, Utime now);

  /// With a key: the presence to send now, if one is due, and when the next one is.
  [[nodiscard]] std::optional<Presence> take_presence(Utime now);
  [[nodiscard]] Utime next_presence() const { return peers_.next_due(); }

  [[nodiscard]] bool has_key() const { return key_.has_value(); }
  [[nodiscard]] ArrivalQueue& queue() { return queue_; }
  [[nodiscard]] Rejections rejections() const;

 private:
  struct Subscription {
    std::string channel;
    std::size_t max_bytes = 0;
    Access access = Access::kAuthentic;
  };
  struct Match {
    std::size_t subscription = 0;
    std::size_t max_bytes = 0;
    Access access = Access::kAuthentic;
  };

  void find_matches(std::string_view channel);
  [[nodiscard]] std::size_t max_bytes(std::string_view channel) const;
  void take_packet(std::string_view channel, PacketView packet, std::uint64_t address, Utime now);
  void receive_presence(PacketView packet, std::uint64_t address, Utime now);
  [[nodiscard]] std::optional<Sender> identify(std::string_view channel, PacketView packet,
                                               std::uint64_t address, Utime now);
  void deliver(const Match& match, const Sender& sender, PacketView message);
  void trust(std::uint64_t address);
  [[nodiscard]] bool is_trusted(std::uint64_t address) const;

  std::optional<Key> key_;
  std::uint64_t self_;
  mutable std::mutex mutex_;  ///< Of subscriptions_.
  std::vector<Subscription> subscriptions_;
  std::vector<Match> matches_;  ///< Of the present packet.
  PacketAssembly assembly_;
  Peers peers_;
  std::vector<std::uint64_t> trusted_;  ///< Addresses of the last authentic packets, newest first.
  ArrivalQueue queue_;
  std::atomic<std::int64_t> malformed_ = 0;
  std::atomic<std::int64_t> unauthenticated_ = 0;
  std::atomic<std::int64_t> repeated_ = 0;
  std::atomic<std::int64_t> unconfirmed_ = 0;
  std::atomic<std::int64_t> crowded_out_ = 0;
};

}  // namespace dive::link
