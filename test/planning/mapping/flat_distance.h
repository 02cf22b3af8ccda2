#pragma once
// Distances to flat pieces, triangle by triangle: shares nothing with the code that makes or
// measures them.

#include <algorithm>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "planning/world/world.h"

namespace dive::planning {

inline double to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                         const Eigen::Vector3d& b) {
  const double length2 = (b - a).squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * (b - a)).norm();
}

inline double to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  double least = std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
  const Eigen::Vector3d n = (b - a).cross(c - a);
  if (n.norm() < 1e-12) return least;
  const Eigen::Vector3d q = p - n * (p - a).dot(n) / n.squaredNorm();
  const bool inside = (b - a).cross(q - a).dot(n) >= 0.0 && (c - b).cross(q - b).dot(n) >= 0.0 &&
                      (a - c).cross(q - c).dot(n) >= 0.0;
  return inside ? (p - q).norm() : least;
}

/// Distance to a piece whose vertices lie on one plane, in order; negative inside its skin.
inline double to_piece(const Eigen::Vector3d& p, const Polytope& piece) {
  const auto& v = piece.vertices;
  double least = (p - v.front()).norm();
  for (std::size_t i = 1; i + 1 < v.size(); ++i) {
    least = std::min(least, to_triangle(p, v[0], v[i], v[i + 1]));
  }
  if (v.size() == 2) least = to_segment(p, v[0], v[1]);
  return least - piece.radius;
}

}  // namespace dive::planning
