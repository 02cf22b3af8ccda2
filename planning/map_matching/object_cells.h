#pragma once
// The objects of a known map whose absence scans can show, divided into cells.

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/map_matching/map_surface.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Left out are the ground and what is too large to be missing: half-spaces, objects longer than 10
/// m (a pool wall, a seabed, a wreck: without them it is the wrong map), flat ones (both horizontal
/// extents more than three times the height), and those with more than 400 cells. Immutable, so
/// that it may be used by several threads.
class ObjectCells {
 public:
  static constexpr double kEdge = 0.5;  ///< m

  struct Object {
    ObjectRange obstacles;
    Eigen::AlignedBox3d box;                 ///< In W.
    std::vector<Eigen::AlignedBox3d> cells;  ///< For each cell the part of the surface in it.

    /// The cell that contains the point of the box nearest to p_W.
    [[nodiscard]] std::optional<int> cell_at(const Eigen::Vector3d& p_W) const;

   private:
    friend class ObjectCells;

    Eigen::Vector3i count_ = Eigen::Vector3i::Zero();  ///< Places of the grid along each axis.
    std::vector<int> cell_of_place_;                   ///< -1: the surface does not pass it.
  };

  /// `surface` is the surface of `world`.
  ObjectCells(const World& world, const MapSurface& surface);

  [[nodiscard]] std::span<const Object> objects() const { return objects_; }

 private:
  static void divide(const MapSurface& surface, Object& object);

  std::vector<Object> objects_;  ///< Ascending by obstacle.
};

}  // namespace dive::planning
