#pragma once
// The patterns of ACFR's primitives.

#include <vector>

#include <Eigen/Core>

namespace dive::mission {

/// A rectangle to be covered; x east, y north, m.
struct CoveredArea {
  Eigen::Vector2d begin;   ///< A corner.
  Eigen::Vector2d along;   ///< Unit vector along the first row.
  Eigen::Vector2d across;  ///< Unit vector towards the next row.
  double length = 0.0;     ///< Extent along the rows, m.
  double width = 0.0;      ///< Extent across the rows, m.
  double spacing = 0.0;    ///< Distance between rows, m, > 0.
};

/// Parallel rows along the length, swum back and forth.
[[nodiscard]] std::vector<Eigen::Vector2d> rows_over(const CoveredArea& area);

/// A spiral along the rectangle's edge, one spacing further in at each turn, until no space is
/// left.
[[nodiscard]] std::vector<Eigen::Vector2d> spiral_over(const CoveredArea& area);

}  // namespace dive::mission
