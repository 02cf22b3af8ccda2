#pragma once
// LCM's URL of a UDP multicast group: udpm://ADDRESS:PORT?ttl=N&recv_buf_size=BYTES.

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

namespace dive::link {

struct UdpmUrl {
  std::string address = "239.255.76.67";  ///< IPv4 multicast group.
  std::uint16_t port = 7667;
  int ttl = 0;            ///< 0: packets do not leave the machine.
  int receive_bytes = 0;  ///< Size of the system's receive buffer, bytes; 0: not given.
};

/// Absent parts take LCM's defaults, above. The error says what is wrong.
[[nodiscard]] tl::expected<UdpmUrl, std::string> parse_udpm_url(const std::string& url);

/// Hint for a machine that cannot join the group.
[[nodiscard]] std::string multicast_hint(const UdpmUrl& url);

/// The URL that LCM needs for publishing.
[[nodiscard]] std::string to_lcm(const UdpmUrl& url);

}  // namespace dive::link
