#pragma once
// Obstacles between a point and the surface.

#include <vector>

#include <Eigen/Core>

#include "planning/world/box_tree.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Scratch memory of is_above(), which allocates only to enlarge it.
struct PlanView {
  std::vector<Eigen::Vector2d> points;
  std::vector<Eigen::Vector2d> hull;
};

/// True if the obstacle reaches into the vertical tube of `radius` around p_W, from p_W up to the
/// surface z = 0. Exact for boxes, half-spaces and polytopes; other shapes are replaced by their
/// own box, so the result may be a false positive, never a false negative.
[[nodiscard]] bool is_above(const Obstacle& obstacle, const Eigen::Vector3d& p_W, double radius,
                            PlanView& scratch);

/// The same query for all obstacles of a world, at 50 Hz: a tree of boxes finds the candidates, and
/// nothing is allocated after construction. Not thread-safe. The world must outlive it.
class OverheadIndex {
 public:
  explicit OverheadIndex(const World& world);

  [[nodiscard]] bool is_above(const Eigen::Vector3d& p_W, double radius);

 private:
  const World* world_;
  BoxTree tree_;
  PlanView scratch_;
};

}  // namespace dive::planning
