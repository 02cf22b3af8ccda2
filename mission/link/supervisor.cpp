#include "mission/link/supervisor.h"

#include <optional>

#include <fmt/format.h>

#include "vehicle/link/codec.h"

namespace dive::mission {
namespace {

constexpr Utime kPeriod = 50'000;       // us between its own commands
constexpr double kAtSurface = 0.3;      // m
constexpr double kRestAtSurface = 5.0;  // s

class Supervisor {
 public:
  Supervisor(const SupervisorSettings& settings, link::Bus& bus, Clock& clock)
      : settings_(settings), bus_(bus), clock_(clock) {
    bus_.listen<link::VehicleCommand>(link::channel::kCommand,
                                      [this](const link::VehicleCommand& said) {
                                        if (said.source != link::Source::kExecutive) return;
                                        if (command_ && said.utime <= command_->utime)
                                          return;  // a hanging executive, or an echo of its command
                                        command_ = said;
                                        commanded_at_ = clock_.now();
                                      });
    bus_.listen<link::Heartbeat>(
        link::channel::kHeartbeat,
        [this](const link::Heartbeat& heartbeat) { finished_ = heartbeat.finished; });
    bus_.listen<ImuSample>(link::channel::kAhrs, [this](const ImuSample& sample) {
      keep_time(sample.utime);
      yaw_ = to_rpy(sample.q_WB).z();
    });
    bus_.listen<DepthSample>(link::channel::kDepth, [this](const DepthSample& sample) {
      keep_time(sample.utime);
      depth_m_ = sample.depth_m;
    });
  }

  SupervisorReport run(const SupervisorLog& log, const std::function<bool()>& wanted) {
    while (wanted() && !is_over()) {
      bus_.wait(clock_, clock_.now() + kPeriod);
      if (!command_) continue;
      if (!report_.took_over && !finished_ && command_timeout_s() > settings_.command_timeout_s)
        take_over(log);
      if (report_.took_over) bring_up();
    }
    if (report_.surfaced) log("the vehicle is at the surface");
    return report_;
  }

 private:
  // The vehicle's time, with which its commands must be stamped.
  void keep_time(Utime utime) {
    vehicle_time_ = utime;
    vehicle_time_at_ = clock_.now();
  }
  [[nodiscard]] Utime vehicle_time() const {
    const Utime now = clock_.now();
    const Utime since_command = command_->utime + (now - commanded_at_);
    return vehicle_time_ ? *vehicle_time_ + (now - vehicle_time_at_) : since_command;
  }

  [[nodiscard]] double command_timeout_s() const {
    return to_seconds(clock_.now() - commanded_at_);
  }
  [[nodiscard]] bool is_over() const {
    return report_.took_over ? report_.surfaced : finished_ && command_;
  }

  void take_over(const SupervisorLog& log) {
    report_.took_over = true;
    report_.silent_s = command_timeout_s();
    heading_ = yaw_;
    log(fmt::format("no command of the executive for {:.1f} s: taking over, to the surface",
                    report_.silent_s));
  }

  void bring_up() {
    link::VehicleCommand up;
    up.utime = vehicle_time();
    up.sequence = ++sequence_;
    up.source = link::Source::kSupervisor;
    up.mode = link::Mode::kDepthAndAngles;
    up.command.o = from_rpy(0.0, 0.0, heading_);
    if (link::encode(up, packet_)) bus_.publish(link::channel::kCommand, packet_);
    if (!(depth_m_ < kAtSurface)) up_since_ = clock_.now();  // NaN does not count as the surface
    report_.surfaced = to_seconds(clock_.now() - up_since_) > kRestAtSurface;
  }

  const SupervisorSettings& settings_;
  link::Bus& bus_;
  Clock& clock_;
  std::optional<link::VehicleCommand> command_;  ///< The executive's last command.
  Utime commanded_at_ = 0;
  bool finished_ = false;
  std::optional<Utime> vehicle_time_;
  Utime vehicle_time_at_ = 0;
  double yaw_ = 0.0;
  double heading_ = 0.0;
  double depth_m_ = 1e9;
  Utime up_since_ = 0;
  std::int64_t sequence_ = 0;
  link::Packet packet_;
  SupervisorReport report_;
};

}  // namespace

SupervisorReport supervise(const SupervisorSettings& settings, link::Bus& bus, Clock& clock,
                           const SupervisorLog& log, const std::function<bool()>& wanted) {
  return Supervisor(settings, bus, clock).run(log, wanted);
}

}  // namespace dive::mission
