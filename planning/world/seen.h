#pragma once
// What has been seen of water that no map knows: convex pieces, by the cells of a grid in W. A cell
// is the unit in which the map changes.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/clock.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Names a cell; sorts the same on every machine.
using CellKey = std::int64_t;

/// All that is known to be solid in one cell from now on; nothing: it is empty again. A piece may
/// reach a little beyond its cell.
struct SeenCell {
  CellKey key = 0;
  std::vector<Polytope> pieces;  ///< In W; at most kMaxPieceVertices each.
};

inline constexpr std::size_t kMaxPieceVertices = 16;
inline constexpr std::size_t kMaxCellPieces = 1024;
inline constexpr std::size_t kMaxUpdateCells = 4096;
inline constexpr std::size_t kMaxUpdatePieces = 65'536;
inline constexpr double kMaxOff = 1.0;           ///< m that one update may move the vehicle.
inline constexpr double kMaxPieceExtent = 25.0;  ///< m, along each axis of W.

/// What one observation changed.
struct MapUpdate {
  Utime scan_utime = 0;         ///< When it was observed.
  std::vector<SeenCell> cells;  ///< Those that changed, ascending by key; may be none.
  /// m in the direction of motion (ahead, for a vehicle at rest) that the vehicle's hull could
  /// still move through water that was looked at.
  double seen_ahead_m = 0.0;
  /// m, horizontally: so far is the vehicle from where it was thought to be, by what it saw of the
  /// map it has made itself. No fix in W, but what keeps vehicle and map together.
  Eigen::Vector2d off_W = Eigen::Vector2d::Zero();
};

/// Is it something that a mapper can say: numbers finite, pieces and counts within the bounds
/// above, cells ascending and each named once?
[[nodiscard]] bool is_well_formed(const MapUpdate& update);

/// The map so far.
class SeenMap {
 public:
  /// False, and nothing changes, for an update that is not well-formed or not newer than the last.
  bool apply(const MapUpdate& update);
  [[nodiscard]] const std::map<CellKey, std::vector<Polytope>>& cells() const { return cells_; }
  [[nodiscard]] std::size_t pieces() const { return pieces_; }
  /// Appends what comes within `box`, as obstacles named "what was seen at x, y, z".
  void append_within(const Eigen::AlignedBox3d& box, std::vector<Obstacle>& out) const;

 private:
  std::map<CellKey, std::vector<Polytope>> cells_;
  std::size_t pieces_ = 0;
  std::optional<Utime> newest_;
};

}  // namespace dive::planning
