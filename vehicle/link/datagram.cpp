#include "vehicle/link/datagram.h"

#include <algorithm>

namespace dive::link {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint32_t kShort = 0x4c433032;     // "LC02"
constexpr std::uint32_t kFragment = 0x4c433033;  // "LC03"
constexpr std::size_t kShortHeader = 8;
constexpr std::size_t kFragmentHeader = 20;

std::uint32_t big_endian(Bytes bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = (value << 8U) | byte;
  return value;
}

/// Splits the channel's name, which ends in a zero, off the rest; empty if it is none.
std::string_view take_channel(Bytes& rest) {
  const Bytes searched = rest.first(std::min(rest.size(), kMaxChannelLength + 1));
  const auto end = std::ranges::find(searched, std::uint8_t{0});
  if (end == searched.end()) return {};
  const auto length = static_cast<std::size_t>(end - searched.begin());
  const std::string_view channel(reinterpret_cast<const char*>(rest.data()), length);
  rest = rest.subspan(length + 1);
  return channel;
}

std::optional<Datagram> parse_short(Bytes bytes) {
  Datagram datagram;
  datagram.sequence = big_endian(bytes.subspan(4, 4));
  Bytes rest = bytes.subspan(kShortHeader);
  datagram.channel = take_channel(rest);
  datagram.data = rest;
  datagram.packet_size = rest.size();
  if (datagram.channel.empty()) return std::nullopt;
  return datagram;
}

std::optional<Datagram> parse_fragment(Bytes bytes) {
  if (bytes.size() < kFragmentHeader) return std::nullopt;
  Datagram datagram;
  datagram.sequence = big_endian(bytes.subspan(4, 4));
  datagram.packet_size = big_endian(bytes.subspan(8, 4));
  datagram.offset = big_endian(bytes.subspan(12, 4));
  datagram.fragment = big_endian(bytes.subspan(16, 2));
  datagram.fragments = big_endian(bytes.subspan(18, 2));
  Bytes rest = bytes.subspan(kFragmentHeader);
  const bool is_first = datagram.fragment == 0;
  if (is_first) datagram.channel = take_channel(rest);
  datagram.data = rest;
  // No sum overflows: the fields are of 32 bits, the sums of 64.
  const bool is_consistent = datagram.fragment < datagram.fragments &&
                             datagram.offset + rest.size() <= datagram.packet_size &&
                             is_first == !datagram.channel.empty() &&
                             is_first == (datagram.offset == 0);
  if (!is_consistent) return std::nullopt;
  return datagram;
}

}  // namespace

static_assert(sizeof(std::size_t) >= 8);

std::optional<Datagram> parse_datagram(Bytes bytes) {
  if (bytes.size() < kShortHeader || bytes.size() > kMaxDatagram) return std::nullopt;
  switch (big_endian(bytes.first(4))) {
    case kShort:
      return parse_short(bytes);
    case kFragment:
      return parse_fragment(bytes);
    default:
      return std::nullopt;
  }
}

}  // namespace dive::link
