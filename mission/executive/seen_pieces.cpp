#include "mission/executive/seen_pieces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "planning/world/primitives.h"

namespace dive::mission {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kColumn = 0.5;   // m, width of a column
constexpr double kFar = 1e8;      // m: beyond all pieces
constexpr double kTouch = 1e-3;   // m: nearer is touching
constexpr double kRange = 200.0;  // m down that the ground is looked for

// Of a piece alone: down from the top of its box, in steps of its distance.
std::optional<double> top_below(const planning::Obstacle& piece, const AlignedBox3d& box,
                                const Vector3d& p_W) {
  Vector3d at(p_W.x(), p_W.y(), std::min(p_W.z(), box.max().z()));
  while (at.z() >= box.min().z()) {
    const double distance = planning::signed_distance(piece.shape, at);
    if (distance < kTouch) return at.z();
    at.z() -= distance;
  }
  return std::nullopt;
}

}  // namespace

SeenPieces::SeenPieces() {
  // What a footprint of the largest piece may be made of; see overhead.cpp.
  constexpr std::size_t kLines = planning::kMaxPieceVertices * planning::kMaxPieceVertices;
  scratch_.points.reserve(planning::kMaxPieceVertices + kLines + 2);
  scratch_.hull.reserve(planning::kMaxPieceVertices + kLines + 2);
}

SeenPieces::Columns SeenPieces::columns_of(const AlignedBox3d& box) {
  const auto index = [](double along) {  // of a NaN as well
    return static_cast<std::int32_t>(
        std::floor(std::fmin(std::fmax(along, -kFar), kFar) / kColumn));
  };
  return {index(box.min().x()), index(box.max().x()), index(box.min().y()), index(box.max().y())};
}

std::int64_t SeenPieces::column(std::int32_t x, std::int32_t y) {
  return (static_cast<std::int64_t>(x) << 32) |
         static_cast<std::int64_t>(static_cast<std::uint32_t>(y));
}

template <class Visit>
void SeenPieces::visit(const Columns& columns, Visit&& visit) const {
  const double wide = static_cast<double>(columns.x1) - columns.x0 + 1.0;
  if (wide * (static_cast<double>(columns.y1) - columns.y0 + 1.0) >
      static_cast<double>(slots_.size())) {  // then it is quicker to look at all
    for (std::uint32_t slot = 0; slot < slots_.size(); ++slot) {
      if (!visit(slot)) return;
    }
    return;
  }
  for (std::int32_t x = columns.x0; x <= columns.x1; ++x) {
    for (std::int32_t y = columns.y0; y <= columns.y1; ++y) {
      const auto found = columns_.find(column(x, y));
      if (found == columns_.end()) continue;
      for (const std::uint32_t slot : found->second) {
        if (!visit(slot)) return;
      }
    }
  }
}

bool SeenPieces::apply(const planning::MapUpdate& update) {
  if ((newest_ && update.scan_utime <= *newest_) || !planning::is_well_formed(update)) return false;
  newest_ = update.scan_utime;
  for (const planning::SeenCell& cell : update.cells) {
    Slots& slots = cells_[cell.key];
    for (const std::uint32_t slot : slots) remove(slot);
    slots.clear();
    for (const planning::Polytope& piece : cell.pieces) add(piece, slots);
    if (slots.empty()) cells_.erase(cell.key);
  }
  return true;
}

void SeenPieces::add(const planning::Polytope& piece, Slots& cell) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t at = free_.back();
  free_.pop_back();
  Slot& slot = slots_[at];
  slot.piece.shape = piece;
  slot.box = planning::bounding_box(slot.piece);
  slot.collected = 0;
  cell.push_back(at);
  const Columns columns = columns_of(slot.box);
  for (std::int32_t x = columns.x0; x <= columns.x1; ++x) {
    for (std::int32_t y = columns.y0; y <= columns.y1; ++y) columns_[column(x, y)].push_back(at);
  }
}

void SeenPieces::remove(std::uint32_t slot) {
  const Columns columns = columns_of(slots_[slot].box);
  for (std::int32_t x = columns.x0; x <= columns.x1; ++x) {
    for (std::int32_t y = columns.y0; y <= columns.y1; ++y) {
      const auto found = columns_.find(column(x, y));
      std::erase(found->second, slot);
      if (found->second.empty()) columns_.erase(found);
    }
  }
  slots_[slot].box.setEmpty();
  free_.push_back(slot);
}

bool SeenPieces::is_above(const Vector3d& p_W, double radius) {
  const Vector3d reach(radius, radius, 0.0);
  const AlignedBox3d tube(p_W - reach, Vector3d(p_W.x(), p_W.y(), std::max(p_W.z(), 0.0)) + reach);
  bool found = false;
  visit(columns_of(tube), [&](std::uint32_t slot) {
    found = slots_[slot].box.intersects(tube) &&
            planning::is_above(slots_[slot].piece, p_W, radius, scratch_);
    return !found;
  });
  return found;
}

std::optional<double> SeenPieces::ground_below(const Vector3d& p_W) const {
  std::optional<double> ground;
  visit(columns_of(AlignedBox3d(p_W, p_W)), [&](std::uint32_t slot) {
    const AlignedBox3d& box = slots_[slot].box;
    const bool is_higher = !ground || box.max().z() > *ground;
    const bool is_below = box.min().z() <= p_W.z() && box.max().z() >= p_W.z() - kRange;
    if (!is_higher || !is_below) return true;
    const std::optional<double> top = top_below(slots_[slot].piece, box, p_W);
    if (top && (!ground || *top > *ground)) ground = top;
    return true;
  });
  return ground;
}

void SeenPieces::begin_collection() { ++collection_; }

void SeenPieces::collect(const AlignedBox3d& box, std::vector<planning::Obstacle>& out) {
  visit(columns_of(box), [&](std::uint32_t at) {
    Slot& slot = slots_[at];
    if (slot.collected == collection_ || !slot.box.intersects(box)) return true;
    slot.collected = collection_;
    out.push_back(slot.piece);
    return true;
  });
}

}  // namespace dive::mission
