#include "estimation/visual_inertial/filter/landmark_points.h"

#include "common/se3.h"

namespace dive::estimation {
namespace {

// The part of a landmark's covariance that is not the vehicle's.
Eigen::Matrix3d own_covariance(const StateEstimate& estimate, const Landmark& landmark) {
  const Eigen::Matrix3d R_WB = estimate.X_WB.q.toRotationMatrix();
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << Eigen::Matrix3d::Identity(), -skew(landmark.p_W - estimate.X_WB.p) * R_WB;
  return landmark.covariance - by_pose * estimate.covariance * by_pose.transpose();
}

}  // namespace

std::vector<Eigen::Vector3f> landmark_points_B(const StateEstimate& estimate,
                                               std::span<const Landmark> landmarks,
                                               const RangeNoise& limit) {
  std::vector<Eigen::Vector3f> points_B;
  const Pose X_BW = estimate.X_WB.inverse();
  for (const Landmark& landmark : landmarks) {
    const Eigen::Vector3d p_B = X_BW * landmark.p_W;
    const Eigen::Matrix3d own = own_covariance(estimate, landmark);
    if (!p_B.allFinite() || !own.allFinite()) continue;
    if (largest_sigma(own) <= limit.sigma(p_B.norm())) points_B.push_back(p_B.cast<float>());
  }
  return points_B;
}

}  // namespace dive::estimation
