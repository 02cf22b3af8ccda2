#include "test/vehicle/link/datagrams.h"

#include <algorithm>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace dive::link::testing {
namespace {

void append(Bytes& bytes, std::uint64_t value, int size) {
  for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

void append(Bytes& bytes, std::string_view channel) {
  bytes.insert(bytes.end(), channel.begin(), channel.end());
  bytes.push_back(0);
}

}  // namespace

Bytes short_datagram(std::string_view channel, PacketView data, std::uint32_t sequence) {
  Bytes bytes;
  append(bytes, 0x4c433032, 4);
  append(bytes, sequence, 4);
  append(bytes, channel);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

Bytes fragment_datagram(const FragmentHeader& header, std::string_view channel, PacketView data) {
  Bytes bytes;
  append(bytes, header.magic, 4);
  append(bytes, header.sequence, 4);
  append(bytes, header.packet_size, 4);
  append(bytes, header.offset, 4);
  append(bytes, header.fragment, 2);
  append(bytes, header.fragments, 2);
  if (!channel.empty()) append(bytes, channel);
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

std::vector<Bytes> fragments(std::string_view channel, PacketView packet, std::size_t size,
                             std::uint32_t sequence) {
  std::vector<Bytes> all;
  FragmentHeader header;
  header.sequence = sequence;
  header.packet_size = static_cast<std::uint32_t>(packet.size());
  header.fragments = static_cast<std::uint16_t>((packet.size() + size - 1) / size);
  for (std::size_t at = 0; at < packet.size(); at += size) {
    header.offset = static_cast<std::uint32_t>(at);
    all.push_back(fragment_datagram(header, at == 0 ? channel : std::string_view(),
                                    packet.subspan(at, std::min(size, packet.size() - at))));
    ++header.fragment;
  }
  return all;
}

Bytes overflowing_datagram(std::string_view channel) {
  FragmentHeader header;
  header.packet_size = 65'536;
  header.offset = 0xFFFF'FFFF;
  header.fragments = 3;
  return fragment_datagram(header, channel, Bytes(100));
}

DatagramSender::DatagramSender(const UdpmUrl& group)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(group.port);
  ::inet_pton(AF_INET, group.address.c_str(), &to.sin_addr);
  const unsigned char ttl = 0;
  ::setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

DatagramSender::~DatagramSender() { ::close(socket_); }

bool DatagramSender::send(const Bytes& datagram) const {
  return ::send(socket_, datagram.data(), datagram.size(), 0) ==
         static_cast<ssize_t>(datagram.size());
}

}  // namespace dive::link::testing
