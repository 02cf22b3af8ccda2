#pragma once
// LCM's encoding of packets in UDP datagrams ("LCM UDP Multicast Protocol Description"), read
// without trusting any field: a packet in one datagram (LC02), or one fragment of a packet (LC03).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace dive::link {

inline constexpr std::size_t kMaxDatagram = 65'507;   ///< Largest payload of UDP over IPv4, bytes.
inline constexpr std::size_t kMaxChannelLength = 63;  ///< Of a channel's name, as in LCM.

/// One datagram; refers to its bytes.
struct Datagram {
  std::uint32_t sequence = 0;  ///< Number of the packet, counted by its sender.
  std::string_view channel;    ///< 1 to kMaxChannelLength; empty except in the first fragment.
  std::span<const std::uint8_t> data;
  std::size_t packet_size = 0;  ///< Of the whole packet, bytes.
  std::size_t offset = 0;       ///< Of `data` in the packet; offset + data.size() <= packet_size.
  unsigned fragment = 0;        ///< Less than `fragments`.
  unsigned fragments = 1;
};

/// Empty unless the datagram is consistent with itself.
[[nodiscard]] std::optional<Datagram> parse_datagram(std::span<const std::uint8_t> bytes);

}  // namespace dive::link
