#pragma once
// The vertices of a convex solid, one array per coordinate: the narrow phase does little else than
// ask for the lowest of them along a direction, and this way the machine looks at several at once.

#include <span>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive::planning {

class SolidPoints {
 public:
  SolidPoints() = default;
  explicit SolidPoints(std::span<const Eigen::Vector3d> points);

  void assign(std::span<const Eigen::Vector3d> points);
  /// `points_W`, all in the world, as seen from O: R_WO' (p - p_WO).
  void assign_seen_from(const Eigen::Matrix3d& R_WO, const Eigen::Vector3d& p_WO,
                        const SolidPoints& points_W);

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(xyz_.rows()); }
  [[nodiscard]] Eigen::Vector3d operator[](std::size_t i) const {
    return xyz_.row(static_cast<Eigen::Index>(i)).transpose();
  }
  /// Index of the vertex with the least n . p; the first of several.
  [[nodiscard]] std::size_t lowest(const Eigen::Vector3d& n) const;
  /// Corners of the box around them.
  [[nodiscard]] Eigen::Vector3d low() const;
  [[nodiscard]] Eigen::Vector3d high() const;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 3> xyz_;
  mutable Eigen::VectorXd along_;  ///< Scratch of lowest(): one thread at a time.
};

}  // namespace dive::planning
