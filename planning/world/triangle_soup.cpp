#include "planning/world/triangle_soup.h"

namespace dive::planning {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

std::vector<std::array<std::uint32_t, 3>> with_area(const TriangleMesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    if ((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() > 0.0) {
      triangles.push_back(t);
    }
  }
  return triangles;
}

}  // namespace

Vector3d nearest_in_triangle(const std::array<Vector3d, 3>& t, const Vector3d& p) {
  const Vector3d ab = t[1] - t[0];
  const Vector3d ac = t[2] - t[0];
  const Vector3d ap = p - t[0];
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return t[0];
  const Vector3d bp = p - t[1];
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return t[1];
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return t[0] + d1 / (d1 - d3) * ab;
  const Vector3d cp = p - t[2];
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return t[2];
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return t[0] + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  }
  return t[0] + (vb * ab + vc * ac) / (va + vb + vc);
}

TriangleSoup::TriangleSoup(const TriangleMesh& mesh)
    : points_(mesh.vertices), triangles_(with_area(mesh)), tree_(boxes()) {}

std::array<Vector3d, 3> TriangleSoup::corners(std::size_t triangle) const {
  const auto& [a, b, c] = triangles_[triangle];
  return {points_[a], points_[b], points_[c]};
}

AlignedBox3d TriangleSoup::box(std::size_t triangle) const {
  const auto& [a, b, c] = triangles_[triangle];
  return AlignedBox3d(points_[a]).extend(points_[b]).extend(points_[c]);
}

std::vector<AlignedBox3d> TriangleSoup::boxes() const {
  std::vector<AlignedBox3d> boxes;
  boxes.reserve(triangles_.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i) boxes.push_back(box(i));
  return boxes;
}

std::optional<std::size_t> TriangleSoup::nearest(const Vector3d& p, double reach) const {
  std::optional<std::size_t> best;
  tree_.visit(p, reach, [&](std::size_t i) {
    if (const double d = distance(i, p); d <= reach) {
      reach = d;
      best = i;
    }
    return reach;
  });
  return best;
}

}  // namespace dive::planning
