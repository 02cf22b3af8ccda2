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

bool belongs_to(CellKey key, ObstacleSource source) {
  if (source == ObstacleSource::kMapper) return key >= 0;
  const bool is_of_absence = key >= kFirstAbsenceKey && key < kFirstAbsenceKey + kAbsenceKeys;
  return key < 0 && is_of_absence == (source == ObstacleSource::kAbsence);
}

bool are_well_formed(const std::vector<ObjectChange>& objects) {
  if (objects.size() > kMaxUpdateObjects) return false;
  std::int64_t end = 0;
  for (const ObjectChange& object : objects) {
    if (object.first < end || object.count < 1 || object.scans < 0) return false;
    if (object.count > kMaxObjectObstacles) return false;
    if (!(object.seen_share >= 0.0 && object.seen_share <= 1.0)) return false;
    end = std::int64_t{object.first} + object.count;
  }
  return end <= std::numeric_limits<std::int32_t>::max();
}

}  // namespace

bool is_well_formed(const ObstacleUpdate& update) {
  if (update.cells.size() > kMaxUpdateCells || !are_well_formed(update.objects)) return false;
  if (!update.objects.empty() && update.source != ObstacleSource::kAbsence) return false;
  std::size_t pieces = 0;
  for (std::size_t i = 0; i < update.cells.size(); ++i) {
    const MapCell& cell = update.cells[i];
    if (!belongs_to(cell.key, update.source)) return false;
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
