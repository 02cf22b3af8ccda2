#include "estimation/visual_inertial/filter/triangulation.h"

#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace dive::estimation {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

constexpr double kMinFeatureDepth = 0.1;      // m
constexpr double kMaxDepth = 60.0;            // m
constexpr double kMaxDepthShare = 1.0 / 3.0;  // sigma of the depth over the depth
constexpr int kMaxIterations = 10;
constexpr double kConverged = 1e-9;      // step size, normalised
constexpr double kRaysCondition = 1e-8;  // least over largest eigenvalue

// Pose of a camera relative to the anchor: h = rotation [a, b, 1] + rho * translation.
struct Relative {
  Matrix3d rotation;
  Vector3d translation;
  Vector2d image;
  Eigen::Matrix2d to_pixels;
};

Matrix23d projection_jacobian(const Vector3d& h) {
  Matrix23d J;
  J << 1.0 / h.z(), 0.0, -h.x() / (h.z() * h.z()), 0.0, 1.0 / h.z(), -h.y() / (h.z() * h.z());
  return J;
}

tl::expected<Vector3d, TriangulationError> nearest_to_rays(std::span<const View> views) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const View& view : views) {
    const Vector3d ray = view.X_WC.q * view.image.homogeneous().normalized();
    const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
    A += across;
    b += across * (view.X_WC.p - views.back().X_WC.p);
  }
  Eigen::SelfAdjointEigenSolver<Matrix3d> eigen;
  eigen.computeDirect(A);
  if (!(eigen.eigenvalues()[0] > kRaysCondition * eigen.eigenvalues()[2])) {
    return tl::make_unexpected(TriangulationError::kNoParallax);
  }
  return Vector3d(A.ldlt().solve(b));  // position from the anchor
}

struct Linearised {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();
  double cost = 0.0;
  bool is_before_all = true;
};

Linearised linearise(std::span<const Relative> cameras, const Vector3d& x) {
  Linearised sum;
  for (const Relative& camera : cameras) {
    const Vector3d h = camera.rotation.leftCols<2>() * x.head<2>() + camera.rotation.col(2) +
                       x.z() * camera.translation;
    if (h.z() < 1e-6) {
      sum.is_before_all = false;
      return sum;
    }
    Matrix3d by_x = camera.rotation;
    by_x.col(2) = camera.translation;
    const Matrix23d J = camera.to_pixels * projection_jacobian(h) * by_x;
    const Vector2d residual = camera.to_pixels * (camera.image - h.head<2>() / h.z());
    sum.information.noalias() += J.transpose() * J;
    sum.gradient.noalias() += J.transpose() * residual;
    sum.cost += residual.squaredNorm();
  }
  return sum;
}

}  // namespace

tl::expected<Triangulated, TriangulationError> triangulate(std::span<const View> views,
                                                           double sigma) {
  using Error = TriangulationError;
  if (views.size() < 2) return tl::make_unexpected(Error::kTooFewViews);
  const Pose& X_WA = views.back().X_WC;
  const auto begin_W = nearest_to_rays(views);
  if (!begin_W) return tl::make_unexpected(begin_W.error());
  const Vector3d begin_A = X_WA.q.conjugate() * *begin_W;
  if (!(begin_A.z() > kMinFeatureDepth)) return tl::make_unexpected(Error::kBehind);
  std::vector<Relative> cameras;
  cameras.reserve(views.size());
  for (const View& view : views) {
    const Matrix3d R_CW = view.X_WC.q.conjugate().toRotationMatrix();
    cameras.push_back({R_CW * X_WA.q.toRotationMatrix(), R_CW * (X_WA.p - view.X_WC.p), view.image,
                       view.to_pixels});
  }

  Vector3d x(begin_A.x() / begin_A.z(), begin_A.y() / begin_A.z(), 1.0 / begin_A.z());
  Linearised at = linearise(cameras, x);
  for (int i = 0;; ++i) {
    if (!at.is_before_all) return tl::make_unexpected(Error::kBehind);
    const Vector3d step = at.information.ldlt().solve(at.gradient);
    if (!step.allFinite()) return tl::make_unexpected(Error::kNoParallax);
    x += step;
    at = linearise(cameras, x);
    if (step.norm() < kConverged * (1.0 + x.norm())) break;
    if (i == kMaxIterations) return tl::make_unexpected(Error::kNotConverged);
  }
  if (!at.is_before_all || !(x.z() > 0.0)) return tl::make_unexpected(Error::kBehind);
  if (x.z() > 1.0 / kMinFeatureDepth) return tl::make_unexpected(Error::kBehind);
  if (x.z() < 1.0 / kMaxDepth) return tl::make_unexpected(Error::kTooFar);
  const Matrix3d covariance = at.information.inverse();
  const double depth_share = std::sqrt(covariance(2, 2)) / x.z();
  if (!(sigma * depth_share < kMaxDepthShare)) return tl::make_unexpected(Error::kNoParallax);
  // p_A = [x0, x1, 1] / x2
  Matrix3d by_x = Matrix3d::Identity() / x.z();
  by_x.col(2) = -Vector3d(x.x(), x.y(), 1.0) / (x.z() * x.z());
  by_x = X_WA.q.toRotationMatrix() * by_x;
  return Triangulated{X_WA * (Vector3d(x.x(), x.y(), 1.0) / x.z()),
                      by_x * covariance * by_x.transpose(), at.cost};
}

}  // namespace dive::estimation
