#pragma once
// The surfaces of a known map, and the nearest one to a measured point.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "planning/world/box_tree.h"
#include "planning/world/triangle_soup.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Distances to the primitives of a world in closed form, and to its meshes by their triangles: the
/// convex pieces that the planner uses may contain a mesh's surface by centimetres. Thread-safe.
class MapSurface {
 public:
  struct Nearest {
    double height = 0.0;       ///< Distance of the point from the surface along the normal, m.
    Eigen::Vector3d normal_W;  ///< Unit normal out of the solid; of a mesh, on the side asked for.
    int object = 0;            ///< Index of what it belongs to; see object_name().
  };

  explicit MapSurface(const World& world);
  MapSurface(const MapSurface&) = delete;
  MapSurface& operator=(const MapSurface&) = delete;

  /// The surface nearest to p_W within `reach` (m). `from_W` is on the side from which p_W was
  /// measured: a mesh faces it.
  [[nodiscard]] std::optional<Nearest> nearest(const Eigen::Vector3d& p_W,
                                               const Eigen::Vector3d& from_W, double reach) const;
  /// True if a surface is nearer to p_W than `reach` (m). Cheaper than nearest().
  [[nodiscard]] bool is_near(const Eigen::Vector3d& p_W, double reach) const;

 private:
  struct Primitive {
    Shape shape;
    Pose X_OW;
    int object = 0;
  };
  struct Plane {
    Eigen::Vector3d normal_W;
    double offset = 0.0;
    int object = 0;
  };

  std::vector<Primitive> primitives_;
  std::vector<Plane> planes_;
  std::vector<TriangleMesh> meshes_;
  std::vector<TriangleSoup> soups_;  ///< Refer to meshes_.
  int first_mesh_ = 0;               ///< Its object.
  std::optional<BoxTree> tree_;      ///< Of the primitives.
};

}  // namespace dive::planning
