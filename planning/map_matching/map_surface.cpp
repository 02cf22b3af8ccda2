#include "planning/map_matching/map_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "common/assert.h"

namespace dive::planning {
namespace {

using Eigen::Vector3d;

constexpr double kStep = 1e-4;        // m, of the central differences
constexpr double kMinGradient = 0.5;  // shorter: the point is on an edge inside the solid
constexpr double kBesideEdge = 0.3;   // share of a point's distance that lies along the plane

// Beyond the edge of a triangle the distance grows away from the nearest point.
MapSurface::Nearest at_triangle(const std::array<Vector3d, 3>& corners_W, const Vector3d& p_W,
                                const Vector3d& from_W) {
  Vector3d normal_W = (corners_W[1] - corners_W[0]).cross(corners_W[2] - corners_W[0]).normalized();
  if (normal_W.dot(from_W - corners_W[0]) < 0.0) normal_W = -normal_W;
  const double height = normal_W.dot(p_W - corners_W[0]);
  const Vector3d off_W = p_W - nearest_in_triangle(corners_W, p_W);
  const double distance = off_W.norm();
  if ((off_W - height * normal_W).norm() <= kBesideEdge * distance) return {height, normal_W};
  return {distance, off_W / distance};
}

// Gradient of the signed distance, by central differences; absent where it is not defined.
std::optional<Vector3d> normal_at(const Shape& shape, const Vector3d& p_O) {
  Vector3d gradient;
  for (int k = 0; k < 3; ++k) {
    const Vector3d step = kStep * Vector3d::Unit(k);
    gradient[k] =
        (signed_distance(shape, p_O + step) - signed_distance(shape, p_O - step)) / (2.0 * kStep);
  }
  const double norm = gradient.norm();
  if (norm < kMinGradient) return std::nullopt;
  return Vector3d(gradient / norm);
}

}  // namespace

MapSurface::MapSurface(const World& world) : mesh_objects_(world.surfaces.size(), -1) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t i = 0; i < world.obstacles.size(); ++i) {
    const Obstacle& obstacle = world.obstacles[i];
    const int object = static_cast<int>(i);
    if (const auto* half = std::get_if<HalfSpace>(&obstacle.shape)) {
      const Vector3d normal_W = obstacle.X_WO.q * half->normal.normalized();
      planes_.push_back({normal_W, normal_W.dot(obstacle.X_WO.p), object});
    } else if (obstacle.surface < 0 || world.surfaces.empty()) {
      primitives_.push_back({obstacle.shape, obstacle.X_WO.inverse(), object});
      boxes.push_back(bounding_box(obstacle));
    } else if (int& first = mesh_objects_.at(static_cast<std::size_t>(obstacle.surface));
               first < 0) {
      first = object;
    }
  }
  tree_.emplace(boxes);
  meshes_.reserve(world.surfaces.size());
  for (const Surface& surface : world.surfaces) {
    soups_.emplace_back(meshes_.emplace_back(surface.mesh));
  }
}

std::optional<MapSurface::Nearest> MapSurface::nearest(const Vector3d& p_W, const Vector3d& from_W,
                                                       double reach) const {
  double least = reach;
  std::optional<Nearest> plane;
  for (const auto& [normal_W, offset, object] : planes_) {
    const double height = normal_W.dot(p_W) - offset;
    if (std::abs(height) >= least) continue;
    least = std::abs(height);
    plane = Nearest{height, normal_W, object};
  }
  const Primitive* primitive = nullptr;
  double height = 0.0;
  tree_->visit(p_W, least, [&](std::uint32_t index) {
    const Primitive& one = primitives_[index];
    const double here = signed_distance(one.shape, one.X_OW * p_W);
    if (std::abs(here) >= least) return least;
    primitive = &one;
    height = here;
    return least = std::abs(here);
  });
  std::optional<std::size_t> mesh;
  std::size_t triangle = 0;
  for (std::size_t i = 0; i < soups_.size(); ++i) {
    const std::optional<std::size_t> index = soups_[i].nearest(p_W, least);
    if (!index) continue;
    mesh = i;
    triangle = *index;
    least = soups_[i].distance(triangle, p_W);
  }
  if (mesh) {
    Nearest nearest = at_triangle(soups_[*mesh].corners(triangle), p_W, from_W);
    nearest.object = mesh_objects_[*mesh];
    return nearest;
  }
  if (primitive == nullptr) return plane;
  const std::optional<Vector3d> normal_O = normal_at(primitive->shape, primitive->X_OW * p_W);
  if (!normal_O) return std::nullopt;
  return Nearest{height, primitive->X_OW.q.conjugate() * *normal_O, primitive->object};
}

double MapSurface::distance(int object, const Vector3d& p_W, double reach) const {
  const auto primitive = std::ranges::lower_bound(primitives_, object, {}, &Primitive::object);
  if (primitive != primitives_.end() && primitive->object == object) {
    return std::min(reach, signed_distance(primitive->shape, primitive->X_OW * p_W));
  }
  const auto mesh = std::ranges::find(mesh_objects_, object);
  DIVE_DEMAND(mesh != mesh_objects_.end());
  const TriangleSoup& soup = soups_[static_cast<std::size_t>(mesh - mesh_objects_.begin())];
  const std::optional<std::size_t> triangle = soup.nearest(p_W, reach);
  return triangle ? soup.distance(*triangle, p_W) : reach;
}

}  // namespace dive::planning
