#pragma once
// The vehicle, the water and the paths of the tests of control and simulation.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "common/se3.h"
#include "vehicle/model.h"
#include "vehicle/simulator/simulator.h"

namespace dive::testing {

inline vehicle::Model aqua2() {
  Diagnostics diagnostics;
  std::optional<vehicle::Model> model = vehicle::parse_urdf(vehicle::aqua2_urdf(), diagnostics);
  if (!model) throw std::runtime_error("the Aqua2's own URDF does not parse");
  return *model;
}

/// Still water, perfect sensors and the nominal gait speed.
inline vehicle::Conditions ideal() {
  vehicle::Conditions conditions;
  for (const auto& [name, value] : conditions.list()) {
    if (!name.starts_with("battery")) static_cast<void>(conditions.set(name, 0.0));
  }
  return conditions;
}

/// Level poses through the points, each heading for the next one.
inline std::vector<Pose> level_path(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Pose> path(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t from = i + 1 < points.size() ? i : i - 1;
    const Eigen::Vector3d way = points[from + 1] - points[from];
    path[i] = Pose{points[i], from_rpy(0.0, 0.0, std::atan2(way.y(), way.x()))};
  }
  return path;
}

/// Waypoints every 1.5 m, turning by `turns_deg` before each step and descending by `slope`.
inline std::vector<Eigen::Vector3d> turtle(Eigen::Vector3d p, const std::vector<double>& turns_deg,
                                           double slope) {
  std::vector<Eigen::Vector3d> points{p};
  double bearing = 0.0;
  for (const double turn : turns_deg) {
    bearing += deg_to_rad(turn);
    p += 1.5 * Eigen::Vector3d(std::cos(bearing), std::sin(bearing), -slope);
    points.push_back(p);
  }
  return points;
}

/// A path through a room, a window and another room: 15 m, three turns of about 40 degrees to
/// either side.
inline std::vector<Eigen::Vector3d> s_curve() {
  return turtle({-1.0, -2.0, -4.0}, {0, 40, 40, -20, -40, -40, -20, 20, 20, 0}, 0.04);
}

inline double distance_to_polyline(std::span<const Pose> path, const Eigen::Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d way = path[i].p - path[i - 1].p;
    const double t = std::clamp(way.dot(p - path[i - 1].p) / way.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (path[i - 1].p + t * way - p).norm());
  }
  return nearest;
}

}  // namespace dive::testing
