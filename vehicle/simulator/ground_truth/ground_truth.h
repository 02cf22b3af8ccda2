#pragma once
// Clearance and contacts of the true vehicle in the true world, with CGAL on triangles: no code
// shared with planner, certificate or estimator, so that none of them evaluates its own work.

#include <memory>
#include <string>
#include <vector>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

/// A world as triangles, built once for the meters of many dives. Copies share it; thread-safe.
class TriangulatedWorld {
 public:
  explicit TriangulatedWorld(const planning::World& world);

 private:
  friend class ClearanceMeter;
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// Hull and obstacles are closed triangle surfaces; one wholly inside the other overlaps it. Meshes
/// enter as drawn, triangle by triangle, not by their convex pieces. Curved shapes become polyhedra
/// around them, at most 0.5 % of their radius larger: a clearance is never overstated. Half-spaces
/// are exact. In an empty world, and before the first pose, the clearance is infinite.
///
/// A collision is one contact with one obstacle: it begins at the first pose at which the hull
/// touches or overlaps the obstacle, and ends once the hull is kReleaseClearance away from it. If
/// they touch again before that, it is still the same contact. Two obstacles touched at once are
/// two collisions; a mesh is one obstacle.
class ClearanceMeter {
 public:
  static constexpr double kReleaseClearance = 0.05;  ///< m

  ClearanceMeter(const planning::World& world, const planning::RobotHull& hull)
      : ClearanceMeter(TriangulatedWorld(world), hull) {}
  ClearanceMeter(const TriangulatedWorld& world, const planning::RobotHull& hull);
  ClearanceMeter(ClearanceMeter&&) noexcept;
  ClearanceMeter& operator=(ClearanceMeter&&) noexcept;
  ~ClearanceMeter();

  /// Processes the pose of one tick and returns the names of the obstacles that the hull begins to
  /// touch, in the order of the world. Outside contacts it skips the measurement while the vehicle
  /// cannot be nearer than the smallest clearance so far: between two poses no point of the hull
  /// moves farther than |dp| + r dtheta, with r the hull's radius. The result equals that of
  /// measuring every pose.
  std::vector<std::string> observe(const Pose& X_WB);

  /// Distance of hull and world at one finite pose (m); 0 if they touch or overlap.
  [[nodiscard]] double clearance(const Pose& X_WB) const;

  [[nodiscard]] double min_clearance_m() const;  ///< Minimum over all poses observed.
  /// The obstacle at min_clearance_m(); empty before the first measurement.
  [[nodiscard]] std::string nearest_obstacle() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
