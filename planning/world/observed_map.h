#pragma once
// The obstacles observed during a dive. A copy is a snapshot: it shares all cells with the
// original, costs a pointer, and does not change when the original is updated. One owner applies
// the updates; planner, executive and recorder hold snapshots.
//
//   map -> blocks of up to kMaxBlockCells cells, ascending by key -> cells -> pieces
//
// Blocks and cells are immutable and carry bounding boxes. An update replaces the changed cells and
// their blocks, so that it costs what it brings and one pointer for each block; a query skips whole
// blocks by their boxes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/clock.h"
#include "planning/world/absent_objects.h"
#include "planning/world/obstacle_update.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Snapshots may be read by several threads at the same time.
class ObservedMap {
 public:
  struct Piece {
    Obstacle obstacle;        ///< A polytope in W, without a name.
    Eigen::AlignedBox3d box;  ///< Its bounding box.
  };

  /// False, and nothing changes, for an update that is not well-formed, or not newer than the last
  /// of its source. The only check of updates on board.
  bool apply(const ObstacleUpdate& update);

  /// Number of updates so far that changed cells or objects; 0: nothing has ever been observed.
  [[nodiscard]] std::int64_t revision() const { return revision_; }
  [[nodiscard]] std::size_t pieces() const { return pieces_; }
  /// The objects of the known map that are gone.
  [[nodiscard]] const AbsentObjects& absent() const { return absent_; }

  /// Calls `visit` with each piece whose box intersects `box`, by cell and piece in ascending
  /// order, until it returns false. Allocates nothing.
  template <class Visit>
  void visit(const Eigen::AlignedBox3d& box, Visit&& visit) const;
  /// Calls `visit` with the key and the pieces of each cell, ascending by key.
  template <class Visit>
  void visit_cells(Visit&& visit) const;
  /// Appends the pieces that intersect `box`, named "an observed obstacle at x, y, z".
  void append_within(const Eigen::AlignedBox3d& box, std::vector<Obstacle>& out) const;

 private:
  static constexpr std::size_t kMaxBlockCells = 32;

  using Pieces = std::vector<Piece>;
  struct Cell {
    CellKey key = 0;
    Eigen::AlignedBox3d box;
    std::shared_ptr<const Pieces> pieces;
  };
  using Cells = std::vector<Cell>;
  struct Block {
    CellKey first = 0;  ///< Key of its first cell.
    Eigen::AlignedBox3d box;
    std::size_t pieces = 0;  ///< Number of pieces in its cells.
    std::shared_ptr<const Cells> cells;
  };
  using Blocks = std::vector<Block>;

  [[nodiscard]] static Cell make_cell(const MapCell& changed);
  [[nodiscard]] static Cells merge(std::span<const Cell> cells, std::span<const MapCell> changed);
  static void append_blocks(std::span<const Cell> cells, Blocks& blocks);

  std::shared_ptr<const Blocks> blocks_;  ///< Null: no cells.
  std::size_t pieces_ = 0;
  std::int64_t revision_ = 0;
  AbsentObjects absent_;
  std::array<std::optional<Utime>, kObstacleSources> newest_;  ///< Last update, by source.
};

template <class Visit>
void ObservedMap::visit(const Eigen::AlignedBox3d& box, Visit&& visit) const {
  if (!blocks_) return;
  for (const Block& block : *blocks_) {
    if (!block.box.intersects(box)) continue;
    for (const Cell& cell : *block.cells) {
      if (!cell.box.intersects(box)) continue;
      for (const Piece& piece : *cell.pieces) {
        if (piece.box.intersects(box) && !visit(piece)) return;
      }
    }
  }
}

template <class Visit>
void ObservedMap::visit_cells(Visit&& visit) const {
  if (!blocks_) return;
  for (const Block& block : *blocks_) {
    for (const Cell& cell : *block.cells) visit(cell.key, std::span<const Piece>(*cell.pieces));
  }
}

}  // namespace dive::planning
