#include "mission/link/supervisor.h"

#include <optional>

#include "mission/onboard/map_match_service.h"
#include "vehicle/link/key.h"

namespace dive::mission {
namespace {

constexpr Utime kPeriod = 50'000;  // us between its own commands

template <typename Value>
void listen(link::Bus& bus, const char* channel, Clock& clock, Supervision& supervision) {
  bus.listen<Value>(channel, [&](const Value& value) { supervision.receive(value, clock.now()); });
}

/// Map fixes from the scans of the range camera, on a worker.
class Fixes {
 public:
  Fixes(const SupervisedMap& map, link::Bus& bus, Clock& clock, Supervision& supervision)
      : supervision_(supervision), matcher_(map.surface, nullptr, map.noise, 0, OnLate::kPoll) {
    bus.listen<RangeScan>(
        link::channel::kRange,
        [this, &clock](RangeScan scan) {
          if (!supervision_.wants_fixes()) return;
          scan.utime = supervision_.own_time(scan.utime);
          matcher_.submit(scan, clock.now());
        },
        link::kMaxScanPacket);
  }

  void step(Utime now) {
    if (const std::optional<MapFix> fix = matcher_.poll(now)) supervision_.receive(*fix);
    if (supervision_.wants_fixes()) matcher_.observe(supervision_.estimate());
  }

 private:
  Supervision& supervision_;
  MapMatchService matcher_;
};

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
  std::optional<Fixes> fixes;
  if (settings.map) fixes.emplace(*settings.map, bus, clock, supervision);
  link::Packet packet;
  while (wanted() && !supervision.is_over(clock.now())) {
    bus.wait(clock, clock.now() + kPeriod);
    const std::optional<link::VehicleCommand> command = supervision.step(clock.now());
    if (command && link::encode(*command, packet)) bus.publish(link::channel::kCommand, packet);
    if (fixes) fixes->step(clock.now());
  }
  return supervision.report();
}

}  // namespace dive::mission
