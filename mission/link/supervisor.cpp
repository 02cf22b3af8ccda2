#include "mission/link/supervisor.h"

#include <optional>

#include "vehicle/link/key.h"

namespace dive::mission {
namespace {

constexpr Utime kPeriod = 50'000;  // us between its own commands

template <typename Value>
void listen(link::Bus& bus, const char* channel, Clock& clock, Supervision& supervision) {
  bus.listen<Value>(channel, [&](const Value& value) { supervision.receive(value, clock.now()); });
}

}  // namespace

SupervisorReport supervise(const SupervisorSettings& settings, link::Bus& bus, Clock& clock,
                           const SupervisorLog& log, const std::function<bool()>& wanted) {
  Supervision supervision(settings, link::new_nonce(), log);
  listen<link::VehicleCommand>(bus, link::channel::kCommand, clock, supervision);
  listen<link::Heartbeat>(bus, link::channel::kHeartbeat, clock, supervision);
  listen<ImuSample>(bus, link::channel::kAhrs, clock, supervision);
  listen<DepthSample>(bus, link::channel::kDepth, clock, supervision);
  bus.listen<link::ExitPathMessage>(
      link::channel::kExitPath,
      [&](const link::ExitPathMessage& message) { supervision.receive(message); },
      link::kMaxExitPathPacket);
  link::Packet packet;
  while (wanted() && !supervision.is_over(clock.now())) {
    bus.wait(clock, clock.now() + kPeriod);
    const std::optional<link::VehicleCommand> command = supervision.step(clock.now());
    if (command && link::encode(*command, packet)) bus.publish(link::channel::kCommand, packet);
  }
  return supervision.report();
}

}  // namespace dive::mission
