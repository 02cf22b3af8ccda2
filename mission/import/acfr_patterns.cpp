#include "mission/import/acfr_patterns.h"

#include <algorithm>

namespace dive::mission {

using Eigen::Vector2d;

std::vector<Vector2d> rows_over(const CoveredArea& area) {
  std::vector<Vector2d> points;
  const int rows = static_cast<int>(area.width / area.spacing) + 1;
  for (int row = 0; row < rows; ++row) {
    const Vector2d near = area.begin + row * area.spacing * area.across;
    const Vector2d far = near + area.length * area.along;
    points.push_back(row % 2 == 0 ? near : far);
    points.push_back(row % 2 == 0 ? far : near);
  }
  return points;
}

std::vector<Vector2d> spiral_over(const CoveredArea& area) {
  std::vector<Vector2d> points;
  const auto at = [&](double l, double w) {
    return Vector2d(area.begin + l * area.along + w * area.across);
  };
  const double shorter = std::min(area.length, area.width);
  for (double in = 0.0; 2.0 * in <= shorter; in += area.spacing) {
    points.push_back(at(in > 0.0 ? in - area.spacing : 0.0, in));
    points.push_back(at(area.length - in, in));
    points.push_back(at(area.length - in, area.width - in));
    points.push_back(at(in, area.width - in));
  }
  return points;
}

}  // namespace dive::mission
