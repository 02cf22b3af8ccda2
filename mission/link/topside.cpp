#include "mission/link/topside.h"

#include <fmt/format.h>

#include "mission/record/log_codec.h"

namespace dive::mission {
namespace {

constexpr Utime kSayAgain = 100'000;      // us
constexpr std::size_t kMaxStatus = 2048;  // bytes: names are at most 64 long
constexpr double kForHealth = 1.5;        // s: status arrives once a second

std::string no_executive(double patience_s) {
  return fmt::format(
      "no executive was heard for {:g} s: is `dive run --lcm` running, with the same URL?",
      patience_s);
}

}  // namespace

tl::expected<link::Verdict, std::string> ask(OperatorCommand command,
                                             const std::optional<link::Key>& key, link::Bus& bus,
                                             Clock& clock, double patience_s) {
  std::optional<link::Heartbeat> heartbeat;
  std::optional<link::OperatorRequest> request;
  std::optional<link::Verdict> verdict;
  bus.listen<link::Heartbeat>(link::channel::kHeartbeat,
                              [&](const link::Heartbeat& heard) { heartbeat = heard; });
  bus.listen<link::OperatorAnswer>(link::channel::kAnswer, [&](const link::OperatorAnswer& answer) {
    if (!request) return;
    const bool is_ours = answer.boot == heartbeat->boot && answer.counter == request->counter &&
                         answer.command == command;
    if (is_ours && (!key || link::is_sealed(*key, answer))) verdict = answer.verdict;
  });
  const Utime deadline = clock.now() + from_seconds(patience_s);
  while (!verdict && clock.now() < deadline) {
    if (heartbeat && !request) {
      request = link::OperatorRequest{
          heartbeat->boot, heartbeat->counter + 1, heartbeat->utime, command, {}};
      if (key) link::seal(*key, *request);
    }
    // An abort is sent before the executive's session is known.
    const bool blind = !request && command == OperatorCommand::kAbort;
    link::Packet packet;
    const link::OperatorRequest to_anyone{0, 0, 0, command, {}};
    if ((request || blind) && link::encode(request ? *request : to_anyone, packet)) {
      bus.publish(link::channel::kRequest, packet);
    }
    bus.wait(clock, std::min(deadline, clock.now() + kSayAgain), [&] {
      return verdict.has_value() || (heartbeat.has_value() && !request.has_value());
    });
  }
  if (verdict) return *verdict;
  if (!heartbeat) return tl::unexpected(no_executive(patience_s));
  return tl::unexpected(fmt::format("the executive did not answer within {:g} s", patience_s));
}

tl::expected<VehicleStatus, std::string> listen(link::Bus& bus, Clock& clock, double patience_s) {
  VehicleStatus heard;
  bool has_heartbeat = false;
  bool has_status = false;
  bool has_estimate = false;
  bus.listen<link::Heartbeat>(link::channel::kHeartbeat, [&](const link::Heartbeat& heartbeat) {
    heard.heartbeat = heartbeat;
    has_heartbeat = true;
  });
  bus.subscribe(link::channel::kStatus, kMaxStatus, [&](link::PacketView packet) {
    Status status;
    const bool is_one = decode(packet, status);
    if (is_one) heard.status = status;
    has_status |= is_one;
    return is_one;
  });
  bus.subscribe(link::channel::kEstimate, kMaxStatus, [&](link::PacketView packet) {
    estimation::StateEstimate estimate;
    const bool is_one = decode(packet, estimate);
    if (is_one) heard.estimate = estimate;
    has_estimate |= is_one;
    return is_one;
  });
  bus.listen<HealthSample>(link::channel::kHealth,
                           [&](const HealthSample& sample) { heard.health = sample; });
  const Utime deadline = clock.now() + from_seconds(patience_s);
  const auto has_all = [&] { return has_heartbeat && has_status && has_estimate; };
  if (!bus.wait(clock, deadline, has_all)) return tl::unexpected(no_executive(patience_s));
  bus.wait(clock, std::min(deadline, clock.now() + from_seconds(kForHealth)),
           [&] { return heard.health.has_value(); });
  return heard;
}

}  // namespace dive::mission
