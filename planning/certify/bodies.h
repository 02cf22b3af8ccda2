#pragma once
// The two kinds of body in a certificate, and their separation along a direction.

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

  /// Largest n . x over the body; infinite for a half-space, except along its own normal.
  [[nodiscard]] double reach(const Eigen::Vector3d& n_W) const;
  /// Unit vector from the body towards a point outside it, nearly along the line to the nearest
  /// point of the body; zero where there is no closed form or the point is inside.
  [[nodiscard]] Eigen::Vector3d towards(const Eigen::Vector3d& p_W) const;
  /// Smallest box, aligned with W, that contains the body.
  [[nodiscard]] const Eigen::AlignedBox3d& box_W() const { return box_W_; }

 private:
  friend class MovingBody;
  struct Geometry;  // FCL's shape and pose.
  Shape shape_;
  Pose X_WO_;
  Eigen::Matrix3d R_OW_;
  // Unit normals in both directions; for a half-space only its own.
  std::vector<Eigen::Vector3d> axes_W_;
  Eigen::AlignedBox3d box_W_;
  [[nodiscard]] const Geometry& geometry() const;
  // FCL's geometry, built at the first FCL query, which is rare.
  mutable std::unique_ptr<Geometry> geometry_;
};

/// A separating direction and the separation along it.
struct Separator {
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();
  double separation = 0.0;  ///< s_n, m: a lower bound on the signed distance for any n.
  /// Distance from FCL, m, not proved; the separation if FCL gave no points.
  double distance = 0.0;
};

/// A convex part of the vehicle.
class MovingBody {
 public:
  explicit MovingBody(const std::vector<Eigen::Vector3d>& vertices_B);
  MovingBody(MovingBody&&) noexcept;
  ~MovingBody();

  /// Largest distance of a vertex from B's origin, m.
  [[nodiscard]] double radius() const { return radius_; }
  /// Separation s_n of certify.h.
  [[nodiscard]] double separation(const Pose& X_WB, const FixedBody& other,
                                  const Eigen::Vector3d& n_W) const;
  /// Largest n . x over the body.
  [[nodiscard]] double reach(const Pose& X_WB, const Eigen::Vector3d& n_W) const;
  /// The best of the obstacle's own axes: cheap, and often sufficient.
  [[nodiscard]] Separator along_axes(const Pose& X_WB, const FixedBody& other) const;
  /// Separation along the line through two points, proposed as the nearest to each other. Any two
  /// points give a lower bound; along_axes() if they give no direction.
  [[nodiscard]] Separator between(const Pose& X_WB, const FixedBody& other,
                                  const Eigen::Vector3d& on_body_W,
                                  const Eigen::Vector3d& on_other_W) const;
  /// Best direction by an FCL query; along_axes() if FCL finds an overlap.
  [[nodiscard]] Separator nearest(const Pose& X_WB, const FixedBody& other) const;

 private:
  struct Geometry;
  // FCL's direction for one pose, evaluated at another.
  [[nodiscard]] Separator ask(const Pose& X_WB_asked, const Pose& X_WB,
                              const FixedBody& other) const;
  [[nodiscard]] double least(const Pose& X_WB, const Eigen::Vector3d& n_W) const;

  // Vertices in B, one column per coordinate.
  Eigen::Matrix<double, Eigen::Dynamic, 3> vertices_B_;
  double radius_ = 0.0;
  std::unique_ptr<Geometry> geometry_;
};

}  // namespace dive::planning::certify
