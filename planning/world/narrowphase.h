#pragma once
// Signed distance between the hull of a point set and one primitive.

#include <Eigen/Core>

#include "planning/world/solid_points.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Nearest features, in the frame of the points.
struct Separation {
  double distance = 0.0;  ///< Signed distance, m.
  /// Unit vector from the obstacle to the solid.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d on_solid = Eigen::Vector3d::Zero();
  Eigen::Vector3d on_obstacle = Eigen::Vector3d::Zero();
};

/// One obstacle, queried in its own frame.
///
/// With s(n) = min over the solid of n . x - max over the obstacle of n . x, the signed distance is
/// max over unit n of s(n): for separate bodies it is the distance; for overlapping ones it is
/// minus the shortest shift that separates them. GJK proposes n, and the reported value is s(n),
/// computed from the vertices. Hence the distance never exceeds the true one, wherever GJK stopped,
/// and `normal` is its gradient. Overlaps: doc/decisions/overlap-without-epa.md.
class NarrowPhase {
 public:
  explicit NarrowPhase(const Shape& shape);

  /// Separation between the obstacle and the hull of `points_O` (at least one). False if the
  /// distance is certainly not below `cutoff`; `result` is then unspecified.
  [[nodiscard]] bool separation(const SolidPoints& points_O, double cutoff,
                                Separation& result) const;
  [[nodiscard]] const Shape& shape() const { return shape_; }

 private:
  Shape shape_;
  Eigen::Vector3d half_;
};

}  // namespace dive::planning
