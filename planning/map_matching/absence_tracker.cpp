#include "planning/map_matching/absence_tracker.h"

#include <algorithm>
#include <utility>

#include "common/assert.h"

namespace dive::planning {
namespace {

// More than the cells of one object.
constexpr CellKey kKeysOfObject = 1024;
// Scans of one cell by which an object that was gone is back: one may show a fish.
constexpr int kScansOccupied = 2;

Polytope block(const Eigen::AlignedBox3d& box) {
  Polytope polytope;
  for (int corner = 0; corner < 8; ++corner) {
    polytope.vertices.emplace_back(
        box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return polytope;
}

}  // namespace

AbsenceTracker::AbsenceTracker(std::shared_ptr<const ObjectCells> objects)
    : objects_(std::move(objects)) {
  DIVE_DEMAND(objects_);
  for (const ObjectCells::Object& object : objects_->objects()) {
    evidence_.emplace_back().cells.resize(object.cells.size());
  }
}

std::optional<ObstacleUpdate> AbsenceTracker::add(Utime scan_utime, const Eigen::Vector3d& from_W,
                                                  std::span<const CellSighting> sightings) {
  ObstacleUpdate update{ObstacleSource::kAbsence, scan_utime, {}};
  for (auto first = sightings.begin(); first != sightings.end();) {
    const std::int32_t object = first->object;
    const auto last = std::find_if(first, sightings.end(),
                                   [&](const CellSighting& one) { return one.object != object; });
    const auto index = static_cast<std::size_t>(object);
    add(from_W, {first, last}, evidence_.at(index));
    report(index, update);
    first = last;
  }
  if (update.cells.empty() && update.objects.empty()) return std::nullopt;
  return update;
}

void AbsenceTracker::add(const Eigen::Vector3d& from_W, std::span<const CellSighting> sightings,
                         Evidence& evidence) {
  bool is_seen_through = false;
  for (const CellSighting& sighting : sightings) {
    Cell& cell = evidence.cells.at(static_cast<std::size_t>(sighting.cell));
    if (!sighting.is_free) {
      cell.free_in_row = 0;
      if (++cell.occupied >= kScansOccupied) cell.free = 0;
      continue;
    }
    is_seen_through = true;
    ++cell.free;
    if (++cell.free_in_row >= kScansOfCell) cell.occupied = 0;
  }
  if (!is_seen_through) return;
  ++evidence.scans;
  const bool is_new = std::ranges::all_of(evidence.places_W, [&](const Eigen::Vector3d& place_W) {
    return (place_W - from_W).norm() >= kApart;
  });
  if (is_new && evidence.places_W.size() < kPlaces) evidence.places_W.push_back(from_W);
}

double AbsenceTracker::seen_share(const Evidence& evidence) {
  const auto free = std::ranges::count_if(
      evidence.cells, [](const Cell& cell) { return cell.free >= kScansOfCell; });
  return static_cast<double>(free) / static_cast<double>(evidence.cells.size());
}

bool AbsenceTracker::is_gone(const Evidence& evidence) {
  const auto is_occupied = [&](const Cell& cell) {
    return cell.occupied >= (evidence.is_absent ? kScansOccupied : 1);
  };
  if (std::ranges::any_of(evidence.cells, is_occupied)) return false;
  if (evidence.is_absent) return true;
  return evidence.scans >= kScans && evidence.places_W.size() >= kPlaces &&
         seen_share(evidence) >= kShare;
}

// Appends what has changed. Objects come in ascending order, and so do their cells.
void AbsenceTracker::report(std::size_t index, ObstacleUpdate& update) {
  const ObjectCells::Object& object = objects_->objects()[index];
  Evidence& evidence = evidence_[index];
  const bool is_absent = is_gone(evidence);
  if (std::exchange(evidence.is_absent, is_absent) != is_absent) {
    const ObjectRange& obstacles = object.obstacles;
    update.objects.push_back({obstacles.first, obstacles.end - obstacles.first, is_absent,
                              evidence.scans, seen_share(evidence)});
    if (!is_absent) {
      evidence.scans = 0;
      evidence.places_W.clear();
      for (Cell& cell : evidence.cells) cell.free = cell.free_in_row = cell.occupied = 0;
    }
  }
  const CellKey first = kFirstAbsenceKey + static_cast<CellKey>(index) * kKeysOfObject;
  for (std::size_t i = 0; i < evidence.cells.size(); ++i) {
    Cell& cell = evidence.cells[i];
    const bool is_remnant = is_absent && cell.free < kScansOfCell;
    if (std::exchange(cell.is_remnant, is_remnant) == is_remnant) continue;
    MapCell& changed = update.cells.emplace_back();
    changed.key = first + static_cast<CellKey>(i);
    if (is_remnant) changed.pieces.push_back(block(object.cells[i]));
  }
}

}  // namespace dive::planning
