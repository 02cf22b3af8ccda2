#include "common/camera_model.h"

#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

namespace dive {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double kNear = 1e-6;    // minimum of z; nearer, the projection is singular
constexpr double kExact = 1e-12;  // tolerance of n
constexpr int kMaxIterations = 20;

Vector2d distorted(const std::array<double, 4>& k, const Vector2d& n) {
  const double r2 = n.squaredNorm();
  const double radial = 1.0 + k[0] * r2 + k[1] * r2 * r2;
  const double xy = 2.0 * n.x() * n.y();
  return {radial * n.x() + k[2] * xy + k[3] * (r2 + 2.0 * n.x() * n.x()),
          radial * n.y() + k[2] * (r2 + 2.0 * n.y() * n.y()) + k[3] * xy};
}

Matrix2d distortion_jacobian(const std::array<double, 4>& k, const Vector2d& n) {
  const double x = n.x();
  const double y = n.y();
  const double r2 = n.squaredNorm();
  const double radial = 1.0 + k[0] * r2 + k[1] * r2 * r2;
  const double slope = 2.0 * (k[0] + 2.0 * k[1] * r2);
  const double cross = slope * x * y + 2.0 * (k[2] * x + k[3] * y);
  Matrix2d J;
  J << radial + slope * x * x + 2.0 * k[2] * y + 6.0 * k[3] * x, cross, cross,
      radial + slope * y * y + 6.0 * k[2] * y + 2.0 * k[3] * x;
  return J;
}

}  // namespace

std::string CameraModel::validate() const {
  if (width < 16 || height < 16 || width > 20'000 || height > 20'000) {
    return fmt::format("an image of {} x {} pixels; each must be from 16 to 20000", width, height);
  }
  if (!(fx > 1.0 && fx < 1e6 && fy > 1.0 && fy < 1e6)) {
    return fmt::format("focal lengths of {} and {} pixels; each must be from 1 to 1e6", fx, fy);
  }
  if (!std::isfinite(cx) || !std::isfinite(cy)) return "its principal point is not a number";
  for (const double k : radtan) {
    if (!(std::abs(k) <= 10.0)) return fmt::format("a distortion coefficient of {}", k);
  }
  if (!X_BC.is_finite()) return "its pose in the body is not finite";
  return {};
}

Vector2d CameraModel::distort(const Vector2d& normalised) const {
  const Vector2d d = distorted(radtan, normalised);
  return {fx * d.x() + cx, fy * d.y() + cy};
}

std::optional<Vector2d> CameraModel::undistort(const Vector2d& pixel) const {
  const Vector2d wanted((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  Vector2d n = wanted;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Vector2d error = distorted(radtan, n) - wanted;
    if (error.norm() < kExact) return n;
    const Matrix2d J = distortion_jacobian(radtan, n);
    if (!(J.determinant() > 0.0)) return std::nullopt;  // beyond the fold of the image
    n -= J.inverse() * error;
  }
  return std::nullopt;
}

std::optional<Vector2d> CameraModel::project(const Eigen::Vector3d& p_C) const {
  if (!(p_C.z() > kNear)) return std::nullopt;
  return distort(p_C.head<2>() / p_C.z());
}

bool CameraModel::in_image(const Vector2d& pixel, double border) const {
  return pixel.x() >= border - 0.5 && pixel.y() >= border - 0.5 &&
         pixel.x() <= width - 0.5 - border && pixel.y() <= height - 0.5 - border;
}

}  // namespace dive
