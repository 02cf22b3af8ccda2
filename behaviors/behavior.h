#pragma once
// What a leaf state of a mission does: once per control tick it turns an estimate into a command,
// may ask for a plan, and says when it is done. Behaviours read no clock and draw no random
// number; the same inputs give the same outputs.

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/clock.h"
#include "common/se3.h"
#include "estimation/state_estimate.h"
#include "planning/plan.h"
#include "vehicle/command.h"

namespace dive::behaviors {

class Trail;

/// Judges a path against what the map has shown since it was planned.
class PathEvaluator {
 public:
  virtual ~PathEvaluator() = default;
  /// Proved clearance (m) of the motion through `waypoints` to what was added to the map; of what
  /// is far away it may say no more than that.
  [[nodiscard]] virtual double clearance(std::span<const Pose> waypoints) = 0;
};

/// A planner that takes longer has failed.
inline constexpr double kPlanTimeout = 10.0;  // s

struct BehaviorInput {
  Utime now = 0;  ///< On the behaviours' clock, which stands still while the vehicle is held.
  const estimation::StateEstimate* estimate = nullptr;  ///< Never null, always valid.
  const planning::PlanResult* plan = nullptr;  ///< Answer to the last request; null: none yet.
  const Trail* trail = nullptr;                ///< Where it has been; null: not known.
  PathEvaluator* observed = nullptr;  ///< Of what the map did not know; null: nothing was seen.
  bool map_changed = false;           ///< Since the last tick.
  bool replan = false;                ///< A failsafe demands it.
  bool depth_known = true;            ///< The depth sensor works.
  bool attitude_known = true;         ///< The attitude sensor works; without it nothing is swum.
  bool can_go_up = false;             ///< Straight up from here there is only water.
};

/// How far along; for status, guards and pictures.
struct Progress {
  std::string goal;               ///< Goal headed for; empty without one.
  double distance_to_go_m = 0.0;  ///< Along the path.
  double clearance_m = 0.0;       ///< Certified, of the path being followed.
  double cross_track_m = 0.0;
  int segment = 0;
  /// An observed obstacle has left the rest of the path less clearance than it may keep; until
  /// another path is followed.
  bool path_is_blocked = false;
  double elapsed_s = 0.0;    ///< Since the leg began ...
  double expected_s = 0.0;   ///< ... and what its first path takes; 0 while there is none.
  int plan_failures = 0;     ///< In a row.
  std::string plan_failure;  ///< Why the last one failed.
};

enum class Failure {
  kNone,
  kUnreachable,  ///< No path to the goal, twice in a row; it is tried again until left.
  kExhausted,    ///< No replans are left, or the way out cannot be swum.
};

struct BehaviorOutput {
  vehicle::Command command;
  std::optional<planning::PlanRequest> plan_request;
  const char* plan_cause = "";      ///< Why it is asked for.
  bool done = false;                ///< The executive raises done.state.ID.
  Failure failed = Failure::kNone;  ///< It cannot go on: plan.failed.ID.
};

/// A leaf state's behaviour, from entry to exit.
class Behavior {
 public:
  virtual ~Behavior() = default;
  [[nodiscard]] virtual BehaviorOutput step(const BehaviorInput& input) = 0;
  [[nodiscard]] virtual const Progress& progress() const = 0;
  /// How many goals have been left behind.
  [[nodiscard]] virtual int goals_done() const { return 0; }
  /// Swims where the vehicle has not been: in an unknown environment no farther than the sensor has
  /// observed free space ahead.
  [[nodiscard]] virtual bool needs_free_ahead() const { return false; }
  /// Goes straight up in open water.
  [[nodiscard]] virtual bool rises() const { return false; }
  /// The path ahead was not observed for too long: on the next tick the behaviour looks for
  /// another. False: it has none.
  [[nodiscard]] virtual bool request_alternative() { return false; }
  /// Topside wants what is being done now to be left out; false: there is nothing but the whole.
  [[nodiscard]] virtual bool skip() { return false; }
};

/// Keeps depth and heading without forward speed.
[[nodiscard]] vehicle::Command station_keeping(double depth_m, double yaw);

}  // namespace dive::behaviors
