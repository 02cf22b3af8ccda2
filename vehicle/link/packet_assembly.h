#pragma once
// Puts the fragments of packets together, within bounds that no sender can exceed.

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <string>

#include "common/clock.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/datagram.h"

namespace dive::link {

/// One packet in progress for each address, of kMaxSenders addresses; memory is claimed as data
/// arrives, not as announced. Fragments must arrive in order, the first one first, as they do
/// within one network: a packet with a lost or overtaken fragment is lost.
class PacketAssembly {
 public:
  static constexpr std::size_t kMaxSenders = 16;
  static constexpr std::size_t kMaxBytes = 8U << 20U;  ///< Of all packets in progress.

  struct Complete {
    std::string channel;
    Packet packet;
  };

  /// Adds a fragment from `address` and returns the packet that it completes. `max_bytes`: of a
  /// packet on the channel of a first fragment. Where memory is short, the packets of addresses
  /// that are not `trusted` are dropped first, the oldest first.
  [[nodiscard]] std::optional<Complete> add(std::uint64_t address, bool trusted,
                                            const Datagram& fragment, std::size_t max_bytes);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::uint64_t address = 0;
    bool trusted = false;
    std::uint32_t sequence = 0;
    std::size_t packet_size = 0;
    unsigned next = 0;  ///< Fragment that must follow.
    unsigned fragments = 0;
    std::string channel;
    Packet packet;
  };
  using Entries = std::list<Entry>;

  [[nodiscard]] bool start(std::uint64_t address, bool trusted, const Datagram& fragment);
  [[nodiscard]] bool make_room(const Entry* keep, bool trusted, std::size_t bytes);
  void drop(Entries::iterator entry);

  Entries entries_;  ///< Oldest first.
  std::size_t bytes_ = 0;
};

}  // namespace dive::link
