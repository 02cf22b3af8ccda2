#pragma once
// Authentication of packets. With a key every packet carries a trailer behind LCM's message, where
// decoders, lcm-spy and lcm-logger do not look: who sent it, its number, and a message
// authentication code over channel, packet, sender and number.
//
//   role      1 byte
//   sender    8 bytes, big-endian: a random number per start of a process
//   counter   8 bytes, big-endian: 1, 2, ... over all channels of the sender
//   code      16 bytes: Poly1305 under a key of its own for each packet, which is keyed
//             BLAKE2b-256 of role, sender, counter and channel under the shared key
//   mark      4 bytes
//
// See doc/decisions/authentic-packets.md.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "vehicle/link/codec.h"
#include "vehicle/link/key.h"

namespace dive::link {

/// The part of a process in a dive. kObserver: of one that only reads.
enum class Role : std::uint8_t { kObserver, kVehicle, kExecutive, kSupervisor, kTopside };
inline constexpr Role kLastRole = Role::kTopside;

/// True if packets of the channel come from processes of this role. Channels that are not ours
/// are open to all.
[[nodiscard]] bool may_publish(Role role, std::string_view channel);

struct Trailer {
  Role role = Role::kObserver;
  std::uint64_t sender = 0;
  std::uint64_t counter = 0;
};

inline constexpr std::size_t kTrailerSize = 37;  ///< bytes

/// Appends the trailer.
void seal(const Key& key, std::string_view channel, const Trailer& trailer, Packet& packet);

/// The trailer, if there is one and its code is right.
[[nodiscard]] std::optional<Trailer> authenticate(const Key& key, std::string_view channel,
                                                  PacketView packet);

[[nodiscard]] bool has_trailer(PacketView packet);
/// The packet without its trailer, if it has one.
[[nodiscard]] PacketView without_trailer(PacketView packet);

}  // namespace dive::link
