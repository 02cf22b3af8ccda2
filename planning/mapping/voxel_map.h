#pragma once
// The cells of the observed map and their voxels: which are occupied, and which cells changed.
// Internal.

#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/se3.h"
#include "planning/mapping/cell_grid.h"
#include "planning/mapping/mapper_options.h"
#include "planning/mapping/range_image.h"
#include "planning/mapping/voxel_cell.h"
#include "planning/world/obstacle_update.h"

namespace dive::planning {

class VoxelMap {
 public:
  using Cells = std::unordered_map<CellKey, Cell>;

  explicit VoxelMap(const MapperOptions& options);

  /// Sets the time of all changes until the next call.
  void set_time(Utime now) { now_ = now; }
  [[nodiscard]] Utime time() const { return now_; }

  /// Adds a point of the present scan, of standard deviation `sigma` (m).
  void observe(const Eigen::Vector3f& p_W, float sigma);
  /// Adds a point that needs no confirmation, unless its voxel has one.
  void add_confirmed(const Eigen::Vector3f& p_W);
  /// Deletes candidates that stayed unconfirmed, and voxels that rays of the scan passed through.
  void remove_passed(const RangeImage& image);
  /// Deletes cells that were not observed for `memory_s`, and the oldest beyond `max_voxels` and
  /// kMaxCells.
  void forget_old();
  /// Deletes the oldest cells until the pieces of all are no more than kMaxMovedPieces.
  void forget_beyond_one_move();
  /// Moves each confirmed voxel by the correction at the time of its last observation.
  void move(const MapCorrection& correction);

  /// The piece nearest to p_W in its cell, within `reach` m, and the signed distance from its
  /// plane; null if there is none.
  [[nodiscard]] const Facet* nearest(const Eigen::Vector3f& p_W, float reach, float& height) const;
  /// Everything that changed since the last call, by cell in ascending order.
  [[nodiscard]] ObstacleUpdate take_changes();
  /// One point per confirmed voxel, by cell and voxel in ascending order.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;

  /// For the surface builder, which replaces the cells' surfaces.
  [[nodiscard]] Cells& cells() { return cells_; }
  [[nodiscard]] const Cells& cells() const { return cells_; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] std::size_t voxels() const { return voxels_; }

 private:
  /// Of a map that moves: the control thread takes all of them over in one tick.
  static constexpr std::size_t kMaxMovedPieces = 16'384;
  /// When all cells move, one update has those that were there and those that are.
  static constexpr std::size_t kMaxCells = kMaxUpdateCells / 2;

  [[nodiscard]] bool has_too_many() const;
  [[nodiscard]] std::vector<CellKey> oldest_first() const;
  Voxel& insert(Cell& cell, int place);
  void touch(Cell& cell) const;
  void confirm(Cell& cell, Voxel& voxel) const;
  void forget(CellKey key);

  MapperOptions options_;
  CellGrid grid_;
  Cells cells_;
  std::size_t voxels_ = 0;
  std::vector<CellKey> gone_;  ///< Cells deleted since the last take_changes().
  Utime now_ = 0;
  Utime next_forget_ = 0;
};

}  // namespace dive::planning
