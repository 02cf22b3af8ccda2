#pragma once
// Brings the vehicle home without executive and plan: holds, follows the exit path by dead
// reckoning on depth, compass and the efforts of the flippers, then ascends. Map fixes, where
// the owner has them, correct the dead reckoning from the begin of the hold on. One set of rules
// for the supervisor, the vehicle's own timeout and the executive's fallback
// (doc/decisions/no-commands.md).

#include <optional>

#include "common/clock.h"
#include "common/map_fix.h"
#include "common/measurements.h"
#include "estimation/frame_correction.h"
#include "estimation/primitive.h"
#include "vehicle/command.h"
#include "vehicle/exit_path.h"
#include "vehicle/follower.h"

namespace dive::vehicle {

enum class ExitPhase {
  kIdle,       ///< Another process commands the vehicle.
  kHolding,    ///< Stops and keeps depth and heading.
  kFollowing,  ///< Follows the exit path.
  kAscending,  ///< Ascends vertically.
};
inline constexpr ExitPhase kLastExitPhase = ExitPhase::kAscending;

[[nodiscard]] const char* to_string(ExitPhase phase);

/// All times are on the owner's clock. Allocates only in set_exit_path() and when it begins to
/// follow.
class ExitGuidance {
 public:
  static constexpr double kUnknownHold = 30.0;  ///< Hold without an exit path or open water, s.
  static constexpr double kSurfaceTime = 2.0;   ///< Time at the surface until it counts, s.

  /// For a vehicle with that motion model. `fixes`: what is expected of dead reckoning and map,
  /// present where map fixes are proposed; the exit path replaces its sigma at the start.
  explicit ExitGuidance(const MotionModel& motion = {},
                        std::optional<estimation::MapFixOptions> fixes = std::nullopt);

  /// The newest exit path, which also gives the present position. False if it is not used: its
  /// values are implausible, or the vehicle follows or ascends already.
  bool set_exit_path(const ExitPath& path);

  /// New samples of attitude (compass, AHRS) and depth. Advances the dead reckoning to `now`:
  /// `efforts` are those that the vehicle has executed since the last call, of any source.
  void observe(const std::optional<ImuSample>& imu, const std::optional<DepthSample>& depth,
               const PseudoRates& efforts, Utime now);

  /// A fix of a scan taken since begin(), in the frame of estimate(); its time on the owner's
  /// clock. Ignored without fixes. False if its position was not used.
  bool propose(const MapFix& fix);

  /// Begins to hold, or to leave at once where `may_hold` is false.
  void begin(Utime now, bool may_hold = true);
  /// Another process commands the vehicle again.
  void end() { phase_ = ExitPhase::kIdle; }

  /// Command of this moment, in the compass's frame. Requires begin().
  [[nodiscard]] Command step(Utime now);

  [[nodiscard]] ExitPhase phase() const { return phase_; }
  /// Dead reckoning from the exit path's pose on, with map fixes: `map_from_odom` is what they
  /// have corrected. Without them the covariance of the position is that of the exit path.
  [[nodiscard]] const estimation::StateEstimate& estimate() const { return estimate_; }
  /// Speed through the water, m/s.
  [[nodiscard]] double surge() const { return odometry_.v_B().x(); }
  /// True if the depth sensor has measured the surface for kSurfaceTime.
  [[nodiscard]] bool has_surfaced(Utime now) const;
  /// True if there is no depth sensor and the ascent has lasted long enough.
  [[nodiscard]] bool is_presumed_surfaced(Utime now) const;
  /// True if it left an overhead without an exit path, or did not arrive at its end in time.
  [[nodiscard]] bool ascended_blindly() const { return ascended_blindly_; }

 private:
  [[nodiscard]] static bool is_plausible(const ExitPath& path);
  void leave(Utime now);
  void follow(std::vector<Pose> path, Utime now);
  void ascend(Utime now, bool blindly);
  void dead_reckon(const estimation::StateEstimate& odometry);
  void begin_correction();
  void keep_station();
  [[nodiscard]] Command hold() const;
  [[nodiscard]] double hold_s() const;
  [[nodiscard]] bool depth_is_fresh(Utime now) const;

  MotionModel motion_;
  std::optional<ExitPath> path_;
  estimation::PrimitiveEstimator odometry_;
  std::optional<estimation::StateEstimate> last_odometry_;
  Eigen::Vector2d last_excess_W_ = Eigen::Vector2d::Zero();  ///< At last_odometry_, m.
  /// Horizontal position by odometry with the exit path's scale and current, m.
  Eigen::Vector2d reckoned_W_ = Eigen::Vector2d::Zero();
  std::optional<estimation::MapFixOptions> fixes_;
  /// By map fixes, on top of these; from begin() on.
  std::optional<estimation::FrameCorrection> correction_;
  estimation::StateEstimate estimate_;
  Follower follower_;
  ExitPhase phase_ = ExitPhase::kIdle;
  Command command_;                        ///< Last command, in W.
  double heading_correction_ = 0.0;        ///< rad
  std::optional<double> depth_;            ///< Last measured depth, m.
  Utime depth_at_ = 0;                     ///< Its time.
  std::optional<Utime> at_surface_since_;  ///< By the depth sensor.
  Utime now_ = 0;
  Utime since_ = 0;         ///< Begin of the phase.
  double allowed_s_ = 0.0;  ///< Time allowed for the phase, s.
  double station_depth_ = 0.0;
  double station_yaw_ = 0.0;  ///< In W.
  bool ascended_blindly_ = false;
};

}  // namespace dive::vehicle
