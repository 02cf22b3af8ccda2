#pragma once
// The behaviour of an atomic state: once per control tick it computes a command from the estimate,
// may request a plan, and reports when it is done. Behaviours read no clock and draw no random
// number; the same inputs give the same outputs.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/clock.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"
#include "planning/plan.h"
#include "vehicle/command.h"

namespace dive::behaviors {

class Trail;

/// Evaluates a path against obstacles observed since it was planned.
class PathEvaluator {
 public:
  virtual ~PathEvaluator() = default;
  /// Lower bound (m) of the clearance between the motion through `waypoints` and the obstacles
  /// added to the map. It may be less than the true clearance when the obstacles are far away.
  [[nodiscard]] virtual double clearance(std::span<const Pose> waypoints) = 0;
  /// Lower bound (m) of the clearance to all obstacles, those of the known map included: for
  /// motions that no plan contains.
  [[nodiscard]] virtual double clearance_to_all(std::span<const Pose> waypoints) = 0;
};

/// Time after which a request without an answer has failed.
inline constexpr double kPlanTimeout = 10.0;  // s

struct BehaviorInput {
  Utime now = 0;  ///< Time on the behaviours' clock, which stops during a hold.
  const estimation::StateEstimate* estimate = nullptr;  ///< Estimate; never null, always valid.
  Eigen::Vector2d current_W = Eigen::Vector2d::Zero();  ///< Declared current, m/s.
  const planning::PlanResult* plan = nullptr;  ///< Answer to the last request; null: none yet.
  const Trail* trail = nullptr;                ///< Trail of the vehicle; null: not recorded.
  PathEvaluator* observed = nullptr;  ///< Obstacles added to the map; null: there are none.
  bool map_changed = false;           ///< True if the map has changed since the last tick.
  bool map_opened = false;  ///< True in the tick in which an object of the map is found to be gone.
  bool position_corrected = false;  ///< True in the tick in which the position jumps.
  bool trail_moved = false;         ///< True in the tick in which a loop closure moves the trail.
  bool obstacle_ahead = false;      ///< True in the tick in which the vehicle is stopped for one.
  bool replan = false;              ///< True if a failsafe requests a replan.
  bool depth_known = true;          ///< True while depth samples are fresh.
  bool attitude_known =
      true;                ///< True while attitude samples are fresh; else no motion is allowed.
  bool can_go_up = false;  ///< True if the water above the vehicle is open.
};

/// When the path ahead is evaluated again: whenever the map has changed, and four times a second
/// while it stays as it is, since what it shows of that path changes while the vehicle swims.
class PathCheck {
 public:
  /// True if it is due now; the next one counts from there.
  [[nodiscard]] bool is_due(const BehaviorInput& input) {
    if (!input.map_changed && input.now < next_) return false;
    next_ = input.now + kPeriod;
    return true;
  }

 private:
  static constexpr Utime kPeriod = 250'000;  // us
  Utime next_ = 0;
};

/// Progress of a behaviour, for status, guards and drawings.
struct Progress {
  std::string goal;               ///< Id of the present goal; empty without one.
  double distance_to_go_m = 0.0;  ///< Distance to the goal along the path, m.
  double clearance_m = 0.0;       ///< Certified clearance of the path being followed, m.
  double cross_track_m = 0.0;     ///< Distance from the path, m.
  int segment = 0;                ///< Index of the present segment of the path.
  /// True after an observed obstacle has left the rest of the path less clearance than required,
  /// until another path is followed.
  bool path_is_blocked = false;
  /// True once it follows its trail whatever is mapped on it, until it follows another path: by the
  /// map it is inside an obstacle.
  bool trusts_trail = false;
  double elapsed_s = 0.0;    ///< Time since the leg began, s.
  double expected_s = 0.0;   ///< Duration of the leg's first path, s; 0 while there is none.
  int plan_failures = 0;     ///< Number of failed plans in a row.
  std::string plan_failure;  ///< Reason of the last failure.
};

enum class Failure {
  kNone,
  kUnreachable,  ///< Two plans to the goal failed in a row; planning continues until the state
                 ///< exits.
  kExhausted,    ///< No replans are left, or the exit path cannot be followed.
};

struct BehaviorOutput {
  vehicle::Command command;
  std::optional<planning::PlanRequest> plan_request;
  const char* plan_cause = "";      ///< Reason of the request.
  bool done = false;                ///< True in the tick in which done.state.ID is due.
  Failure failed = Failure::kNone;  ///< Failure for which plan.failed.ID is due.
  bool brakes = false;  ///< True if it stops by reverse thrust; by drag alone that takes 3 s.
};

/// The behaviour of an atomic state, from entry to exit.
class Behavior {
 public:
  virtual ~Behavior() = default;
  [[nodiscard]] virtual BehaviorOutput step(const BehaviorInput& input) = 0;
  [[nodiscard]] virtual const Progress& progress() const = 0;
  /// Number of goals that were reached or skipped.
  [[nodiscard]] virtual int goals_done() const { return 0; }
  /// True if it swims where the vehicle has not been: in an unknown environment its speed is
  /// limited by the observed free space ahead.
  [[nodiscard]] virtual bool needs_free_ahead() const { return false; }
  /// Sets `way` to the poses that it means to take from X_WB on, within `seconds` at full speed;
  /// empty if it does not follow a path.
  virtual void way_ahead(const Pose& /*X_WB*/, double /*seconds*/, std::vector<Pose>& way) const {
    way.clear();
  }
  /// True for a vertical ascent in open water.
  [[nodiscard]] virtual bool rises() const { return false; }
  /// Called when the path ahead stayed unobserved too long: on the next tick the behaviour requests
  /// an alternative path. Returns false if it has none.
  [[nodiscard]] virtual bool request_alternative() { return false; }
  /// Skips the present goal at topside's request; false if the state has no goals to skip.
  [[nodiscard]] virtual bool skip() { return false; }
};

/// Yaw of a pose, rad.
[[nodiscard]] inline double yaw_of(const Pose& pose) { return to_rpy(pose.q).z(); }

/// Keeps depth and heading without forward speed.
[[nodiscard]] vehicle::Command station_keeping(double depth_m, double yaw);

}  // namespace dive::behaviors
