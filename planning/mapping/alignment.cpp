#include "planning/mapping/alignment.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

namespace dive::planning {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr int kMinPoints = 40;                                       // points on the map
constexpr std::array<float, 4> kReach = {0.4F, 0.25F, 0.2F, 0.15F};  // m, one per iteration
constexpr float kDriftPerSweep = 0.02F;  // m, one sigma, of the vehicle relative to the map
constexpr float kIndependent = 0.05F;    // share of the points: errors of neighbours are correlated
constexpr float kParallel = 0.82F;       // cosine between the point's normal and the map's
constexpr float kMaxShift = 0.2F;        // m, largest correction by one scan

}  // namespace

Vector2f align_to_map(std::span<const MapPoint> points, const NearestFacet& nearest) {
  Vector2f t = Vector2f::Zero();
  for (const float reach : kReach) {
    Eigen::Matrix2f H = Eigen::Matrix2f::Identity() / (kDriftPerSweep * kDriftPerSweep);
    Vector2f g = H * t;
    int used = 0;
    for (const auto& [p_W, normal_W, sigma] : points) {
      float height = 0.0F;
      const Facet* facet = nearest(p_W + Vector3f(t.x(), t.y(), 0.0F), reach, height);
      if (facet == nullptr) continue;
      // Beside a sharp edge the facet around the corner may be the only one.
      if (normal_W && std::abs(normal_W->dot(facet->normal())) < kParallel) continue;
      const float robust = std::min(1.0F, 1.5F * sigma / std::max(std::abs(height), 1e-6F));
      const float weight = kIndependent * robust / (sigma * sigma);
      const Vector2f n = facet->normal().head<2>();
      H += weight * n * n.transpose();
      g += weight * height * n;
      ++used;
    }
    if (used < kMinPoints) return Vector2f::Zero();
    t -= H.ldlt().solve(g);
  }
  return t.norm() <= kMaxShift ? t : Vector2f(t * (kMaxShift / t.norm()));
}

}  // namespace dive::planning
