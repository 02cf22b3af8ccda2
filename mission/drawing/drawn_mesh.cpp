#include "mission/drawing/drawn_mesh.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include <Eigen/Eigenvalues>

#include "vehicle/convex_hull.h"

namespace dive::mission {
namespace {

constexpr double kFlat = 1e-4;  // m: a thinner solid is drawn as a polygon

using Points = std::vector<Eigen::Vector3d>;
using Face = std::array<std::size_t, 3>;

struct Frame {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns, by ascending extent.
  Eigen::Vector3d extent = Eigen::Vector3d::Zero();    ///< Along the axes, m.
};

Frame principal_frame(const Points& points) {
  Frame frame;
  for (const Eigen::Vector3d& p : points) frame.centre += p;
  frame.centre /= static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    spread += (p - frame.centre) * (p - frame.centre).transpose();
  }
  frame.axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors();
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) box.extend(frame.axes.transpose() * (p - frame.centre));
  frame.extent = box.sizes();
  return frame;
}

// Indices of the corners of the convex polygon of flat points, in order (monotone chain).
std::vector<std::size_t> polygon_of(const Points& points, const Frame& frame) {
  std::vector<std::pair<Eigen::Vector2d, std::size_t>> flat;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d local = frame.axes.transpose() * (points[i] - frame.centre);
    flat.emplace_back(local.tail<2>(), i);
  }
  std::ranges::sort(flat, [](const auto& a, const auto& b) {
    return std::lexicographical_compare(a.first.begin(), a.first.end(), b.first.begin(),
                                        b.first.end());
  });
  const auto turns_left = [&](std::size_t a, std::size_t b, std::size_t c) {
    const Eigen::Vector2d u = flat[b].first - flat[a].first;
    const Eigen::Vector2d v = flat[c].first - flat[b].first;
    return u.x() * v.y() - u.y() * v.x() > 0.0;
  };
  std::vector<std::size_t> corners;
  const auto half = [&](auto first, auto last, auto next) {
    const std::size_t base = corners.size();
    for (auto i = first; i != last; i = next(i)) {
      const auto at = static_cast<std::size_t>(i);
      while (corners.size() >= base + 2 &&
             !turns_left(corners[corners.size() - 2], corners.back(), at)) {
        corners.pop_back();
      }
      corners.push_back(at);
    }
    corners.pop_back();
  };
  const auto count = static_cast<std::ptrdiff_t>(flat.size());
  half(std::ptrdiff_t{0}, count, [](std::ptrdiff_t i) { return i + 1; });
  half(count - 1, std::ptrdiff_t{-1}, [](std::ptrdiff_t i) { return i - 1; });
  for (std::size_t& corner : corners) corner = flat[corner].second;
  return corners;
}

vehicle::TriangleSolid solid_of(const Points& points) {
  if (points.size() < 3) return {};
  const Frame frame = principal_frame(points);
  if (frame.extent[1] < kFlat) return {};
  if (points.size() > 3 && frame.extent[0] >= kFlat) return vehicle::convex_hull(points);
  vehicle::TriangleSolid polygon;
  polygon.vertices = points;
  const std::vector<std::size_t> corners = polygon_of(points, frame);
  for (std::size_t i = 2; i < corners.size(); ++i) {
    polygon.faces.push_back(Face{corners[0], corners[i - 1], corners[i]});
  }
  return polygon;
}

}  // namespace

void DrawnMesh::begin(const std::string& name) {
  if (parts.empty() || parts.back().name != name) parts.push_back({name, 0});
}

void DrawnMesh::append(const std::string& name, const planning::Polytope& polytope,
                       const Pose& X_WO) {
  Points points;
  for (const Eigen::Vector3d& p : polytope.vertices) points.push_back(X_WO * p);
  const vehicle::TriangleSolid solid = solid_of(points);
  begin(name);
  const auto base = static_cast<std::uint32_t>(vertices.size());
  for (const Eigen::Vector3d& p : solid.vertices) vertices.emplace_back(p.cast<float>());
  for (const auto& [a, b, c] : solid.faces) {
    triangles.push_back({base + static_cast<std::uint32_t>(a), base + static_cast<std::uint32_t>(b),
                         base + static_cast<std::uint32_t>(c)});
  }
  parts.back().triangles += solid.faces.size();
}

void DrawnMesh::append(const std::string& name, const planning::TriangleMesh& mesh) {
  begin(name);
  const auto base = static_cast<std::uint32_t>(vertices.size());
  for (const Eigen::Vector3d& p : mesh.vertices) vertices.emplace_back(p.cast<float>());
  for (const auto& [a, b, c] : mesh.triangles) triangles.push_back({base + a, base + b, base + c});
  parts.back().triangles += mesh.triangles.size();
}

DrawnMesh drawn_meshes(const planning::World& world, std::size_t max_triangles) {
  std::size_t count = 0;
  for (const planning::Surface& surface : world.surfaces) count += surface.mesh.triangles.size();
  const bool draws_surfaces = count <= max_triangles;
  DrawnMesh drawn;
  if (draws_surfaces) {
    for (const planning::Surface& surface : world.surfaces)
      drawn.append(surface.name, surface.mesh);
  }
  for (const planning::Obstacle& obstacle : world.obstacles) {
    const auto* polytope = std::get_if<planning::Polytope>(&obstacle.shape);
    if (polytope == nullptr || (draws_surfaces && obstacle.surface >= 0)) continue;
    if (drawn.triangles.size() < max_triangles)
      drawn.append(obstacle.name, *polytope, obstacle.X_WO);
  }
  return drawn;
}

}  // namespace dive::mission
