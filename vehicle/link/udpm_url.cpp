#include "vehicle/link/udpm_url.h"

#include <charconv>
#include <optional>
#include <string_view>

#include <arpa/inet.h>
#include <fmt/format.h>

namespace dive::link {
namespace {

std::optional<int> parse_int(std::string_view text, int min, int max) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  return is_number && value >= min && value <= max ? std::optional(value) : std::nullopt;
}

bool is_multicast(const std::string& address) {
  in_addr parsed{};
  return inet_pton(AF_INET, address.c_str(), &parsed) == 1 && IN_MULTICAST(ntohl(parsed.s_addr));
}

/// Splits off the part before `separator`; all of it without one.
std::string_view take_until(std::string_view& rest, char separator) {
  const std::size_t at = rest.find(separator);
  const std::string_view part = rest.substr(0, at);
  rest = at == std::string_view::npos ? std::string_view() : rest.substr(at + 1);
  return part;
}

/// Returns what is wrong with the option, or an empty text.
std::string read_option(std::string_view option, UdpmUrl& url) {
  std::string_view value = option;
  const std::string_view name = take_until(value, '=');
  constexpr int kMaxTtl = 255;
  constexpr int kMaxReceiveBytes = 1 << 30;
  const bool is_ttl = name == "ttl";
  if (!is_ttl && name != "recv_buf_size") {
    return fmt::format("the options are ttl and recv_buf_size, not '{}'", name);
  }
  const std::optional<int> number = parse_int(value, 0, is_ttl ? kMaxTtl : kMaxReceiveBytes);
  if (!number) return fmt::format("'{}' is no value of {}", value, name);
  (is_ttl ? url.ttl : url.receive_bytes) = *number;
  return {};
}

}  // namespace

tl::expected<UdpmUrl, std::string> parse_udpm_url(const std::string& url) {
  const auto fail = [&](const std::string& why) {
    return tl::unexpected(fmt::format("cannot open the link over '{}': {}", url, why));
  };
  constexpr std::string_view kScheme = "udpm://";
  if (!url.starts_with(kScheme)) {
    return fail("it must be an LCM URL such as udpm://239.255.76.67:7667?ttl=0");
  }
  std::string_view options = std::string_view(url).substr(kScheme.size());
  std::string_view port = take_until(options, '?');
  const std::string_view address = take_until(port, ':');
  UdpmUrl parsed;
  if (!address.empty()) parsed.address = address;
  if (!is_multicast(parsed.address)) {
    return fail(fmt::format("'{}' is no IPv4 multicast address (224.0.0.0 to 239.255.255.255)",
                            parsed.address));
  }
  if (!port.empty()) {
    const std::optional<int> number = parse_int(port, 1, 65'535);
    if (!number) return fail(fmt::format("'{}' is no port (1 to 65535)", port));
    parsed.port = static_cast<std::uint16_t>(*number);
  }
  while (!options.empty()) {
    if (const std::string why = read_option(take_until(options, '&'), parsed); !why.empty()) {
      return fail(why);
    }
  }
  return parsed;
}

std::string multicast_hint(const UdpmUrl& url) {
  return fmt::format("multicast has no route: ip route add 224.0.0.0/4 dev {}",
                     url.ttl == 0 ? "lo" : "DEVICE");
}

std::string to_lcm(const UdpmUrl& url) {
  return fmt::format("udpm://{}:{}?ttl={}", url.address, url.port, url.ttl);
}

}  // namespace dive::link
