#include "mission/link/topside.h"

#include <fmt/format.h>

#include "mission/record/log_codec.h"

namespace dive::mission {
namespace {

constexpr Utime kSayAgain = 100'000;      // us
constexpr std::size_t kMaxPacket = 256;   // bytes, of what has a fixed size
constexpr std::size_t kMaxStatus = 2048;  // bytes: names are at most 64 long
constexpr double kForHealth = 1.5;        // s: it comes once a second

std::string nobody(double patience_s) {
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
  bus.subscribe(link::channel::kHeartbeat, kMaxPacket, [&](link::PacketView packet) {
    link::Heartbeat heard;
    if (link::decode(packet, heard)) heartbeat = heard;
  });
  bus.subscribe(link::channel::kAnswer, kMaxPacket, [&](link::PacketView packet) {
    link::OperatorAnswer answer;
    if (!link::decode(packet, answer) || !request) return;
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
    // An abort does not wait until it knows whom it is for.
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
  if (!heartbeat) return tl::unexpected(nobody(patience_s));
  return tl::unexpected(fmt::format("the executive did not answer within {:g} s", patience_s));
}

tl::expected<VehicleStatus, std::string> listen(link::Bus& bus, Clock& clock, double patience_s) {
  VehicleStatus heard;
  bool has_heartbeat = false;
  bool has_status = false;
  bus.subscribe(link::channel::kHeartbeat, kMaxPacket, [&](link::PacketView packet) {
    has_heartbeat |= link::decode(packet, heard.heartbeat);
  });
  bus.subscribe(link::channel::kStatus, kMaxStatus,
                [&](link::PacketView packet) { has_status |= decode(packet, heard.status); });
  bus.subscribe(link::channel::kHealth, kMaxPacket, [&](link::PacketView packet) {
    HealthSample sample;
    if (link::decode(packet, sample)) heard.health = sample;
  });
  const Utime deadline = clock.now() + from_seconds(patience_s);
  const auto has_both = [&] { return has_heartbeat && has_status; };
  if (!bus.wait(clock, deadline, has_both)) return tl::unexpected(nobody(patience_s));
  bus.wait(clock, std::min(deadline, clock.now() + from_seconds(kForHealth)),
           [&] { return heard.health.has_value(); });
  return heard;
}

}  // namespace dive::mission
