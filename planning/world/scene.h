#pragma once
// Distances between a moving convex solid and the obstacles of a world: a tree of boxes finds the
// candidates, GJK the distances (narrowphase.h). Distances never exceed the true ones; the depth of
// an overlap may be slightly too large, see doc/decisions/overlap-without-epa.md.

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
  Eigen::Vector3d point_on_solid_W;  ///< Nearest point on the solid.
  Eigen::Vector3d point_on_obstacle_W;
  Eigen::Vector3d
      normal_W;  ///< Unit vector from the obstacle to the solid, along which the distance grows.
};

/// Not thread-safe: one per thread, because it has scratch memory. A copy shares the obstacles and
/// has its own scratch memory, so it may be used by another thread.
class Scene {
 public:
  explicit Scene(const World& world);
  Scene(const Scene& other);
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();

  /// Grows the scratch memory for solids of `points` vertices, so that no later call allocates.
  void reserve(std::size_t points);

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
