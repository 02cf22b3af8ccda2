#pragma once
// What lies between a point and the surface.

#include <vector>

#include <Eigen/Core>

#include "planning/world/box_tree.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Memory of is_above(), which allocates where this is too small.
struct PlanView {
  std::vector<Eigen::Vector2d> points;
  std::vector<Eigen::Vector2d> hull;
};

/// Does the obstacle reach into the open vertical tube of `radius` around p_W, from p_W up to the
/// surface z = 0? Exact for boxes, half-spaces and polytopes; other shapes count as their own box,
/// so the answer may be yes where it is no, never the reverse.
[[nodiscard]] bool is_above(const Obstacle& obstacle, const Eigen::Vector3d& p_W, double radius,
                            PlanView& scratch);

/// The same of all obstacles of a world, asked fifty times a second: a tree of boxes finds who may
/// be above, and nothing is allocated after construction. Not thread-safe. The world must outlive
/// it.
class Ceiling {
 public:
  explicit Ceiling(const World& world);

  [[nodiscard]] bool is_above(const Eigen::Vector3d& p_W, double radius);

 private:
  const World* world_;
  BoxTree tree_;
  PlanView scratch_;
};

}  // namespace dive::planning
