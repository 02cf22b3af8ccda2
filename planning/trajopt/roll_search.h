#pragma once
// Which way to lie in a narrow place. Between a level hull and one that is turned onto its side lie
// attitudes that are wider than both, so an optimiser that follows slopes finds its way from the
// one to the other only by luck. Here the rolls along a path are chosen from a few by dynamic
// programming, positions and directions staying as they are.

#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/trajopt/sweep_contacts.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {

struct RollSearch {
  std::vector<Pose> path;    ///< With the best rolls found.
  double cost = 0.0;         ///< Obstacle and turn cost of `path`.
  double cost_before = 0.0;  ///< ... of the path as it was.
};

/// Rolls of every waypoint but the first, and but the last where the goal's attitude is fixed.
/// Looks at the swept hull between waypoints: O(waypoints * rolls^2) distance queries near
/// obstacles.
[[nodiscard]] RollSearch search_rolls(const TrajoptProblem& problem, const TrajoptOptions& options,
                                      SweepContacts& sweep, std::span<const Pose> path);

}  // namespace dive::planning
