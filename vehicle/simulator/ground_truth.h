#pragma once
// Clearance and collisions of the true vehicle in the true world, with CGAL on triangles: no code
// shared with planner, certificate or estimator, so that neither can grade its own work.

#include <memory>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::vehicle {

class ClearanceMeter {
 public:
  ClearanceMeter(const planning::World& world, const planning::RobotHull& hull);
  ClearanceMeter(ClearanceMeter&&) noexcept;
  ~ClearanceMeter();

  /// Takes the pose of one tick into account. Cheap when the vehicle cannot have come nearer than
  /// the smallest clearance so far (it moved less than what is in hand).
  void observe(const Pose& X_WB);

  /// Exact distance of hull and world at one pose (m); 0 when they touch or overlap.
  [[nodiscard]] double clearance(const Pose& X_WB) const;

  [[nodiscard]] double min_clearance_m() const;  ///< Over all poses observed.
  [[nodiscard]] int collisions() const;          ///< Separate contacts: touching again counts anew.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::vehicle
