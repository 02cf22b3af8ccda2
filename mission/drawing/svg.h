#pragma once
// Drawings of a plan or a dive as one SVG file.

#include <string>
#include <utility>
#include <vector>

#include "common/se3.h"
#include "mission/record/collision.h"
#include "planning/world/world.h"

namespace dive::mission {

struct PlannedLeg {
  std::string name;
  std::vector<Pose> waypoints;
  double clearance_m = 0.0;
  double narrow_m = 0.0;  ///< Distance from the start with less than the drawing's clearance.
};

struct ErrorSample {
  double t_s = 0.0;
  double error_m = 0.0;  ///< Distance to the line p_{i-1} p_i.
  bool new_waypoint = false;
};

struct DiveDrawing {
  std::string title;
  const planning::World* world = nullptr;
  const planning::RobotHull* hull = nullptr;
  double clearance_required_m = 0.0;  ///< D_min
  std::vector<PlannedLeg> legs;
  std::vector<std::pair<std::string, Eigen::Vector3d>> goals;
  std::vector<Eigen::Vector3d> swum;       ///< Ground truth; empty for a plan.
  std::vector<Eigen::Vector3d> estimated;  ///< Estimated positions.
  std::vector<ErrorSample> errors;         ///< Empty for a plan.
  std::vector<Collision> collisions;       ///< Empty for a plan.
};

/// Top view (x, y), side view (x, z) with the surface, and, for a dive, the error diagram of the
/// paper: error over time, waypoints as ticks, D_min as a line. Each collision is marked in all
/// three, the first few with obstacle and time. Self-contained SVG 1.1.
[[nodiscard]] std::string render_svg(const DiveDrawing& drawing);

}  // namespace dive::mission
