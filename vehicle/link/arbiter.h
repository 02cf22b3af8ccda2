#pragma once
// The vehicle's end of the link: which commands it obeys, and its reaction when they stop.

#include <optional>

#include "common/clock.h"
#include "common/measurements.h"
#include "vehicle/autopilot.h"
#include "vehicle/link/codec.h"

namespace dive::link {

/// Obeys the newest command of the supervisor, or the newest of the executive while there is none
/// from the supervisor. Efforts expire: kStale after the last command the vehicle stops, and its
/// own autopilot keeps the commanded depth and attitude; kTimeout after it, the vehicle surfaces.
class Arbiter {
 public:
  static constexpr double kStale = 0.2;       ///< Lifetime of an effort, s (vehicle_command_t.lcm).
  static constexpr double kTimeout = 1.0;     ///< Age that surfaces, s (vehicle_command_t.lcm).
  static constexpr double kMaxAhead = 5.0;    ///< Tolerated lead of a command, s, for clock drift.
  static constexpr double kMaxDepth = 500.0;  ///< Maximum plausible depth command, m.

  enum class CommandSource { kNone, kExecutive, kSupervisor };

  explicit Arbiter(vehicle::AutopilotOptions autopilot = {});

  /// Receives a command; false if it is rejected: older than one of the same source, ahead of time,
  /// or with implausible values.
  bool receive(const VehicleCommand& command, Utime now);

  /// The effort for the tick that ends at `now`, from the newest samples of the vehicle's own
  /// sensors.
  [[nodiscard]] vehicle::PseudoRates step(const std::optional<ImuSample>& imu,
                                          const std::optional<DepthSample>& depth, Utime now);

  [[nodiscard]] CommandSource source(Utime now) const;
  /// The executive's newest command.
  [[nodiscard]] const std::optional<VehicleCommand>& executive() const { return commands_[0]; }
  [[nodiscard]] std::int64_t refused() const { return refused_; }

 private:
  [[nodiscard]] const VehicleCommand* current(Utime now) const;

  std::optional<VehicleCommand> commands_[2];  ///< Newest command by Source.
  Utime arrived_at_[2] = {0, 0};
  std::int64_t refused_ = 0;
  vehicle::Autopilot autopilot_;
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  double yaw_ = 0.0;
  std::optional<Utime> last_step_;
};

}  // namespace dive::link
