#pragma once
// The cell of the map, and the voxel in it, that contain a point. Internal.

#include <optional>

#include <Eigen/Core>

#include "planning/world/obstacle_update.h"

namespace dive::planning {

[[nodiscard]] CellKey key_of(const Eigen::Vector3i& cell);
[[nodiscard]] Eigen::Vector3i cell_of(CellKey key);

class CellGrid {
 public:
  /// `voxel_m`: width of a voxel, m.
  explicit CellGrid(float voxel_m);

  struct Place {
    CellKey key;
    int voxel;  ///< Index of the voxel in the cell.
  };
  /// Absent for a point that is not finite, or beyond the range of any vehicle.
  [[nodiscard]] std::optional<Place> locate(const Eigen::Vector3f& p_W) const;
  [[nodiscard]] float voxel_m() const { return voxel_m_; }
  [[nodiscard]] float cell_m() const { return cell_m_; }

 private:
  float voxel_m_;
  float cell_m_;
};

}  // namespace dive::planning
