#pragma once
// The surfaces of a known map, and the nearest one to a measured point.

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "planning/world/box_tree.h"
#include "planning/world/primitives.h"
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
    /// First obstacle of the object that it belongs to (object_at()); -1: a mesh without obstacles.
    int object = 0;
  };

  explicit MapSurface(const World& world);
  MapSurface(const MapSurface&) = delete;
  MapSurface& operator=(const MapSurface&) = delete;

  /// The surface nearest to p_W within `reach` (m). `from_W` is on the side from which p_W was
  /// measured: a mesh faces it.
  [[nodiscard]] std::optional<Nearest> nearest(const Eigen::Vector3d& p_W,
                                               const Eigen::Vector3d& from_W, double reach) const;
  /// True if a surface is nearer to p_W than `reach` (m). Cheaper than nearest().
  [[nodiscard]] bool is_near(const Eigen::Vector3d& p_W, double reach) const {
    return is_near(p_W, reach, [](int) { return false; });
  }
  /// The same without the objects for which `is_left_out` is true.
  template <class IsLeftOut>
  [[nodiscard]] bool is_near(const Eigen::Vector3d& p_W, double reach,
                             IsLeftOut&& is_left_out) const;
  /// Distance of p_W from the surface of one object, m, at most `reach`: negative inside a
  /// primitive. Demands an object that is not a half-space.
  [[nodiscard]] double distance(int object, const Eigen::Vector3d& p_W, double reach) const;

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
  std::vector<int> mesh_objects_;    ///< Of the meshes.
  std::optional<BoxTree> tree_;      ///< Of the primitives.
};

template <class IsLeftOut>
bool MapSurface::is_near(const Eigen::Vector3d& p_W, double reach, IsLeftOut&& is_left_out) const {
  for (const auto& [normal_W, offset, object] : planes_) {
    if (std::abs(normal_W.dot(p_W) - offset) < reach && !is_left_out(object)) return true;
  }
  bool is_found = false;
  tree_->visit(p_W, reach, [&](std::uint32_t index) {
    const Primitive& one = primitives_[index];
    is_found =
        !is_left_out(one.object) && std::abs(signed_distance(one.shape, one.X_OW * p_W)) < reach;
    return is_found ? -1.0 : reach;
  });
  for (std::size_t i = 0; i < soups_.size() && !is_found; ++i) {
    is_found = !is_left_out(mesh_objects_[i]) && soups_[i].nearest(p_W, reach).has_value();
  }
  return is_found;
}

}  // namespace dive::planning
