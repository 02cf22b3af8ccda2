#include "mission/cli/open_link.h"

#include <fmt/format.h>

#include "common/priority.h"
#include "mission/cli/terminal.h"
#include "vehicle/link/udpm_url.h"

namespace dive::mission {
namespace {

bool is_allowed(const LinkArguments& arguments, const link::UdpmUrl& url, link::Role role) {
  const bool commands = role == link::Role::kExecutive || role == link::Role::kSupervisor;
  if (!commands || url.ttl == 0 || !arguments.key.empty() || arguments.insecure) return true;
  complain(
      fmt::format("{}: with ttl={} packets leave this machine, and without a key anyone on the "
                  "network can command the vehicle: give --key FILE (dive key makes one), or "
                  "--insecure",
                  arguments.url, url.ttl));
  return false;
}

}  // namespace

std::optional<link::Bus> open_link(const LinkArguments& arguments, link::Role role) {
  const tl::expected<link::UdpmUrl, std::string> url = link::parse_udpm_url(arguments.url);
  if (!url) {
    complain(url.error());
    return std::nullopt;
  }
  if (!is_allowed(arguments, *url, role)) return std::nullopt;
  link::BusOptions options;
  options.role = role;
  if (!arguments.key.empty()) {
    const tl::expected<link::Key, std::string> key = link::read_key(arguments.key);
    if (!key) {
      complain(key.error());
      return std::nullopt;
    }
    options.key = *key;
  }
  tl::expected<link::Bus, std::string> bus = link::Bus::open(arguments.url, options);
  if (bus) return std::move(*bus);
  complain(bus.error());
  return std::nullopt;
}

void request_realtime_priority() {
  if (set_realtime_priority()) return;
  note(
      "dive: no real-time priority: commands may be late when the computer is busy; set "
      "LimitRTPRIO=50 in the unit (ulimit -r 50), or run as root");
}

}  // namespace dive::mission
