#pragma once
// Distance between two boxes from their features: an oracle independent of GJK and FCL.

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "common/se3.h"
#include "test/planning/reference.h"

namespace dive::testing {

struct PlacedBox {
  Eigen::Vector3d size;
  Pose X_W;
};

inline double point_to_box(const Eigen::Vector3d& p_W, const PlacedBox& box) {
  const Eigen::Vector3d p = box.X_W.inverse() * p_W;
  return (p - p.cwiseMax(-box.size / 2.0).cwiseMin(box.size / 2.0)).norm();
}

/// Ericson, "Real-Time Collision Detection", 5.1.9; neither segment a point.
inline double segment_to_segment(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1,
                                 const Eigen::Vector3d& b0, const Eigen::Vector3d& b1) {
  const Eigen::Vector3d u = a1 - a0;
  const Eigen::Vector3d v = b1 - b0;
  const Eigen::Vector3d w = a0 - b0;
  const double uu = u.dot(u);
  const double uv = u.dot(v);
  const double vv = v.dot(v);
  const double denominator = uu * vv - uv * uv;
  double s = denominator > 1e-14 ? (uv * v.dot(w) - vv * u.dot(w)) / denominator : 0.0;
  s = std::clamp(s, 0.0, 1.0);
  const double t = std::clamp((uv * s + v.dot(w)) / vv, 0.0, 1.0);
  s = std::clamp((uv * t - u.dot(w)) / uu, 0.0, 1.0);
  return (w + s * u - t * v).norm();
}

/// Separating axes of two boxes: three faces each and nine pairs of edges.
inline bool boxes_overlap(const PlacedBox& a, const PlacedBox& b) {
  const Eigen::Matrix3d A = a.X_W.q.toRotationMatrix();
  const Eigen::Matrix3d B = b.X_W.q.toRotationMatrix();
  const auto parts = [&](const Eigen::Vector3d& axis) {
    if (axis.norm() < 1e-9) return false;
    const double reach = (A.transpose() * axis).cwiseAbs().dot(a.size) / 2.0 +
                         (B.transpose() * axis).cwiseAbs().dot(b.size) / 2.0;
    return std::abs(axis.dot(b.X_W.p - a.X_W.p)) > reach;
  };
  for (int i = 0; i < 3; ++i) {
    if (parts(A.col(i)) || parts(B.col(i))) return false;
    for (int j = 0; j < 3; ++j) {
      if (parts(A.col(i).cross(B.col(j)))) return false;
    }
  }
  return true;
}

/// Zero if they overlap.
inline double box_to_box(const PlacedBox& a, const PlacedBox& b) {
  if (boxes_overlap(a, b)) return 0.0;
  auto corners_a = box_corners(a.size);
  auto corners_b = box_corners(b.size);
  double least = 1e300;
  for (auto& p : corners_a) least = std::min(least, point_to_box(p = a.X_W * p, b));
  for (auto& p : corners_b) least = std::min(least, point_to_box(p = b.X_W * p, a));
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = 0; j < 8; ++j) {
      for (std::size_t edge_a = 1; edge_a < 8; edge_a *= 2) {
        for (std::size_t edge_b = 1; edge_b < 8; edge_b *= 2) {
          if ((i & edge_a) || (j & edge_b)) continue;
          least = std::min(least, segment_to_segment(corners_a[i], corners_a[i | edge_a],
                                                     corners_b[j], corners_b[j | edge_b]));
        }
      }
    }
  }
  return least;
}

}  // namespace dive::testing
