#pragma once
// Whether the vehicle makes progress against the declared current on every leg.
//
// On each line of a leg the current of the time when the vehicle is expected there, u, is made
// worse by its standard deviation, both against the line and across it:
//
//   along = e.u - sigma    across = |u - (e.u) e| + sigma    g = along + sqrt(V^2 - across^2)
//
// (common/ground_speed.h). Under an overhead the opposite direction counts as well: there an abort
// swims back.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/diagnostic.h"
#include "mission/check/route.h"
#include "mission/check/route_plan.h"
#include "mission/check/route_times.h"
#include "mission/document/mission.h"
#include "planning/world/world.h"

namespace dive::mission {

/// Least share of the speed through the water that must remain over ground. Retraces and other
/// recoveries allow four times the ordinary time.
inline constexpr double kLeastProgress = 0.25;
/// A smaller share is warned of.
inline constexpr double kSlowProgress = 0.5;

/// The line of a leg with the least progress.
struct LeastProgress {
  double share = std::numeric_limits<double>::infinity();  ///< g / V; below 0: carried backwards.
  double over_ground = 0.0;  ///< g, m/s; 0 if the vehicle cannot stay on the line.
  double crab_rad = 0.0;     ///< Crab angle; pi/2 if the vehicle cannot stay on the line.
  double elapsed_s = 0.0;    ///< Expected time there, s.
  bool is_way_back = false;  ///< In the opposite direction, in an abort.
  Eigen::Vector3d place_W = Eigen::Vector3d::Zero();  ///< Start of the line, m.
};

/// Least progress on each leg of the route; no value for a leg whose path has no length. `radius`
/// (m) is that of the hull's bounding sphere.
[[nodiscard]] std::vector<std::optional<LeastProgress>> least_progress(
    const Route& route, const std::vector<PlannedRouteLeg>& legs, const Mission& mission,
    const planning::World& world, double radius);

/// Reports legs on which the current is too strong (CHK-CURRENT) or strong (CHK-CURRENT-MARGIN), a
/// table that ends before the route (CHK-CURRENT-TABLE), and rests in which the current carries the
/// vehicle away (CHK-CURRENT-DRIFT).
/// `progress` is least_progress().
void check_current(const Route& route, const std::vector<PlannedRouteLeg>& legs,
                   const std::vector<std::optional<LeastProgress>>& progress,
                   const Mission& mission, Diagnostics& diagnostics);

}  // namespace dive::mission
