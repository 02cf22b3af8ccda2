#include "planning/world/solid_points.h"

namespace dive::planning {

SolidPoints::SolidPoints(std::span<const Eigen::Vector3d> points) { assign(points); }

void SolidPoints::assign(std::span<const Eigen::Vector3d> points) {
  xyz_.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    xyz_.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  }
  along_.resize(xyz_.rows());
}

void SolidPoints::assign_seen_from(const Eigen::Matrix3d& R_WO, const Eigen::Vector3d& p_WO,
                                   const SolidPoints& points_W) {
  xyz_.resize(points_W.xyz_.rows(), 3);
  along_.resize(xyz_.rows());
  const Eigen::Vector3d shift = R_WO.transpose() * p_WO;
  for (int k = 0; k < 3; ++k) {
    xyz_.col(k) = (R_WO(0, k) * points_W.xyz_.col(0) + R_WO(1, k) * points_W.xyz_.col(1) +
                   R_WO(2, k) * points_W.xyz_.col(2))
                      .array() -
                  shift(k);
  }
}

std::size_t SolidPoints::lowest(const Eigen::Vector3d& n) const {
  along_ = n.x() * xyz_.col(0) + n.y() * xyz_.col(1) + n.z() * xyz_.col(2);
  const double least = along_.minCoeff();
  Eigen::Index i = 0;
  while (i + 1 < along_.size() && along_(i) != least) ++i;
  return static_cast<std::size_t>(i);
}

Eigen::Vector3d SolidPoints::low() const { return xyz_.colwise().minCoeff().transpose(); }
Eigen::Vector3d SolidPoints::high() const { return xyz_.colwise().maxCoeff().transpose(); }

}  // namespace dive::planning
