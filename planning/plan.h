#pragma once
// A question to the planner and its answer. Both are the same values from the behaviour that asks
// to the planner and back, and in the log: nothing in them depends on the machine. What a plan has
// cost stands in PlannerStatistics (planner.h).

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
};

/// Share of D_min: a path out of a start that has less must not reduce the clearance.
inline constexpr double kMinStartClearance = 0.85;
/// Longest path from a start that lacks D_min to a place that has it, m.
inline constexpr double kMaxReducedLength = 2.0;

enum class PlanStatus {
  kSuccess,  ///< The path is certified at D_min or better.
  kReduced,  ///< The start lacks D_min: the path leaves it at no less than the lesser of what the
             ///< start has and kMinStartClearance, and then keeps D_min; see `reduced`.
  kNoPath,   ///< None: blocked, too tight, or none found within the bound; see `reason`.
  kInvalid,  ///< The request is invalid: NaN, start or goal in collision, out of limits.
};

[[nodiscard]] const char* to_string(PlanStatus status);

/// A plan of this status has a path that can be followed, if the caller accepts it.
[[nodiscard]] constexpr bool has_path(PlanStatus status) {
  return status == PlanStatus::kSuccess || status == PlanStatus::kReduced;
}

/// The part of a kReduced path with less clearance than D_min. It begins at the start.
struct NarrowPart {
  double length_m = 0.0;  ///< Length along the path, m; the rest keeps D_min.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();  ///< B's origin where the hull is nearest, m.
  std::string obstacle;                               ///< Name of the nearest obstacle there.
};

struct PlanResult {
  PlanStatus status = PlanStatus::kInvalid;
  /// True if the path may be followed: a success, or reduced and at least `reduced_clearance`.
  bool accepted = false;
  std::string reason;                 ///< Reason for no path, or for a reduced one.
  std::optional<NarrowPart> reduced;  ///< Place of the least clearance; only on kReduced.
  /// X_WB along the path. If the plan is not accepted, the best path found, for drawings only;
  /// PlannerService leaves it out.
  std::vector<Pose> waypoints;
  double clearance_m = 0.0;  ///< Certified clearance, m; on kNoPath that of the best found.
  double length_m = 0.0;     ///< Length of the path, m.
  int warm_starts = 0;       ///< Number of warm starts it took.
};

}  // namespace dive::planning
