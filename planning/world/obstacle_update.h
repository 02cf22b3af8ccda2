#pragma once
// A change of the observed map: convex pieces, by the cells of a grid in W. A cell is the unit in
// which the map changes. Where the mission trusts absence, also objects of the known map that are
// gone, or back.

#include <cstddef>
#include <cstdint>
#include <limits>
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
inline constexpr std::size_t kMaxUpdateCells = 16'384;
inline constexpr std::size_t kMaxUpdatePieces = 65'536;
inline constexpr double kMaxPieceExtent = 25.0;  ///< m, along each axis of W.

inline constexpr std::size_t kMaxUpdateObjects = 256;
inline constexpr std::int32_t kMaxObjectObstacles = 65'536;

/// Origin of an update. Each source has cells of its own.
enum class ObstacleSource {
  kMapper,  ///< Scans of the mapping sensor; keys >= 0, cells of the mapper's grid.
  kScript,  ///< Scenarios and faults of simulated dives; keys < 0, one for each obstacle.
  /// Scans that see through mapped objects; kAbsenceKeys keys from kFirstAbsenceKey on, which no
  /// script uses: the parts of absent objects that no scan has seen through.
  kAbsence,
};
inline constexpr ObstacleSource kLastObstacleSource = ObstacleSource::kAbsence;
inline constexpr std::size_t kObstacleSources = static_cast<std::size_t>(kLastObstacleSource) + 1;
inline constexpr CellKey kFirstAbsenceKey = std::numeric_limits<CellKey>::min() / 2;
inline constexpr CellKey kAbsenceKeys = CellKey{1} << 32;

/// An object of the known map that is gone from now on, or is there again.
struct ObjectChange {
  std::int32_t first = 0;  ///< Its first obstacle; see object_at().
  std::int32_t count = 1;  ///< Number of its obstacles.
  bool is_absent = false;
  std::int32_t scans = 0;   ///< Number of scans that saw through it.
  double seen_share = 0.0;  ///< Share of it that they saw through.
};

struct ObstacleUpdate {
  ObstacleSource source = ObstacleSource::kMapper;
  Utime utime = 0;                         ///< Time of the observation.
  std::vector<MapCell> cells;              ///< Changed cells, ascending by key.
  std::vector<ObjectChange> objects = {};  ///< Of kAbsence only, ascending without overlap.
};

/// True if all numbers are finite, pieces and counts are within the bounds above, and keys and
/// objects ascend and belong to the source.
[[nodiscard]] bool is_well_formed(const ObstacleUpdate& update);

}  // namespace dive::planning
