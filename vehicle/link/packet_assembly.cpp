#include "vehicle/link/packet_assembly.h"

#include <algorithm>
#include <utility>

namespace dive::link {

std::optional<PacketAssembly::Complete> PacketAssembly::add(std::uint64_t address, bool trusted,
                                                            const Datagram& fragment,
                                                            std::size_t max_bytes) {
  if (fragment.fragment == 0) {
    if (fragment.packet_size > max_bytes || !start(address, trusted, fragment)) return std::nullopt;
  }
  const auto entry = std::ranges::find(entries_, address, &Entry::address);
  if (entry == entries_.end()) return std::nullopt;
  Packet& packet = entry->packet;
  const std::size_t size = packet.size() + fragment.data.size();
  const bool is_next = fragment.sequence == entry->sequence && fragment.fragment == entry->next &&
                       fragment.fragments == entry->fragments &&
                       fragment.packet_size == entry->packet_size &&
                       fragment.offset == packet.size();
  const std::size_t claimed =
      size > packet.capacity() ? std::min(2 * size, entry->packet_size) - packet.capacity() : 0;
  if (!is_next || !make_room(&*entry, trusted, claimed)) {
    drop(entry);
    return std::nullopt;
  }
  bytes_ -= packet.capacity();
  if (claimed > 0) packet.reserve(packet.capacity() + claimed);
  bytes_ += packet.capacity();
  packet.insert(packet.end(), fragment.data.begin(), fragment.data.end());
  if (++entry->next < entry->fragments) return std::nullopt;
  std::optional<Complete> complete;
  if (size == entry->packet_size) complete = {std::move(entry->channel), std::move(packet)};
  drop(entry);
  return complete;
}

// A packet in progress of the same address is given up: its sender has.
bool PacketAssembly::start(std::uint64_t address, bool trusted, const Datagram& fragment) {
  const auto old = std::ranges::find(entries_, address, &Entry::address);
  if (old != entries_.end()) drop(old);
  if (entries_.size() == kMaxSenders) {
    auto oldest = std::ranges::find(entries_, false, &Entry::trusted);
    if (oldest == entries_.end() && trusted) oldest = entries_.begin();
    if (oldest == entries_.end()) return false;
    drop(oldest);
  }
  entries_.push_back({address,
                      trusted,
                      fragment.sequence,
                      fragment.packet_size,
                      0,
                      fragment.fragments,
                      std::string(fragment.channel),
                      {}});
  return true;
}

// A single packet may exceed kMaxBytes, up to its channel's limit.
bool PacketAssembly::make_room(const Entry* keep, bool trusted, std::size_t bytes) {
  while (bytes_ + bytes > kMaxBytes && entries_.size() > 1) {
    const auto oldest = [&](bool of_trusted) {
      return std::ranges::find_if(entries_, [&](const Entry& entry) {
        return &entry != keep && entry.trusted == of_trusted;
      });
    };
    auto dropped = oldest(false);
    if (dropped == entries_.end() && trusted) dropped = oldest(true);
    if (dropped == entries_.end()) return false;
    drop(dropped);
  }
  return true;
}

void PacketAssembly::drop(Entries::iterator entry) {
  // A moved-from packet has no capacity any more: the sum is taken again.
  entries_.erase(entry);
  bytes_ = 0;
  for (const Entry& other : entries_) bytes_ += other.packet.capacity();
}

}  // namespace dive::link
