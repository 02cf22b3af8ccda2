#include "estimation/visual_inertial/filter/fitted_point.h"

#include <algorithm>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHuber = 2.0;           // sigmas of one image residual
constexpr double kMinDepthShare = 1e-3;  // of the ray's depth coordinate, in front of a camera

// One image of a point along its ray: m = ray + rho shift in that camera, as in view_of().
struct DepthView {
  Vector3d ray;
  Vector3d shift;
  Vector2d image;
  Eigen::Matrix2d whitening;
};

std::vector<DepthView> depth_views(const FeatureTrack& track, const FittedPoses& at,
                                   const FittedPoint& point, double pixel_sigma) {
  std::vector<DepthView> views;
  views.reserve(2 * track.observations.size());
  const Kinematics& anchor = at.frames[point.anchor];
  const Vector3d ray_W = anchor.q_WB * (at.cameras_B[0].q * point.image.homogeneous());
  const Vector3d from_W = anchor.p_WB + anchor.q_WB * at.cameras_B[0].p;
  for (const auto& view : track.observations) {
    const Kinematics& frame = at.frames[index_of(view)];
    const Matrix3d R_jT = frame.q_WB.conjugate().toRotationMatrix();
    for (std::size_t camera = 0; camera < (view.right ? 2U : 1U); ++camera) {
      const Pose& X_BC = at.cameras_B[camera];
      const Matrix3d R_CB = X_BC.q.conjugate().toRotationMatrix();
      views.push_back({R_CB * (R_jT * ray_W), R_CB * (R_jT * (from_W - frame.p_WB) - X_BC.p),
                       camera == 0 ? view.left : *view.right,
                       whitening_of(view, camera, pixel_sigma)});
    }
  }
  return views;
}

}  // namespace

std::optional<FittedView> view_of(const FittedPoint& point, const Kinematics& anchor,
                                  const Kinematics& frame, const Pose& X_BA, const Pose& X_BC) {
  const double rho = point.inverse_depth;
  const Vector3d h = point.image.homogeneous();
  const Matrix3d R_a = anchor.q_WB.toRotationMatrix();
  const Matrix3d R_BA = X_BA.q.toRotationMatrix();
  const Matrix3d R_jT = frame.q_WB.conjugate().toRotationMatrix();
  const Matrix3d R_CB = X_BC.q.conjugate().toRotationMatrix();
  const Vector3d s = R_BA * h + rho * X_BA.p;
  const Vector3d U = R_jT * (R_a * s + rho * (anchor.p_WB - frame.p_WB));
  const Vector3d m = R_CB * (U - rho * X_BC.p);
  if (!(m.z() > kMinDepthShare)) return std::nullopt;
  Matrix23d by_m;
  by_m << 1.0 / m.z(), 0.0, -m.x() / (m.z() * m.z()), 0.0, 1.0 / m.z(), -m.y() / (m.z() * m.z());
  const Matrix23d by_W = by_m * R_CB * R_jT;
  const Matrix23d by_s = by_W * R_a;
  FittedView result;
  result.image = m.head<2>() / m.z();
  result.by_anchor << by_s * -skew(s), rho * by_W;
  result.by_frame << by_m * R_CB * skew(U), -rho * by_W;
  result.by_anchor_camera << by_s * R_BA * -skew(h), rho * by_s;
  result.by_camera << by_m * skew(m), -rho * by_m * R_CB;
  result.by_point.leftCols<2>() = (by_s * R_BA).leftCols<2>();
  result.by_point.col(2) =
      by_m * R_CB * (R_jT * (R_a * X_BA.p + anchor.p_WB - frame.p_WB) - X_BC.p);
  return result;
}

double best_inverse_depth(const FeatureTrack& track, const FittedPoses& poses,
                          const FittedPoint& point, double pixel_sigma) {
  constexpr int kSteps = 8;
  constexpr double kLeast = 0.01;  // 1/m
  constexpr double kMost = 5.0;    // 1/m
  const double prior = weight_of(kInverseDepthSigma);
  const std::vector<DepthView> views = depth_views(track, poses, point, pixel_sigma);
  double rho = point.inverse_depth;
  for (int i = 0; i < kSteps; ++i) {
    double information = prior;
    double gradient = prior * (kUsualInverseDepth - rho);
    for (const DepthView& view : views) {
      const Vector3d m = view.ray + rho * view.shift;
      if (!(m.z() > kMinDepthShare)) continue;
      const Vector2d image = m.head<2>() / m.z();
      const Vector2d J = view.whitening * (view.shift.head<2>() - image * view.shift.z()) / m.z();
      information += J.squaredNorm();
      gradient += J.dot(view.whitening * (view.image - image));
    }
    rho = std::clamp(rho + gradient / information, kLeast, kMost);
  }
  return rho;
}

RobustLoss huber(double sigmas) {
  if (sigmas <= kHuber) return {sigmas * sigmas, 1.0};
  return {kHuber * (2.0 * sigmas - kHuber), kHuber / sigmas};
}

}  // namespace dive::estimation
