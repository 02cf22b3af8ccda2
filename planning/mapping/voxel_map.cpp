#include "planning/mapping/voxel_map.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

namespace dive::planning {
namespace {

using Eigen::Vector3f;

constexpr Utime kUnconfirmed = 2'000'000;   // us that a candidate waits for another scan
constexpr Utime kForgetPeriod = 1'000'000;  // us
constexpr float kPassedMargin = 0.05F;      // m by which a ray must pass a voxel that it removes
constexpr float kMuchBetter =
    0.5F;  // ratio of noises below which an observation replaces a voxel's

// True if the map's users have pieces of the cell.
bool has_pieces(const Cell& cell) {
  return !cell.surface.empty() || std::any_of(cell.voxels.begin(), cell.voxels.end(),
                                              [](const Voxel& v) { return v.confirmed; });
}

}  // namespace

VoxelMap::VoxelMap(const MapperOptions& options)
    : options_(options), grid_(static_cast<float>(options.voxel_m)) {}

Voxel& VoxelMap::insert(Cell& cell, int place) {
  ++voxels_;
  return cell.insert(place);
}

void VoxelMap::touch(Cell& cell) const {
  cell.changed = true;
  if (cell.stale_since == 0) cell.stale_since = std::max<Utime>(now_, 1);
}

void VoxelMap::confirm(Cell& cell, Voxel& voxel) const {
  voxel.confirmed = true;
  voxel.meshed = false;
  touch(cell);
}

void VoxelMap::observe(const Vector3f& p_W, float sigma) {
  const auto place = grid_.locate(p_W);
  if (!place) return;
  Cell& cell = cells_[place->key];
  cell.last_observed = now_;
  Voxel* v = cell.find(place->voxel);
  const float near = static_cast<float>(options_.on_piece_m) + 2.0F * sigma;
  if (v == nullptr) {
    if (cell.is_on_surface(p_W, near)) return;
    v = &insert(cell, place->voxel);
    v->p_W = p_W;
    v->noise = sigma;
    v->evidence = 1;
  } else if (v->last_observed != now_) {
    v->evidence = static_cast<std::int8_t>(std::min(v->evidence + 1, kMaxEvidence));
    if (sigma < kMuchBetter * v->noise) {
      v->noise = sigma;
      v->p_W = p_W;
      if (v->confirmed && !cell.is_on_surface(p_W, near)) confirm(cell, *v);
    } else if (!v->confirmed || !v->meshed) {
      v->p_W += (p_W - v->p_W) / static_cast<float>(v->evidence);
    }
  }
  v->last_observed = now_;
  if (!v->confirmed && v->evidence >= options_.confirm) confirm(cell, *v);
}

void VoxelMap::add_confirmed(const Vector3f& p_W) {
  const auto place = grid_.locate(p_W);
  if (!place) return;
  Cell& cell = cells_[place->key];
  cell.last_observed = now_;
  if (cell.find(place->voxel) != nullptr) return;
  Voxel& v = insert(cell, place->voxel);
  v.p_W = p_W;
  v.noise = static_cast<float>(options_.noise.constant_m);
  v.last_observed = now_;
  v.evidence = kMaxEvidence;
  confirm(cell, v);
}

void VoxelMap::remove_passed(const RangeImage& image) {
  const Eigen::AlignedBox3f reach(image.origin_W() - Vector3f::Constant(image.reach()),
                                  image.origin_W() + Vector3f::Constant(image.reach()));
  for (auto& [key, cell] : cells_) {
    const Vector3f low = cell_of(key).cast<float>() * grid_.cell_m();
    if (!reach.intersects(Eigen::AlignedBox3f(low, low + Vector3f::Constant(grid_.cell_m()))))
      continue;
    for (std::size_t i = cell.voxels.size(); i-- > 0;) {
      Voxel& v = cell.voxels[i];
      if (v.last_observed == now_) continue;
      const float margin =
          2.0F * options_.noise.sigma((v.p_W - image.origin_W()).norm()) + kPassedMargin;
      const bool is_stale = !v.confirmed && now_ - v.last_observed > kUnconfirmed;
      if (!is_stale && !image.is_passed(v.p_W, margin)) continue;
      if (!is_stale && --v.evidence > 0) continue;
      if (v.confirmed) touch(cell);
      cell.erase(i);
      --voxels_;
    }
  }
}

void VoxelMap::forget_old() {
  if (now_ < next_forget_ && !has_too_many()) return;
  next_forget_ = now_ + kForgetPeriod;
  const Utime oldest = now_ - from_seconds(options_.memory_s);
  for (const CellKey key : oldest_first()) {
    if (cells_.at(key).last_observed >= oldest && !has_too_many()) break;
    forget(key);
  }
}

bool VoxelMap::has_too_many() const {
  return voxels_ > static_cast<std::size_t>(options_.max_voxels) || cells_.size() > kMaxCells;
}

std::vector<CellKey> VoxelMap::oldest_first() const {
  std::vector<std::pair<Utime, CellKey>> by_age;
  by_age.reserve(cells_.size());
  for (const auto& [key, cell] : cells_) by_age.emplace_back(cell.last_observed, key);
  std::sort(by_age.begin(), by_age.end());
  std::vector<CellKey> keys;
  keys.reserve(by_age.size());
  for (const auto& [last_observed, key] : by_age) keys.push_back(key);
  return keys;
}

void VoxelMap::forget_beyond_one_move() {
  std::size_t pieces = 0;
  for (const auto& [key, cell] : cells_) pieces += cell.pieces(options_.ball_m).size();
  for (const CellKey key : oldest_first()) {
    if (pieces <= kMaxMovedPieces) return;
    pieces -= cells_.at(key).pieces(options_.ball_m).size();
    forget(key);
  }
}

void VoxelMap::forget(CellKey key) {
  const auto at = cells_.find(key);
  voxels_ -= at->second.voxels.size();
  if (has_pieces(at->second)) gone_.push_back(key);
  cells_.erase(at);
}

void VoxelMap::move(const MapCorrection& correction) {
  Cells before;
  before.swap(cells_);
  voxels_ = 0;
  std::vector<CellKey> keys;
  for (const auto& [key, cell] : before) {
    keys.push_back(key);
    if (has_pieces(cell)) gone_.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  for (const CellKey from : keys) {
    for (const Voxel& old : before.at(from).voxels) {
      if (!old.confirmed) continue;
      const Vector3f p_W =
          (correction.at(old.last_observed) * Eigen::Vector3d(old.p_W.cast<double>()))
              .cast<float>();
      const auto place = grid_.locate(p_W);
      if (!place) continue;
      Cell& cell = cells_[place->key];
      cell.last_observed = std::max(cell.last_observed, old.last_observed);
      if (cell.find(place->voxel) != nullptr) continue;
      Voxel& v = insert(cell, place->voxel);
      const std::int16_t at = v.place;
      v = old;
      v.place = at;
      v.p_W = p_W;
      confirm(cell, v);
    }
  }
}

const Facet* VoxelMap::nearest(const Vector3f& p_W, float reach, float& height) const {
  const auto place = grid_.locate(p_W);
  if (!place) return nullptr;
  const auto cell = cells_.find(place->key);
  return cell == cells_.end() ? nullptr : cell->second.nearest(p_W, reach, height);
}

ObstacleUpdate VoxelMap::take_changes() {
  ObstacleUpdate update;
  update.utime = now_;
  std::sort(gone_.begin(), gone_.end());
  gone_.erase(std::unique(gone_.begin(), gone_.end()), gone_.end());
  for (const CellKey key : gone_) {
    if (!cells_.contains(key) || !cells_.at(key).changed) update.cells.push_back({key, {}});
  }
  gone_.clear();
  for (auto& [key, cell] : cells_) {
    if (std::exchange(cell.changed, false))
      update.cells.push_back({key, cell.pieces(options_.ball_m)});
  }
  std::sort(update.cells.begin(), update.cells.end(),
            [](const MapCell& a, const MapCell& b) { return a.key < b.key; });
  return update;
}

std::vector<Vector3f> VoxelMap::points() const {
  std::vector<std::pair<CellKey, const Cell*>> sorted;
  for (const auto& [key, cell] : cells_) sorted.emplace_back(key, &cell);
  std::sort(sorted.begin(), sorted.end());
  std::vector<Vector3f> points;
  for (const auto& [key, cell] : sorted) {
    const std::size_t first = points.size();
    std::vector<std::pair<int, const Voxel*>> confirmed;
    for (const Voxel& v : cell->voxels) {
      if (v.confirmed) confirmed.emplace_back(v.place, &v);
    }
    std::sort(confirmed.begin(), confirmed.end());
    points.reserve(first + confirmed.size());
    for (const auto& [place, v] : confirmed) points.push_back(v->p_W);
  }
  return points;
}

}  // namespace dive::planning
