#pragma once
// Clearance and collisions of the true vehicle in the true world, with CGAL on triangles: no code
// shared with planner, certificate or estimator, so that neither can grade its own work.

#include <memory>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

/// Hull and obstacles are closed triangle surfaces; what lies wholly inside the other overlaps it.
/// Meshes are taken as they were drawn, triangle by triangle, and not by their convex pieces.
/// Curved shapes stand as polyhedra around them, at most 0.5 % of their radius larger: a clearance
/// is never overstated. Half-spaces are exact. In an empty world, and before the first pose, the
/// clearance is infinite.
class ClearanceMeter {
 public:
  ClearanceMeter(const planning::World& world, const planning::RobotHull& hull);
  ClearanceMeter(ClearanceMeter&&) noexcept;
  ~ClearanceMeter();

  /// Takes the pose of one tick into account. Nothing is measured while the vehicle cannot have
  /// come nearer than the smallest clearance so far: between two poses no point of the hull moves
  /// farther than |dp| + r dtheta, with r the hull's radius. The outcome is the same as if every
  /// pose were measured.
  void observe(const Pose& X_WB);

  /// Distance of hull and world at one finite pose (m); 0 when they touch or overlap.
  [[nodiscard]] double clearance(const Pose& X_WB) const;

  [[nodiscard]] double min_clearance_m() const;  ///< Over all poses observed.
  [[nodiscard]] int collisions() const;          ///< Separate contacts: touching again counts anew.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
