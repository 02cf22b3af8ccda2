#include "planning/world/observed_map.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "planning/world/primitives.h"

namespace dive::planning {

bool ObservedMap::apply(const ObstacleUpdate& update) {
  std::optional<Utime>& newest = newest_.at(static_cast<std::size_t>(update.source));
  if ((newest && update.utime <= *newest) || !is_well_formed(update)) return false;
  newest = update.utime;
  if (update.cells.empty() && update.objects.empty()) return true;
  ++revision_;
  absent_.apply(update.objects);
  const std::span<const MapCell> changed(update.cells);
  auto next = std::make_shared<Blocks>();
  if (!blocks_) {
    append_blocks(merge({}, changed), *next);
  } else {
    next->reserve(blocks_->size() + 2);
    std::size_t begin = 0;
    for (std::size_t i = 0; i < blocks_->size(); ++i) {
      std::size_t end = changed.size();
      if (i + 1 < blocks_->size()) {  // what is below the next block belongs to this one
        const auto at = std::ranges::lower_bound(changed.subspan(begin), (*blocks_)[i + 1].first,
                                                 {}, &MapCell::key);
        end = static_cast<std::size_t>(at - changed.begin());
      }
      if (begin == end) {
        next->push_back((*blocks_)[i]);
      } else {
        append_blocks(merge(*(*blocks_)[i].cells, changed.subspan(begin, end - begin)), *next);
      }
      begin = end;
    }
  }
  pieces_ = 0;
  for (const Block& block : *next) pieces_ += block.pieces;
  blocks_ = next->empty() ? nullptr : std::move(next);
  return true;
}

ObservedMap::Cell ObservedMap::make_cell(const MapCell& changed) {
  auto pieces = std::make_shared<Pieces>();
  pieces->reserve(changed.pieces.size());
  Cell cell{changed.key, {}, nullptr};
  for (const Polytope& polytope : changed.pieces) {
    const Eigen::AlignedBox3d box = bounding_box(polytope);
    pieces->push_back({{{}, polytope, Pose{}, -1}, box});
    cell.box.extend(box);
  }
  cell.pieces = std::move(pieces);
  return cell;
}

// Cells without pieces are left out.
ObservedMap::Cells ObservedMap::merge(std::span<const Cell> cells,
                                      std::span<const MapCell> changed) {
  Cells merged;
  merged.reserve(cells.size() + changed.size());
  auto cell = cells.begin();
  for (const MapCell& change : changed) {
    for (; cell != cells.end() && cell->key < change.key; ++cell) merged.push_back(*cell);
    if (cell != cells.end() && cell->key == change.key) ++cell;
    if (!change.pieces.empty()) merged.push_back(make_cell(change));
  }
  merged.insert(merged.end(), cell, cells.end());
  return merged;
}

// Cuts into as few parts as possible, of similar sizes.
void ObservedMap::append_blocks(std::span<const Cell> cells, Blocks& blocks) {
  const std::size_t count = (cells.size() + kMaxBlockCells - 1) / kMaxBlockCells;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = i * cells.size() / count;
    const std::size_t end = (i + 1) * cells.size() / count;
    const std::span<const Cell> some = cells.subspan(begin, end - begin);
    Block block;
    block.first = some.front().key;
    for (const Cell& cell : some) {
      block.box.extend(cell.box);
      block.pieces += cell.pieces->size();
    }
    block.cells = std::make_shared<const Cells>(some.begin(), some.end());
    blocks.push_back(std::move(block));
  }
}

void ObservedMap::append_within(const Eigen::AlignedBox3d& box, std::vector<Obstacle>& out) const {
  if (!blocks_) return;
  for (const Block& block : *blocks_) {
    if (!block.box.intersects(box)) continue;
    for (const Cell& cell : *block.cells) {
      if (!cell.box.intersects(box)) continue;
      const Eigen::Vector3d centre = cell.box.center();
      const std::string name = fmt::format("an observed obstacle at {:.1f}, {:.1f}, {:.1f}",
                                           centre.x(), centre.y(), centre.z());
      for (const Piece& piece : *cell.pieces) {
        if (!piece.box.intersects(box)) continue;
        out.push_back(piece.obstacle);
        out.back().name = name;
      }
    }
  }
}

}  // namespace dive::planning
