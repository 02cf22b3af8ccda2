#pragma once
// The choice of roll in a narrow passage. Between a level hull and one rolled onto its side are
// attitudes with a larger extent than both, so a gradient-based optimiser moves from one to the
// other only by chance. Here the rolls along a path are chosen from a few candidates by dynamic
// programming, with positions and directions unchanged.

#include <span>
#include <vector>

#include "common/se3.h"
#include "planning/trajopt/sweep_contacts.h"
#include "planning/trajopt/trajopt.h"

namespace dive::planning {

struct RollSearch {
  std::vector<Pose> path;    ///< The path with the best rolls found.
  double cost = 0.0;         ///< Obstacle and turn cost of `path`.
  double cost_before = 0.0;  ///< Obstacle and turn cost of the unchanged path.
};

/// Searches the rolls of every waypoint except the first, and except the last if the goal's
/// attitude is fixed. Evaluates the swept hull between waypoints: O(waypoints * rolls^2) distance
/// queries near obstacles.
[[nodiscard]] RollSearch search_rolls(const TrajoptProblem& problem, const TrajoptOptions& options,
                                      SweepContacts& sweep, std::span<const Pose> path);

}  // namespace dive::planning
