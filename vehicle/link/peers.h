#pragma once
// Which senders are present now. A message authentication code proves that a packet was once sent
// by a process with the key, not that it was sent now: a recording of an earlier dive has valid
// codes. So every process sets a challenge, a random number, which the others return in an
// authenticated presence. A sender is confirmed while it has returned a recent challenge of ours,
// and only packets that it sent after that presence, in order, are fresh.
//
// Not thread-safe. Times are of one monotonic clock. See doc/decisions/authentic-packets.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/envelope.h"
#include "vehicle/link/key.h"

namespace dive::link {

class Peers {
 public:
  static constexpr Utime kPeriod = 250'000;        ///< Of presences and challenges, us.
  static constexpr Utime kMinInterval = 20'000;    ///< Between two presences, us.
  static constexpr Utime kLifetime = 3'000'000;    ///< Of a challenge, us.
  static constexpr std::size_t kMaxPeers = 256;    ///< Known senders, present or not.
  static constexpr std::size_t kMaxChannels = 64;  ///< Of one sender.

  enum class Freshness {
    kFresh,
    kRepeated,     ///< Sent before one that was accepted on its channel, or before a presence.
    kUnconfirmed,  ///< Its sender may be a recording.
  };

  explicit Peers(std::uint64_t self, std::function<std::uint64_t()> nonce = new_nonce)
      : self_(self), nonce_(std::move(nonce)) {}

  /// Decides on an authentic packet, and remembers its number if it is fresh. `channel` is a small
  /// number of ours for its channel.
  [[nodiscard]] Freshness accept(const Trailer& trailer, std::size_t channel, Utime now);

  /// Receives an authentic presence.
  void receive(const Trailer& trailer, const Presence& presence, Utime now);

  /// The presence to send now, if one is due.
  [[nodiscard]] std::optional<Presence> take_due(Utime now);
  [[nodiscard]] Utime next_due() const { return next_due_; }

 private:
  struct Peer {
    std::uint64_t sender = 0;
    std::uint64_t challenge = 0;  ///< Its newest challenge.
    std::uint64_t presence = 0;   ///< Counter of its newest presence.
    Utime seen_at = 0;            ///< Time of that presence.
    std::optional<Utime> confirmed_until;
    std::uint64_t floor = 0;          ///< Counter of the presence that confirmed it.
    std::vector<std::uint64_t> last;  ///< Newest counter by channel.
  };
  struct Challenge {
    std::uint64_t value = 0;
    Utime set_at = 0;
  };

  [[nodiscard]] Peer* find(std::uint64_t sender);
  [[nodiscard]] Peer* add(std::uint64_t sender, Utime now);
  [[nodiscard]] const Challenge* returned_challenge(const Presence& presence, Utime now) const;
  [[nodiscard]] static bool is_confirmed(const Peer& peer, Utime now);

  std::uint64_t self_;
  std::function<std::uint64_t()> nonce_;
  std::vector<Peer> peers_;
  std::array<Challenge, kLifetime / kPeriod + 1> challenges_{};
  std::size_t newest_ = 0;  ///< In challenges_.
  Utime sent_at_ = 0;
  Utime next_due_ = 0;
  bool has_sent_ = false;
};

}  // namespace dive::link
