#pragma once
// A change of the observed map: convex pieces, by the cells of a grid in W. A cell is the unit in
// which the map changes.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/clock.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Names a cell; sorts the same on every machine.
using CellKey = std::int64_t;

/// Everything that is solid in one cell from now on; no pieces: the cell is empty again. A piece
/// may extend a little beyond its cell.
struct MapCell {
  CellKey key = 0;
  std::vector<Polytope> pieces;  ///< In W; at most kMaxPieceVertices vertices each.
};

inline constexpr std::size_t kMaxPieceVertices = 16;
inline constexpr std::size_t kMaxCellPieces = 1024;
inline constexpr std::size_t kMaxUpdateCells = 4096;
inline constexpr std::size_t kMaxUpdatePieces = 65'536;
inline constexpr double kMaxPieceExtent = 25.0;  ///< m, along each axis of W.

/// Origin of an update. Each source has cells of its own.
enum class ObstacleSource {
  kMapper,  ///< Scans of the mapping sensor; keys >= 0, cells of the mapper's grid.
  kScript,  ///< Scenarios and faults of simulated dives; keys < 0, one for each obstacle.
};
inline constexpr std::size_t kObstacleSources = 2;

struct ObstacleUpdate {
  ObstacleSource source = ObstacleSource::kMapper;
  Utime utime = 0;             ///< Time of the observation.
  std::vector<MapCell> cells;  ///< Changed cells, ascending by key.
};

/// True if all numbers are finite, pieces and counts are within the bounds above, and the keys
/// ascend and belong to the source.
[[nodiscard]] bool is_well_formed(const ObstacleUpdate& update);

}  // namespace dive::planning
