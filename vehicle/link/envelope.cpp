#include "vehicle/link/envelope.h"

#include <algorithm>
#include <array>
#include <span>

#include <sodium.h>

#include "common/assert.h"
#include "vehicle/link/channels.h"
#include "vehicle/link/datagram.h"

namespace dive::link {
namespace {

constexpr std::size_t kNumberedSize = 1 + 8 + 8;  // role, sender, counter
constexpr std::size_t kCodeSize = crypto_onetimeauth_BYTES;
constexpr std::array<std::uint8_t, 4> kMark = {'D', 'I', 'V', '1'};
static_assert(kTrailerSize == kNumberedSize + kCodeSize + kMark.size());

using Code = std::array<std::uint8_t, kCodeSize>;

constexpr unsigned bit(Role role) { return 1U << static_cast<unsigned>(role); }

struct PublishedChannel {
  std::string_view channel;
  unsigned roles = 0;
};

constexpr unsigned kFromVehicle = bit(Role::kVehicle);
constexpr unsigned kFromExecutive = bit(Role::kExecutive);
constexpr PublishedChannel kPublishedChannels[] = {
    {channel::kAhrs, kFromVehicle},
    {channel::kDepth, kFromVehicle},
    {channel::kHealth, kFromVehicle},
    {channel::kImage, kFromVehicle},
    {channel::kImu, kFromVehicle},
    {channel::kRange, kFromVehicle},
    {channel::kSimTick, kFromVehicle},
    {channel::kTruth, kFromVehicle},
    {channel::kCommand, kFromExecutive | bit(Role::kSupervisor)},
    {channel::kHeartbeat, kFromExecutive},
    {channel::kStatus, kFromExecutive},
    {channel::kEstimate, kFromExecutive},
    {channel::kExitPath, kFromExecutive},
    {channel::kPath, kFromExecutive},
    {channel::kPayload, kFromExecutive},
    {channel::kAnswer, kFromExecutive},
    {channel::kRequest, bit(Role::kTopside)},
};

void write_number(std::uint64_t number, std::uint8_t* to) {
  for (int shift = 56; shift >= 0; shift -= 8) *to++ = static_cast<std::uint8_t>(number >> shift);
}

std::uint64_t read_number(std::span<const std::uint8_t> from) {
  std::uint64_t number = 0;
  for (const std::uint8_t byte : from) number = (number << 8U) | byte;
  return number;
}

// A key is used for one packet only, as Poly1305 demands: a counter is never used twice by the same
// sender, and a sender is a fresh random number.
Code code_of(const Key& key, std::string_view channel, PacketView numbered, PacketView packet) {
  constexpr std::string_view kPurpose = "dive packet 1";
  std::array<std::uint8_t, kPurpose.size() + kNumberedSize + kMaxChannelLength> input{};
  DIVE_DEMAND(channel.size() <= kMaxChannelLength);
  auto* end = std::copy(kPurpose.begin(), kPurpose.end(), input.begin());
  end = std::copy(numbered.begin(), numbered.end(), end);
  end = std::copy(channel.begin(), channel.end(), end);
  std::array<std::uint8_t, crypto_onetimeauth_KEYBYTES> packet_key;
  crypto_generichash(packet_key.data(), packet_key.size(), input.data(),
                     static_cast<std::size_t>(end - input.data()), key.data(), key.size());
  Code code;
  crypto_onetimeauth(code.data(), packet.data(), packet.size(), packet_key.data());
  return code;
}

}  // namespace

bool may_publish(Role role, std::string_view channel) {
  const auto* found = std::ranges::find(kPublishedChannels, channel, &PublishedChannel::channel);
  return found == std::end(kPublishedChannels) || (found->roles & bit(role)) != 0;
}

void seal(const Key& key, std::string_view channel, const Trailer& trailer, Packet& packet) {
  std::array<std::uint8_t, kNumberedSize> numbered;
  numbered[0] = static_cast<std::uint8_t>(trailer.role);
  write_number(trailer.sender, &numbered[1]);
  write_number(trailer.counter, &numbered[9]);
  const Code code = code_of(key, channel, numbered, packet);
  packet.insert(packet.end(), numbered.begin(), numbered.end());
  packet.insert(packet.end(), code.begin(), code.end());
  packet.insert(packet.end(), kMark.begin(), kMark.end());
}

std::optional<Trailer> authenticate(const Key& key, std::string_view channel, PacketView packet) {
  if (!has_trailer(packet)) return std::nullopt;
  const PacketView message = without_trailer(packet);
  const PacketView numbered = packet.subspan(message.size(), kNumberedSize);
  const PacketView given = packet.subspan(message.size() + kNumberedSize, kCodeSize);
  const Code code = code_of(key, channel, numbered, message);
  const bool is_role = numbered[0] <= static_cast<std::uint8_t>(kLastRole);
  if (sodium_memcmp(code.data(), given.data(), code.size()) != 0 || !is_role) return std::nullopt;
  return Trailer{static_cast<Role>(numbered[0]), read_number(numbered.subspan(1, 8)),
                 read_number(numbered.subspan(9, 8))};
}

bool has_trailer(PacketView packet) {
  return packet.size() >= kTrailerSize && std::ranges::equal(packet.last(kMark.size()), kMark);
}

PacketView without_trailer(PacketView packet) {
  return has_trailer(packet) ? packet.first(packet.size() - kTrailerSize) : packet;
}

}  // namespace dive::link
