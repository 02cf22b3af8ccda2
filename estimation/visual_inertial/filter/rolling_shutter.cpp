#include "estimation/visual_inertial/filter/rolling_shutter.h"

#include "common/se3.h"

namespace dive::estimation {
namespace {

Eigen::Vector2d at_frame_time(const CameraModel& camera, const Eigen::Vector2d& n,
                              const Eigen::Vector3d& rate_B) {
  if (camera.line_time_s == 0.0) return n;
  const auto pixel = camera.project(n.homogeneous());
  if (!pixel) return n;
  const Eigen::Quaterniond turn_B = so3_exp(camera.row_time(*pixel) * rate_B);
  const Eigen::Vector3d ray =
      camera.X_BC.q.conjugate() * (turn_B * (camera.X_BC.q * Eigen::Vector3d(n.homogeneous())));
  return ray.z() > 0.0 ? Eigen::Vector2d(ray.hnormalized()) : n;
}

}  // namespace

FeatureFrame at_one_time(FeatureFrame frame, std::span<const CameraModel> cameras,
                         const Eigen::Vector3d& rate_B) {
  for (FeatureObservation& feature : frame.features) {
    feature.left = at_frame_time(cameras[0], feature.left, rate_B);
    if (feature.right && cameras.size() > 1) {
      feature.right = at_frame_time(cameras[1], *feature.right, rate_B);
    }
  }
  return frame;
}

}  // namespace dive::estimation
