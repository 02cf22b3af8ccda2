#pragma once
// The vehicle's end of the link: whom it obeys, and what it does when nobody speaks.

#include <optional>

#include "common/clock.h"
#include "common/measurements.h"
#include "vehicle/autopilot.h"
#include "vehicle/link/codec.h"

namespace dive::link {

/// Obeys the newest command of the supervisor, or the newest of the executive where the supervisor
/// is silent. Efforts are good for a moment only: kStale after the last command it stops, and its
/// own autopilot keeps the depth and attitude commanded; kTimeout after it, it surfaces.
class Arbiter {
 public:
  static constexpr double kStale = 0.2;     ///< s, as vehicle_command_t.lcm says.
  static constexpr double kTimeout = 1.0;   ///< s, likewise.
  static constexpr double kMaxAhead = 5.0;  ///< s that a command's time may be ahead: clocks drift.
  static constexpr double kMaxDepth = 500.0;  ///< m: a greater one is no command.

  enum class Obeys { kNobody, kExecutive, kSupervisor };

  explicit Arbiter(vehicle::AutopilotOptions autopilot = {});

  /// Hears a command; false when it is refused: older than one of the same source, ahead of time,
  /// or with numbers that are no command.
  bool hear(const VehicleCommand& command, Utime now);

  /// The effort for the tick that ends at `now`; the samples are the vehicle's own, newest last.
  [[nodiscard]] vehicle::PseudoRates step(const std::optional<ImuSample>& imu,
                                          const std::optional<DepthSample>& depth, Utime now);

  [[nodiscard]] Obeys obeys(Utime now) const;
  /// The executive's newest command.
  [[nodiscard]] const std::optional<VehicleCommand>& executive() const { return heard_[0]; }
  [[nodiscard]] std::int64_t refused() const { return refused_; }

 private:
  [[nodiscard]] const VehicleCommand* current(Utime now) const;

  std::optional<VehicleCommand> heard_[2];  ///< By Source.
  Utime heard_at_[2] = {0, 0};
  std::int64_t refused_ = 0;
  vehicle::Autopilot autopilot_;
  std::optional<ImuSample> imu_;
  std::optional<DepthSample> depth_;
  double yaw_ = 0.0;
  std::optional<Utime> last_step_;
};

}  // namespace dive::link
