#include "planning/certify/position_margin.h"

#include <algorithm>
#include <cmath>

namespace dive::planning {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 3.0;         // m: farther obstacles are no danger
constexpr double kDepthSigma = 0.05;  // m: offset of the sensor, and height of what is mapped
constexpr double kFullyKnown = 1e-3;  // m: a smaller sigma counts as this

}  // namespace

PositionMarginMeter::PositionMarginMeter(const RobotHull& hull)
    : hull_B_(hull.hull_vertices()), radius_(hull.radius()) {
  hull_W_.reserve(hull_B_.size());
}

void PositionMarginMeter::reserve(Scene& scene) {
  constexpr std::size_t kNearby = 256;  // obstacles
  contacts_.reserve(kNearby);
  scene.reserve(hull_B_.size());
}

void PositionMarginMeter::reduce(Scene& scene, const Pose& X_WB, const Eigen::Matrix2d& P_W,
                                 PositionMargin& least) {
  if (scene.point_distance(X_WB.p) > kNear + radius_) return;
  hull_W_.clear();
  for (const Vector3d& vertex : hull_B_) hull_W_.push_back(X_WB * vertex);
  scene.contacts(hull_W_, kNear, contacts_);
  for (const Contact& contact : contacts_) {
    const Vector3d& n = contact.normal_W;
    const double variance = n.head<2>().dot(P_W * n.head<2>()) + std::pow(kDepthSigma * n.z(), 2);
    const double sigma = std::max(std::sqrt(variance), kFullyKnown);
    const double margin = (contact.distance - kFollowerTube) / sigma;
    if (margin >= least.margin_sigma) continue;
    least = {margin, X_WB.p, contact.obstacle, contact.distance, sigma};
  }
}

}  // namespace dive::planning
