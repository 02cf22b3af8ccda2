#include "planning/map_matching/expected_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace dive::planning {
namespace {

constexpr int kColumns = 24;  // with the rows as many rays as the matcher uses of a scan
constexpr int kRows = 18;
constexpr double kRayStep = 2.0;     // m, longest step along a ray
constexpr double kRayHit = 0.003;    // m from a surface at which the ray has met it
constexpr int kMaxRaySteps = 120;    // a ray that grazes a surface is given up then
constexpr double kNothing = 1.1;     // of the reach: the ray found nothing
constexpr double kHeadingDeg = 2.0;  // one sigma of the heading before the scan

std::vector<Eigen::Vector3d> rays_of(const RangeView& view) {
  const PixelGrid grid(view, kColumns, kRows);
  std::vector<Eigen::Vector3d> rays_B;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      rays_B.push_back(view.q_BC() * grid.centre(column, row).normalized());
    }
  }
  return rays_B;
}

}  // namespace

ExpectedView::ExpectedView(const World& world, const RangeView& view)
    : surface_(std::make_shared<MapSurface>(world)),
      matcher_(surface_),
      view_(view),
      rays_B_(rays_of(view)) {}

// Sphere tracing (Hart 1996): a step as long as the distance to the nearest surface meets none.
double ExpectedView::range(const Eigen::Vector3d& origin_W,
                           const Eigen::Vector3d& direction_W) const {
  double far = view_.reach_m;
  if (direction_W.z() > 0.0) far = std::min(far, -origin_W.z() / direction_W.z());
  double along = 0.0;
  for (int step = 0; step < kMaxRaySteps && along < far; ++step) {
    const auto near = surface_->nearest(origin_W + along * direction_W, origin_W, kRayStep);
    const double distance = near ? std::abs(near->height) : kRayStep;
    if (distance < kRayHit) return along;
    along += distance;
  }
  return kNothing * view_.reach_m;
}

RangeScan ExpectedView::scan_at(const Pose& X_WB) const {
  RangeScan scan;
  scan.origin_B = view_.origin_B.cast<float>();
  scan.reach = static_cast<float>(view_.reach_m);
  scan.points_B.reserve(rays_B_.size());
  const Eigen::Vector3d origin_W = X_WB * view_.origin_B;
  for (const Eigen::Vector3d& ray_B : rays_B_) {
    const double along = range(origin_W, X_WB.q * ray_B);
    scan.points_B.emplace_back((view_.origin_B + along * ray_B).cast<float>());
  }
  return scan;
}

Eigen::Matrix3d ExpectedView::information(const Pose& X_WB) const {
  return matcher_.expected_information(scan_at(X_WB), X_WB);
}

double ExpectedView::worst_sigma(const Pose& X_WB) const {
  const Eigen::Matrix3d all = information(X_WB);
  const double heading = std::pow(deg_to_rad(kHeadingDeg), -2) + all(2, 2);
  const Eigen::Vector2d cross = all.topRightCorner<2, 1>();
  const Eigen::Matrix2d position = all.topLeftCorner<2, 2>() - cross * cross.transpose() / heading;
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position).eigenvalues().minCoeff();
  return least > 0.0 ? 1.0 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

}  // namespace dive::planning
