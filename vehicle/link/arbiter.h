#pragma once
// The vehicle's end of the link: which commands it obeys, and its reaction when they stop.

#include <optional>

#include "common/clock.h"
#include "common/measurements.h"
#include "common/motion_model.h"
#include "vehicle/command_timing.h"
#include "vehicle/exit_guidance.h"
#include "vehicle/link/codec.h"
#include "vehicle/link/command_gate.h"
#include "vehicle/own_autopilot.h"

namespace dive::link {

/// Obeys the supervisor while it sends commands, otherwise the executive. Efforts expire:
/// kCommandStale after the last command the vehicle stops, and its own autopilot keeps the
/// commanded depth and attitude; kCommandTimeout after it, the vehicle brings itself home by the
/// rules of ExitGuidance (vehicle/command_timing.h).
class Arbiter {
 public:
  enum class CommandSource { kNone, kExecutive, kSupervisor };

  /// For a vehicle with that motion model. `session_timeout_s`: see CommandGate; 0 where the
  /// vehicle's time stops with the executive.
  explicit Arbiter(const MotionModel& motion = {},
                   double session_timeout_s = to_seconds(vehicle::kSessionTimeout));

  /// Receives a command; false if it is refused (CommandGate).
  bool receive(const VehicleCommand& command, Utime now);
  /// Receives the exit path of the executive that is obeyed; false if it is not used.
  bool receive(const ExitPathMessage& message);

  /// The efforts from `now` on, by the newest samples of the vehicle's own sensors.
  [[nodiscard]] vehicle::PseudoRates step(const std::optional<ImuSample>& imu,
                                          const std::optional<DepthSample>& depth, Utime now);

  [[nodiscard]] CommandSource source(Utime now) const;
  /// What the vehicle does by itself; kIdle while it obeys a command.
  [[nodiscard]] vehicle::ExitPhase phase() const { return guidance_.phase(); }
  /// The executive's newest command.
  [[nodiscard]] const std::optional<VehicleCommand>& executive() const {
    return executive_.newest();
  }
  [[nodiscard]] bool is_from_executive(std::uint64_t session_id) const {
    return executive_.is_from(session_id);
  }
  [[nodiscard]] std::int64_t refused() const {
    return executive_.refused() + supervisor_.refused();
  }

 private:
  [[nodiscard]] const CommandGate* current(Utime now) const;
  [[nodiscard]] vehicle::PseudoRates efforts(Utime now);

  CommandGate executive_;
  CommandGate supervisor_;
  vehicle::OwnAutopilot autopilot_;
  vehicle::ExitGuidance guidance_;
  vehicle::PseudoRates rates_;  ///< Efforts since the last step.
};

/// The efforts from `now` on by which the vehicle executes a command of age `age_s`: the command's
/// own, or those of its autopilot, which stops it when the command is older than kCommandStale.
/// `surge`: see OwnAutopilot.
[[nodiscard]] vehicle::PseudoRates execute(const VehicleCommand& command, double age_s,
                                           double surge, Utime now,
                                           vehicle::OwnAutopilot& autopilot);

}  // namespace dive::link
