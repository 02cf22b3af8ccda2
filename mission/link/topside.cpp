#include "mission/link/topside.h"

#include <fmt/format.h>

#include "mission/record/log_codec.h"
#include "vehicle/link/udpm_url.h"

namespace dive::mission {
namespace {

constexpr Utime kSayAgain = 100'000;  // us
constexpr double kForHealth = 1.5;    // s: status arrives once a second

std::string no_executive(const link::Bus& bus, const std::string& url, double timeout_s) {
  const tl::expected<link::UdpmUrl, std::string> parsed = link::parse_udpm_url(url);
  const bool is_local = parsed && parsed->ttl == 0;
  return fmt::format(
      "no heartbeat of an executive within {:g} s on {}: is `dive run --lcm` running with this "
      "URL{}?{}",
      timeout_s, url, bus.has_key() ? " and the same key" : "",
      is_local ? " From another machine give --lcm with ttl=1" : "");
}

}  // namespace

tl::expected<link::RequestResult, std::string> ask(OperatorCommand command, link::Bus& bus,
                                                   const std::string& url, Clock& clock,
                                                   double timeout_s) {
  std::optional<link::Heartbeat> heartbeat;
  std::optional<link::OperatorRequest> request;
  std::optional<link::RequestResult> result;
  bus.listen<link::Heartbeat>(link::channel::kHeartbeat,
                              [&](const link::Heartbeat& received) { heartbeat = received; });
  bus.listen<link::OperatorAnswer>(link::channel::kAnswer, [&](const link::OperatorAnswer& answer) {
    if (!request) return;
    const bool is_ours = answer.session_id == request->session_id &&
                         answer.counter == request->counter && answer.command == command;
    if (is_ours) result = answer.result;
  });
  const Utime deadline = clock.now() + from_seconds(timeout_s);
  while (!result && clock.now() < deadline) {
    if (heartbeat && (!request || request->session_id != heartbeat->session_id)) {
      request = link::OperatorRequest{heartbeat->session_id, heartbeat->counter + 1, 0, command};
    }
    if (request) request->challenge = heartbeat->challenge;
    // An abort is sent before the executive's session is known.
    const bool blind = !request && command == OperatorCommand::kAbort;
    link::Packet packet;
    const link::OperatorRequest to_anyone{0, 0, 0, command};
    if ((request || blind) && link::encode(request ? *request : to_anyone, packet)) {
      bus.publish(link::channel::kRequest, packet);
    }
    bus.wait(clock, std::min(deadline, clock.now() + kSayAgain),
             [&] { return result.has_value() || (heartbeat.has_value() && !request.has_value()); });
  }
  if (result) return *result;
  if (!heartbeat) return tl::unexpected(no_executive(bus, url, timeout_s));
  return tl::unexpected(fmt::format("the executive did not answer within {:g} s", timeout_s));
}

tl::expected<VehicleStatus, std::string> listen(link::Bus& bus, const std::string& url,
                                                Clock& clock, double timeout_s) {
  VehicleStatus received;
  bool has_heartbeat = false;
  bool has_status = false;
  bool has_estimate = false;
  bus.listen<link::Heartbeat>(link::channel::kHeartbeat, [&](const link::Heartbeat& heartbeat) {
    received.heartbeat = heartbeat;
    has_heartbeat = true;
  });
  const std::size_t status_size = max_packet_size(Channel::kStatus);
  bus.subscribe(link::channel::kStatus, status_size, [&](link::PacketView packet) {
    Status status;
    const bool is_one = decode(packet, status);
    if (is_one) received.status = status;
    has_status |= is_one;
    return is_one;
  });
  const std::size_t estimate_size = max_packet_size(Channel::kEstimate);
  bus.subscribe(link::channel::kEstimate, estimate_size, [&](link::PacketView packet) {
    estimation::StateEstimate estimate;
    const bool is_one = decode(packet, estimate);
    if (is_one) received.estimate = estimate;
    has_estimate |= is_one;
    return is_one;
  });
  bus.listen<HealthSample>(link::channel::kHealth,
                           [&](const HealthSample& sample) { received.health = sample; });
  const Utime deadline = clock.now() + from_seconds(timeout_s);
  const auto has_all = [&] { return has_heartbeat && has_status && has_estimate; };
  if (!bus.wait(clock, deadline, has_all)) return tl::unexpected(no_executive(bus, url, timeout_s));
  bus.wait(clock, std::min(deadline, clock.now() + from_seconds(kForHealth)),
           [&] { return received.health.has_value(); });
  return received;
}

}  // namespace dive::mission
