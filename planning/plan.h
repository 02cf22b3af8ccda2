#pragma once
// A request to the planner and its result. Both are the same values in the behaviour that makes the
// request, in the planner and in the log: nothing in them depends on the machine. The time that a
// plan took is in PlannerStatistics (planner.h).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/se3.h"
#include "planning/motion_limits.h"

namespace dive::planning {

struct PlanRequest {
  Pose start;                        ///< X_WB
  Pose goal;                         ///< X_WB; without a fixed attitude only its position counts.
  bool goal_attitude_fixed = false;  ///< True if the goal's attitude must be reached as well.
  MotionLimits limits;
  std::uint64_t seed = 1;      ///< Seed of the planner's random draws.
  std::vector<Pose> previous;  ///< Path to start from (replanning), X_WB; may be empty.
  /// Level poses along the vehicle's trail from about the start to about the goal, X_WB: where the
  /// direct path fails, the way that it has come by is tried before any other; may be empty.
  std::vector<Pose> trail;
};

/// Share of D_min: a path from a start with less clearance than this may not lose any before it
/// reaches D_min.
inline constexpr double kMinStartClearance = 0.85;
/// Largest length of path from such a start to the first place with D_min, m.
inline constexpr double kMaxReducedLength = 2.0;

enum class PlanStatus {
  kSuccess,  ///< The path is certified at D_min or better.
  kReduced,  ///< The start lacks D_min: the path first keeps the start's clearance, or
             ///< kMinStartClearance of D_min if the start has more, and then D_min; see `reduced`.
  kNoPath,   ///< Blocked, too narrow, or no path found within the bounds of the search; see
             ///< `reason`.
  kInvalid,  ///< Invalid request: NaN, start or goal in collision, out of limits.
};
inline constexpr PlanStatus kLastPlanStatus = PlanStatus::kInvalid;

[[nodiscard]] const char* to_string(PlanStatus status);

/// A plan of this status has a path that can be followed, if the caller accepts it.
[[nodiscard]] constexpr bool has_path(PlanStatus status) {
  return status == PlanStatus::kSuccess || status == PlanStatus::kReduced;
}

/// The part of a kReduced path that is nearer to something than D_min. It begins at the start.
struct NarrowPart {
  double length_m = 0.0;  ///< Length along the path, m; the rest keeps D_min.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();  ///< B's origin where the hull is nearest, m.
  std::string obstacle;                               ///< Name of the nearest obstacle there.
};

struct PlanResult {
  PlanStatus status = PlanStatus::kInvalid;
  /// True if the path may be followed: a success, or reduced and at least `reduced_clearance`.
  bool accepted = false;
  std::string reason;                 ///< Why there is no path, or only a reduced one.
  std::optional<NarrowPart> reduced;  ///< With kReduced: the part of the path short of D_min.
  /// X_WB along the path. In a plan that is not accepted, the best path found, for display only;
  /// PlannerService removes it.
  std::vector<Pose> waypoints;
  double clearance_m = 0.0;  ///< Certified clearance, m; on kNoPath that of the best found.
  double length_m = 0.0;     ///< Length of the path, m.
  int warm_starts = 0;       ///< Number of warm starts it took.
};

}  // namespace dive::planning
