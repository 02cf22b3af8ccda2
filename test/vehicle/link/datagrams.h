#pragma once
// Datagrams in LCM's encoding, also ones that LCM does not write, and a socket to send them.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "vehicle/link/codec.h"
#include "vehicle/link/udpm_url.h"

namespace dive::link::testing {

using Bytes = std::vector<std::uint8_t>;

[[nodiscard]] Bytes short_datagram(std::string_view channel, PacketView data,
                                   std::uint32_t sequence = 0);

struct FragmentHeader {
  std::uint32_t magic = 0x4c433033;
  std::uint32_t sequence = 8;
  std::uint32_t packet_size = 0;
  std::uint32_t offset = 0;
  std::uint16_t fragment = 0;
  std::uint16_t fragments = 1;
};
/// With a channel if it is not empty.
[[nodiscard]] Bytes fragment_datagram(const FragmentHeader& header, std::string_view channel,
                                      PacketView data);
/// A whole packet in fragments of `size` bytes of data.
[[nodiscard]] std::vector<Bytes> fragments(std::string_view channel, PacketView packet,
                                           std::size_t size, std::uint32_t sequence = 8);
/// At which LCM 1.3.1 reads out of bounds: the sum of offset and size overflows.
[[nodiscard]] Bytes overflowing_datagram(std::string_view channel);

/// Sends datagrams to a group.
class DatagramSender {
 public:
  explicit DatagramSender(const UdpmUrl& group);
  ~DatagramSender();
  DatagramSender(const DatagramSender&) = delete;
  DatagramSender& operator=(const DatagramSender&) = delete;

  bool send(const Bytes& datagram) const;

 private:
  int socket_;
};

}  // namespace dive::link::testing
