#include "planning/world/obstacle_update.h"

namespace dive::planning {

namespace {

constexpr double kMaxCoordinate = 1e6;  // m from W's origin

bool is_well_formed(const Polytope& piece) {
  if (piece.vertices.empty() || piece.vertices.size() > kMaxPieceVertices) return false;
  if (!(piece.radius >= 0.0 && piece.radius <= kMaxPieceExtent)) return false;  // false for NaN
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : piece.vertices) {
    if (!(v.cwiseAbs().maxCoeff() <= kMaxCoordinate) || !v.allFinite()) return false;
    box.extend(v);
  }
  return box.sizes().maxCoeff() <= kMaxPieceExtent;
}

}  // namespace

bool is_well_formed(const ObstacleUpdate& update) {
  if (update.cells.size() > kMaxUpdateCells) return false;
  std::size_t pieces = 0;
  for (std::size_t i = 0; i < update.cells.size(); ++i) {
    const MapCell& cell = update.cells[i];
    if ((cell.key < 0) != (update.source == ObstacleSource::kScript)) return false;
    if (i > 0 && cell.key <= update.cells[i - 1].key) return false;
    pieces += cell.pieces.size();
    if (cell.pieces.size() > kMaxCellPieces || pieces > kMaxUpdatePieces) return false;
    for (const Polytope& piece : cell.pieces) {
      if (!is_well_formed(piece)) return false;
    }
  }
  return true;
}

}  // namespace dive::planning
