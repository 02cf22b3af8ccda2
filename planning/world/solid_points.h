#pragma once
// The vertices of a convex solid, one array per coordinate. The narrow phase mainly searches for
// the lowest vertex along a direction, and this layout lets the processor compare several at once.

#include <span>

#include <Eigen/Core>

#include "common/se3.h"

namespace dive::planning {

class SolidPoints {
 public:
  SolidPoints() = default;
  explicit SolidPoints(std::span<const Eigen::Vector3d> points);

  void assign(std::span<const Eigen::Vector3d> points);
  /// Assigns `points_W`, given in W, in the frame O: R_WO' (p - p_WO).
  void assign_seen_from(const Eigen::Matrix3d& R_WO, const Eigen::Vector3d& p_WO,
                        const SolidPoints& points_W);

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(xyz_.rows()); }
  [[nodiscard]] Eigen::Vector3d operator[](std::size_t i) const {
    return xyz_.row(static_cast<Eigen::Index>(i)).transpose();
  }
  /// Index of the vertex with the least n . p; the first if several are equal.
  [[nodiscard]] std::size_t lowest(const Eigen::Vector3d& n) const;
  /// Mean of the vertices.
  [[nodiscard]] Eigen::Vector3d middle() const { return xyz_.colwise().mean().transpose(); }
  /// Corners of the bounding box.
  [[nodiscard]] Eigen::Vector3d low() const;
  [[nodiscard]] Eigen::Vector3d high() const;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 3> xyz_;
  mutable Eigen::VectorXd along_;  ///< Scratch memory of lowest(), which makes it single-threaded.
};

}  // namespace dive::planning
