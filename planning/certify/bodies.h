#pragma once
// The two kinds of body a certificate is about, and the separation between them along a direction.

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/se3.h"
#include "planning/world/world.h"

namespace dive::planning::certify {

/// A convex obstacle fixed in W.
class FixedBody {
 public:
  explicit FixedBody(const Obstacle& obstacle);
  FixedBody(FixedBody&&) noexcept;
  ~FixedBody();

  /// Largest n . x over the body; infinite for a half-space, but along its own normal.
  [[nodiscard]] double reach(const Eigen::Vector3d& n_W) const;
  /// Distance from the smallest box aligned with W that holds it; 0 inside that box.
  [[nodiscard]] double box_distance(const Eigen::AlignedBox3d& box_W) const;

 private:
  friend class MovingBody;
  struct Geometry;  // FCL's shape and pose.
  Shape shape_;
  Pose X_WO_;
  Eigen::Matrix3d R_OW_;
  std::vector<Eigen::Vector3d> axes_W_;  // Unit, both ways; of a half-space its normal only.
  Eigen::AlignedBox3d box_W_;
  [[nodiscard]] const Geometry& geometry() const;
  mutable std::unique_ptr<Geometry> geometry_;  // Made when FCL is first asked: seldom.
};

/// A direction that separates, and by how much.
struct Separator {
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();
  double separation = 0.0;  ///< s_n: a lower bound on the signed distance.
  double distance =
      0.0;  ///< FCL's distance, or the separation where FCL was not asked or overlaps.
};

/// A convex part of the vehicle.
class MovingBody {
 public:
  explicit MovingBody(std::vector<Eigen::Vector3d> vertices_B);
  MovingBody(MovingBody&&) noexcept;
  ~MovingBody();

  /// Largest distance of a vertex from B's origin.
  [[nodiscard]] double radius() const { return radius_; }
  /// s_n of certify.h.
  [[nodiscard]] double separation(const Pose& X_WB, const FixedBody& other,
                                  const Eigen::Vector3d& n_W) const;
  /// Largest n . x over the body.
  [[nodiscard]] double reach(const Pose& X_WB, const Eigen::Vector3d& n_W) const;
  /// The best of the obstacle's own axes: cheap, and often enough.
  [[nodiscard]] Separator along_axes(const Pose& X_WB, const FixedBody& other) const;
  /// Asks FCL for the best direction; along_axes() where FCL finds an overlap.
  [[nodiscard]] Separator nearest(const Pose& X_WB, const FixedBody& other) const;

 private:
  struct Geometry;
  // FCL's answer for one pose, judged at another.
  [[nodiscard]] Separator ask(const Pose& X_WB_asked, const Pose& X_WB,
                              const FixedBody& other) const;
  [[nodiscard]] double least(const Pose& X_WB, const Eigen::Vector3d& n_W) const;

  std::vector<Eigen::Vector3d> vertices_B_;
  double radius_ = 0.0;
  std::unique_ptr<Geometry> geometry_;
};

}  // namespace dive::planning::certify
