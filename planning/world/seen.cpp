#include "planning/world/seen.h"

#include <cmath>

#include <fmt/format.h>

#include "planning/world/primitives.h"

namespace dive::planning {

namespace {

constexpr double kFarthest = 1e6;  // m from W's origin

bool is_well_formed(const Polytope& piece) {
  if (piece.vertices.empty() || piece.vertices.size() > kMaxPieceVertices) return false;
  if (!(piece.radius >= 0.0 && piece.radius <= kMaxPieceExtent)) return false;  // false for NaN
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : piece.vertices) {
    if (!(v.cwiseAbs().maxCoeff() <= kFarthest) || !v.allFinite()) return false;
    box.extend(v);
  }
  return box.sizes().maxCoeff() <= kMaxPieceExtent;
}

}  // namespace

bool is_well_formed(const MapUpdate& update) {
  if (!std::isfinite(update.seen_ahead_m) || !(update.off_W.norm() <= kMaxOff)) return false;
  if (update.cells.size() > kMaxUpdateCells) return false;
  std::size_t pieces = 0;
  for (std::size_t i = 0; i < update.cells.size(); ++i) {
    const SeenCell& cell = update.cells[i];
    if (i > 0 && cell.key <= update.cells[i - 1].key) return false;
    pieces += cell.pieces.size();
    if (cell.pieces.size() > kMaxCellPieces || pieces > kMaxUpdatePieces) return false;
    for (const Polytope& piece : cell.pieces) {
      if (!is_well_formed(piece)) return false;
    }
  }
  return true;
}

bool SeenMap::apply(const MapUpdate& update) {
  if ((newest_ && update.scan_utime <= *newest_) || !is_well_formed(update)) return false;
  newest_ = update.scan_utime;
  for (const SeenCell& cell : update.cells) {
    const auto at = cells_.find(cell.key);
    if (at != cells_.end()) {
      pieces_ -= at->second.size();
      if (cell.pieces.empty()) {
        cells_.erase(at);
        continue;
      }
      at->second = cell.pieces;
    } else if (!cell.pieces.empty()) {
      cells_.emplace(cell.key, cell.pieces);
    }
    pieces_ += cell.pieces.size();
  }
  return true;
}

void SeenMap::append_within(const Eigen::AlignedBox3d& box, std::vector<Obstacle>& out) const {
  for (const auto& [key, pieces] : cells_) {
    std::string name;  // of the cell: there are many pieces
    for (const Polytope& piece : pieces) {
      const Eigen::AlignedBox3d around = bounding_box(piece);
      if (!around.intersects(box)) continue;
      if (name.empty()) {
        const Eigen::Vector3d middle = around.center();
        name = fmt::format("what was seen at {:.1f}, {:.1f}, {:.1f}", middle.x(), middle.y(),
                           middle.z());
      }
      out.push_back({name, piece, Pose{}, -1});
    }
  }
}

}  // namespace dive::planning
