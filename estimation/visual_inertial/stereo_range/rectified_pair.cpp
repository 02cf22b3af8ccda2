#include "estimation/visual_inertial/stereo_range/rectified_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Failure = tl::unexpected<std::string>;

constexpr double kMinBaseline = 1e-3;  // m
constexpr double kMaxHalfView = 2.1;   // tan(65 degrees): beyond it a plane image is mostly edge
const double kMinAgreement = std::cos(deg_to_rad(45.0));

// The focal length at which a plane image of the camera's size spans what the camera images on the
// rows and columns through the principal point, up to kMaxHalfView to each side; at most the
// camera's own.
double covering_focal(const CameraModel& camera) {
  double f = camera.focal();
  const auto spans = [&](const Vector2d& pixel, int axis, double reach) {
    const auto n = camera.undistort(pixel);
    const double edge = n ? std::abs((*n)[axis]) : kMaxHalfView;
    if (reach > 0.0) f = std::min(f, reach / std::min(edge, kMaxHalfView));
  };
  spans({0.0, camera.cy}, 0, camera.cx);
  spans({camera.width - 1.0, camera.cy}, 0, camera.width - 1.0 - camera.cx);
  spans({camera.cx, 0.0}, 1, camera.cy);
  spans({camera.cx, camera.height - 1.0}, 1, camera.height - 1.0 - camera.cy);
  return f;
}

}  // namespace

tl::expected<RectifiedPair, std::string> rectify(const CameraModel& left,
                                                 const CameraModel& right) {
  for (const CameraModel* camera : {&left, &right}) {
    if (std::string why = camera->validate(); !why.empty()) return Failure(std::move(why));
  }
  if (left.width != right.width || left.height != right.height) {
    return Failure(fmt::format("images of {} x {} and {} x {} pixels are no pair", left.width,
                               left.height, right.width, right.height));
  }
  const Vector3d across = right.X_BC.p - left.X_BC.p;
  if (!(across.norm() > kMinBaseline)) {
    return Failure(fmt::format("cameras {:g} m apart give no ranges", across.norm()));
  }
  const Matrix3d R_BL = left.X_BC.q.toRotationMatrix();
  const Matrix3d R_BR = right.X_BC.q.toRotationMatrix();
  if (R_BL.col(2).dot(R_BR.col(2)) < kMinAgreement) {
    return Failure("the cameras point in different directions");
  }
  const Vector3d x = across.normalized();
  if (x.dot(R_BL.col(0)) < kMinAgreement || x.dot(R_BR.col(0)) < kMinAgreement) {
    return Failure("the second camera is not to the right of the first");
  }
  const Vector3d y = (R_BL.col(2) + R_BR.col(2)).cross(x).normalized();
  Matrix3d R_BV;
  R_BV << x, y, x.cross(y);

  RectifiedPair pair;
  pair.width = left.width;
  pair.height = left.height;
  pair.f = std::min(covering_focal(left), covering_focal(right));
  pair.cx = 0.5 * (left.cx + right.cx);
  pair.cy = 0.5 * (left.cy + right.cy);
  pair.baseline_m = across.norm();
  pair.X_BV = {left.X_BC.p, Eigen::Quaterniond(R_BV)};
  return pair;
}

std::vector<Eigen::Vector2f> seen_from(const RectifiedPair& pair, const CameraModel& camera) {
  const Matrix3d R_CV = (camera.X_BC.q.conjugate() * pair.X_BV.q).toRotationMatrix();
  const Eigen::Vector2f nowhere =
      Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
  std::vector<Eigen::Vector2f> map;
  map.reserve(static_cast<std::size_t>(pair.width) * static_cast<std::size_t>(pair.height));
  for (int v = 0; v < pair.height; ++v) {
    for (int u = 0; u < pair.width; ++u) {
      const Vector3d ray_C = R_CV * pair.ray(u, v);
      const auto pixel = camera.project(ray_C);
      const bool is_seen = pixel && camera.in_image(*pixel);
      map.push_back(is_seen ? Eigen::Vector2f(pixel->cast<float>()) : nowhere);
    }
  }
  return map;
}

}  // namespace dive::estimation
