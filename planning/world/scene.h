#pragma once
// Distances between a moving convex solid and the obstacles of a world: a tree of boxes finds who
// is near, FCL's GJK how near (narrowphase.h). Distances never exceed the truth; of overlaps the
// depth may be a little too large, for which see doc/decisions/overlap-without-epa.md.

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "planning/world/world.h"

namespace dive::planning {

/// Nearest features of a convex solid and one obstacle.
struct Contact {
  int obstacle = -1;                 ///< Index into World::obstacles.
  double distance = 0.0;             ///< Signed, m; negative is penetration depth.
  Eigen::Vector3d point_on_solid_W;  ///< On the solid.
  Eigen::Vector3d point_on_obstacle_W;
  Eigen::Vector3d
      normal_W;  ///< Unit, from the obstacle to the solid: moving along it adds distance.
};

/// Not thread-safe: one per thread (it keeps scratch memory). Cheap to construct from a World.
class Scene {
 public:
  explicit Scene(const World& world);
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();

  /// Every obstacle whose signed distance to the convex hull of `points_W` is below `cutoff`,
  /// in order of obstacle index. `out` is cleared first; no allocation once it has grown.
  void contacts(std::span<const Eigen::Vector3d> points_W, double cutoff,
                std::vector<Contact>& out);

  /// Smallest distance to any obstacle if it is below `cutoff`, else `cutoff`.
  [[nodiscard]] double clearance(std::span<const Eigen::Vector3d> points_W, double cutoff);

  /// Signed distance of a ball of radius 0 at `p_W` to the nearest obstacle (closed form for
  /// every primitive, a lower bound for ellipsoids). For sampling planners.
  [[nodiscard]] double point_distance(const Eigen::Vector3d& p_W) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
