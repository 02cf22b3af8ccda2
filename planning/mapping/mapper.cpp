#include "planning/mapping/mapper.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/assert.h"
#include "common/fnv.h"
#include "common/range_check.h"
#include "planning/mapping/alignment.h"
#include "planning/mapping/cell_grid.h"
#include "planning/mapping/flat_pieces.h"
#include "planning/mapping/observed_space.h"
#include "planning/mapping/triangulate.h"
#include "planning/mapping/voxel_cell.h"
#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr Utime kSettle = 150'000;         // us that a cell waits for more before it is divided
constexpr Utime kUnconfirmed = 2'000'000;  // us that a candidate waits for another sweep
constexpr Utime kForgetEvery = 1'000'000;  // us
constexpr float kSeenPast = 0.05F;         // m beyond a voxel that tell that nothing is there
constexpr std::size_t kAligned = 1500;     // points of a sweep that are held against the map
constexpr float kSlack = 2.5F;             // sigma that a point may be moved onto its surface
constexpr float kMuchBetter = 0.5F;        // of the noise a voxel was seen with

std::uint64_t digest(const std::vector<Vector3f>& points) {
  Fnv1a64 digest;
  digest.add(std::span(reinterpret_cast<const std::uint8_t*>(points.data()),
                       points.size() * sizeof(Vector3f)));
  return digest.value();
}

}  // namespace

std::string MapperOptions::validate() const {
  RangeCheck check;
  check("voxel_m", voxel_m, 0.02, 2.0);
  check("min_range_m", min_range_m, 0.0, 5.0);
  check("min_neighbours", min_neighbours, 0, 100);
  check("snow_range_m", snow_range_m, 0.0, 20.0);
  check("min_snow_neighbours", min_snow_neighbours, 0, 100);
  check("confirm", confirm, 1, 6);
  check("noise_m", noise_m, 0.0, 1.0);
  check("noise_share", noise_share, 0.0, 0.2);
  check("noise_square", noise_square, 0.0, 0.2);
  check("on_piece_m", on_piece_m, 0.0, 1.0);
  check("flat_m", flat_m, 0.001, 1.0);
  check("skin_m", skin_m, 0.0, 1.0);
  check("ball_m", ball_m, 0.0, 1.0);
  check("longest_edge_m", longest_edge_m, 0.05, 5.0);
  check("points_per_update", points_per_update, 1, 1e8);
  check("memory_s", memory_s, 1.0, 1e6);
  check("max_voxels", max_voxels, 1000, 2e7);
  return check.problem();
}

struct Mapper::Impl {
  Impl(const RobotHull& hull, const MapperOptions& options_in, Clock& clock_in)
      : clock(clock_in),
        options(options_in),
        grid(static_cast<float>(options.voxel_m)),
        observed(hull) {}

  [[nodiscard]] float noise(float range) const {
    return static_cast<float>(options.noise_m) + static_cast<float>(options.noise_share) * range +
           static_cast<float>(options.noise_square) * range * range;
  }

  // --- points ---

  void touch(Cell& cell) {
    cell.changed = true;
    if (cell.stale_since == 0) cell.stale_since = std::max<Utime>(now, 1);
  }

  void believe(Cell& cell, Voxel& v) {
    v.solid = true;
    v.meshed = false;
    touch(cell);
  }

  void observe(const Vector3f& p_W, float sigma) {
    const auto place = grid.locate(p_W);
    if (!place) return;
    Cell& cell = cells[place->key];
    cell.seen = now;
    Voxel* v = cell.find(place->voxel);
    const float near = static_cast<float>(options.on_piece_m) + 2.0F * sigma;
    if (v == nullptr) {
      if (cell.is_on_surface(p_W, near)) return;
      v = &cell.insert(place->voxel);
      ++voxels;
      v->p_W = p_W;
      v->noise = sigma;
      v->evidence = 1;
    } else if (v->seen != now) {
      v->evidence = static_cast<std::int8_t>(std::min(v->evidence + 1, kMaxEvidence));
      if (sigma < kMuchBetter * v->noise) {  // a closer look
        v->noise = sigma;
        v->p_W = p_W;
        if (v->solid && !cell.is_on_surface(p_W, near)) believe(cell, *v);
      } else if (!v->solid || !v->meshed) {
        v->p_W += (p_W - v->p_W) / static_cast<float>(v->evidence);
      }
    }
    v->seen = now;
    if (!v->solid && v->evidence >= options.confirm) believe(cell, *v);
  }

  // Of something, and not of the vehicle itself; false for NaN.
  [[nodiscard]] bool is_told(float range, const RangeScan& scan) const {
    return range >= static_cast<float>(options.min_range_m) && range <= scan.reach;
  }

  // Some points of the sweep, to be held against the map.
  [[nodiscard]] std::vector<MapPoint> some_of(const RangeScan& scan, const RangeImage& image,
                                              const Pose& X_WB) const {
    const Eigen::Matrix3f R_WB = X_WB.q.toRotationMatrix().cast<float>();
    const Vector3f p_WB = X_WB.p.cast<float>();
    const std::size_t stride = std::max<std::size_t>(1, scan.points_B.size() / kAligned);
    std::vector<MapPoint> points;
    for (std::size_t i = 0; i < scan.points_B.size(); i += stride) {
      const float range = image.range(i);
      if (!is_told(range, scan)) continue;
      std::optional<Vector3f> normal = image.normal_B(scan, i);
      if (normal) normal = R_WB * *normal;
      points.push_back({R_WB * scan.points_B[i] + p_WB, normal,
                        noise(range) + static_cast<float>(options.flat_m)});
    }
    return points;
  }

  [[nodiscard]] const Facet* nearest(const Vector3f& p_W, float reach, float& height) const {
    const auto place = grid.locate(p_W);
    if (!place) return nullptr;
    const auto cell = cells.find(place->key);
    return cell == cells.end() ? nullptr : cell->second.nearest(p_W, reach, height);
  }

  int take(const RangeScan& scan, const RangeImage& image, const Pose& X_WB) {
    const Eigen::Matrix3f R_WB = X_WB.q.toRotationMatrix().cast<float>();
    const Vector3f p_WB = X_WB.p.cast<float>();
    int taken = 0;
    for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
      const float range = image.range(i);
      if (!is_told(range, scan)) continue;
      const bool is_snow_near = range < static_cast<float>(options.snow_range_m);
      if (image.neighbours(i) <
          (is_snow_near ? options.min_snow_neighbours : options.min_neighbours)) {
        continue;
      }
      observe(R_WB * scan.points_B[i] + p_WB, noise(range));
      ++taken;
    }
    return taken;
  }

  // Removes candidates that stayed unconfirmed, and voxels that rays of the scan passed through.
  void remove_passed_voxels(const RangeImage& image) {
    const Eigen::AlignedBox3f reach(image.origin_W() - Vector3f::Constant(image.reach()),
                                    image.origin_W() + Vector3f::Constant(image.reach()));
    for (auto& [key, cell] : cells) {
      const Vector3f low = cell_of(key).cast<float>() * grid.cell_m();
      if (!reach.intersects(Eigen::AlignedBox3f(low, low + Vector3f::Constant(grid.cell_m()))))
        continue;
      for (std::size_t i = cell.voxels.size(); i-- > 0;) {
        Voxel& v = cell.voxels[i];
        if (v.seen == now) continue;
        const float margin = 2.0F * noise((v.p_W - image.origin_W()).norm()) + kSeenPast;
        const bool is_stale = !v.solid && now - v.seen > kUnconfirmed;
        if (!is_stale && !image.is_passed(v.p_W, margin)) continue;
        if (!is_stale && --v.evidence > 0) continue;
        if (v.solid) touch(cell);
        cell.erase(i);
        --voxels;
      }
    }
  }

  // --- surfaces ---

  // Nearest first, as many as there is time for.
  [[nodiscard]] std::vector<CellKey> choose(const Vector3f& p_W, Utime settle) {
    std::vector<std::pair<float, CellKey>> stale;
    for (const auto& [key, cell] : cells) {
      if (cell.stale_since == 0 || now - cell.stale_since < settle) continue;
      const Vector3f middle =
          (cell_of(key).cast<float>() + Vector3f::Constant(0.5F)) * grid.cell_m();
      stale.emplace_back((middle - p_W).squaredNorm(), key);
    }
    std::sort(stale.begin(), stale.end());
    std::vector<CellKey> chosen;
    std::size_t points = 0;
    for (const auto& [distance, key] : stale) {
      points += cells.at(key).voxels.size();
      if (!chosen.empty() && points > static_cast<std::size_t>(options.points_per_update)) break;
      chosen.push_back(key);
    }
    stats.waiting_cells = static_cast<int>(stale.size() - chosen.size());
    std::sort(chosen.begin(), chosen.end());
    return chosen;
  }

  struct Gathered {
    Voxel* voxel;
    CellKey key;
  };

  // The voxels of the cells, and those around them that their surfaces go on to.
  [[nodiscard]] std::vector<Gathered> gather(const std::vector<CellKey>& chosen) {
    std::vector<CellKey> around = chosen;
    for (const CellKey key : chosen) {
      const Vector3i cell = cell_of(key);
      for (int i = 0; i < 27; ++i) {
        around.push_back(key_of(cell + Vector3i(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1)));
      }
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    std::vector<Gathered> gathered;
    const auto halo = static_cast<float>(options.longest_edge_m);
    for (const CellKey key : around) {
      const auto at = cells.find(key);
      if (at == cells.end()) continue;
      const bool is_chosen = std::binary_search(chosen.begin(), chosen.end(), key);
      for (Voxel& v : at->second.voxels) {
        if (v.solid && (is_chosen || is_near_chosen(v.p_W, key, chosen, halo))) {
          gathered.push_back({&v, key});
        }
      }
    }
    return gathered;
  }

  [[nodiscard]] bool is_near_chosen(const Vector3f& p_W, CellKey key,
                                    const std::vector<CellKey>& chosen, float halo) const {
    const Vector3i cell = cell_of(key);
    for (int i = 0; i < 27; ++i) {
      const Vector3i other = cell + Vector3i(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
      const Vector3f low = other.cast<float>() * grid.cell_m();
      const Eigen::AlignedBox3f box(low, low + Vector3f::Constant(grid.cell_m()));
      if (box.squaredExteriorDistance(p_W) > halo * halo) continue;
      if (std::binary_search(chosen.begin(), chosen.end(), key_of(other))) return true;
    }
    return false;
  }

  void resurface(const std::vector<CellKey>& chosen) {
    stats.meshed_cells = static_cast<int>(chosen.size());
    stats.meshed_points = 0;
    if (chosen.empty()) return;
    const std::vector<Gathered> gathered = gather(chosen);
    stats.meshed_points = static_cast<int>(gathered.size());
    std::vector<Vector3f> points;
    std::vector<float> slack;
    for (const Gathered& one : gathered) {
      points.push_back(one.voxel->p_W);
      slack.push_back(kSlack * one.voxel->noise);
    }
    TriangulationOptions triangulation;
    triangulation.longest_edge_m = static_cast<float>(options.longest_edge_m);
    triangulation.apart_m = 0.5F * grid.voxel_m();
    SurfaceMesh mesh;
    {
      const Stopwatch stopwatch(clock, times.triangulate_ms);
      mesh = triangulate(points, slack, triangulation);
    }
    const Stopwatch stopwatch(clock, times.divide_ms);
    std::vector<std::vector<CellKey>> cells_of(mesh.points.size());
    // A triangle goes to every chosen cell that it touches: a cell covers its own points, whatever
    // becomes of the cells around it.
    std::unordered_map<CellKey, std::vector<Triangle>> triangles;
    for (std::size_t i = 0; i < gathered.size(); ++i) {
      std::vector<CellKey>& owners = cells_of[mesh.stands_for[i]];
      if (std::binary_search(chosen.begin(), chosen.end(), gathered[i].key) &&
          std::find(owners.begin(), owners.end(), gathered[i].key) == owners.end()) {
        owners.push_back(gathered[i].key);
      }
    }
    std::vector<char> is_corner(mesh.points.size());
    for (const Triangle& t : mesh.triangles) {
      const Vector3f middle = (mesh.points[t[0]] + mesh.points[t[1]] + mesh.points[t[2]]) / 3.0F;
      if (is_bridge(middle)) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        is_corner[t[i]] = true;
        for (const CellKey key : cells_of[t[i]]) {
          std::vector<Triangle>& mine = triangles[key];
          if (mine.empty() || mine.back() != t) mine.push_back(t);
        }
      }
    }
    for (std::size_t i = 0; i < gathered.size(); ++i) {
      if (std::binary_search(chosen.begin(), chosen.end(), gathered[i].key)) {
        gathered[i].voxel->meshed = is_corner[mesh.stands_for[i]] != 0;
      }
    }
    const FlatPieceOptions division{options.flat_m, options.skin_m, options.voxel_m};
    for (const CellKey key : chosen) {
      Cell& cell = cells.at(key);
      cell.surface.clear();
      cell.facets.clear();
      flat_pieces(mesh.points, triangles[key], division, cell.surface);
      for (const Polytope& piece : cell.surface) cell.facets.emplace_back(piece);
      cell.stale_since = 0;
      cell.changed = true;
    }
  }

  // Does a triangle span water that it was looked through?
  [[nodiscard]] bool is_bridge(const Vector3f& middle) const {
    return observed.was_passed_recently(
        middle, 2.0F * noise((middle - sensor_origin_W).norm()) + grid.voxel_m());
  }

  // --- memory ---

  void forget_old() {
    if (now < next_forget && voxels <= static_cast<std::size_t>(options.max_voxels)) return;
    next_forget = now + kForgetEvery;
    const Utime oldest = now - from_seconds(options.memory_s);
    std::vector<std::pair<Utime, CellKey>> by_age;
    for (const auto& [key, cell] : cells) by_age.emplace_back(cell.seen, key);
    std::sort(by_age.begin(), by_age.end());
    for (const auto& [seen, key] : by_age) {
      const bool too_many = voxels > static_cast<std::size_t>(options.max_voxels);
      if (seen >= oldest && !too_many) break;
      forget(key);
    }
  }

  void forget(CellKey key) {
    const auto at = cells.find(key);
    voxels -= at->second.voxels.size();
    if (has_shown(at->second)) gone.push_back(key);
    cells.erase(at);
  }

  [[nodiscard]] static bool has_shown(const Cell& cell) {
    return !cell.surface.empty() || std::any_of(cell.voxels.begin(), cell.voxels.end(),
                                                [](const Voxel& v) { return v.solid; });
  }

  [[nodiscard]] ObstacleUpdate collect() {
    ObstacleUpdate update;
    update.utime = now;
    std::sort(gone.begin(), gone.end());
    gone.erase(std::unique(gone.begin(), gone.end()), gone.end());
    for (const CellKey key : gone) {
      if (!cells.contains(key) || !cells.at(key).changed) update.cells.push_back({key, {}});
    }
    gone.clear();
    for (auto& [key, cell] : cells) {
      if (std::exchange(cell.changed, false))
        update.cells.push_back({key, cell.pieces(options.ball_m)});
    }
    std::sort(update.cells.begin(), update.cells.end(),
              [](const MapCell& a, const MapCell& b) { return a.key < b.key; });
    return update;
  }

  ScanResult add(const RangeScan& scan, Pose X_WB, const Eigen::Vector3d& v_W) {
    Eigen::Vector2f correction_W = Eigen::Vector2f::Zero();
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    now = scan.utime;
    {
      const Stopwatch points(clock, times.points_ms);
      RangeImage image(scan, X_WB);
      correction_W = align_to_map(some_of(scan, image, X_WB),
                                  [this](const Vector3f& p_W, float reach_m, float& height) {
                                    return nearest(p_W, reach_m, height);
                                  });
      X_WB.p.head<2>() += correction_W.cast<double>();
      image.move(X_WB);
      sensor_origin_W = image.origin_W();
      stats.taken = take(scan, image, X_WB);
      remove_passed_voxels(image);
      observed.add(std::move(image));
      forget_old();
    }
    resurface(choose(sensor_origin_W, kSettle));
    ScanResult result{collect(), {now, observed.free_ahead(X_WB, v_W)}, std::nullopt};
    if (!correction_W.isZero(0.0F))
      result.correction = PoseCorrection{now, correction_W.cast<double>()};
    return result;
  }

  [[nodiscard]] ScanProblem question(const RangeScan& scan) {
    bool any = false;
    bool any_near = false;  // open water looks the same again and again
    for (const Vector3f& p_B : scan.points_B) {
      if (!p_B.allFinite()) continue;
      any = true;
      any_near |= (p_B - scan.origin_B).norm() <= scan.reach;
    }
    if (!any || scan.points_B.size() > kMaxScanPoints) return ScanProblem::kEmpty;
    if (last_utime && scan.utime <= *last_utime) return ScanProblem::kBackwards;
    const std::uint64_t hash = digest(scan.points_B);
    if (any_near && last_utime && hash == last_digest) return ScanProblem::kRepeated;
    last_utime = scan.utime;
    last_digest = hash;
    return ScanProblem::kNone;
  }

  ObstacleUpdate add_cloud(std::span<const Vector3f> points_W) {
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    now = std::max<Utime>(now, 1);
    for (const Vector3f& p_W : points_W) {
      const auto place = grid.locate(p_W);
      if (!place) continue;
      Cell& cell = cells[place->key];
      cell.seen = now;
      if (cell.find(place->voxel) != nullptr) continue;
      Voxel& v = cell.insert(place->voxel);
      ++voxels;
      v.p_W = p_W;
      v.noise = static_cast<float>(options.noise_m);
      v.seen = now;
      v.evidence = kMaxEvidence;
      believe(cell, v);
    }
    const int points = std::exchange(options.points_per_update, std::numeric_limits<int>::max());
    resurface(choose(Vector3f::Zero(), 0));
    options.points_per_update = points;
    return collect();
  }

  void move(const std::function<Pose(Utime)>& correction) {
    std::unordered_map<CellKey, Cell> before;
    before.swap(cells);
    voxels = 0;
    std::vector<CellKey> keys;
    for (const auto& [key, cell] : before) {
      keys.push_back(key);
      if (has_shown(cell)) gone.push_back(key);
    }
    std::sort(keys.begin(), keys.end());
    for (const CellKey from : keys) {
      for (const Voxel& old : before.at(from).voxels) {
        if (!old.solid) continue;
        const Vector3f p_W = (correction(old.seen) * old.p_W.cast<double>()).cast<float>();
        const auto place = grid.locate(p_W);
        if (!place) continue;
        Cell& cell = cells[place->key];
        cell.seen = std::max(cell.seen, old.seen);
        if (cell.find(place->voxel) != nullptr) continue;
        Voxel& v = cell.insert(place->voxel);
        ++voxels;
        const std::int16_t at = v.place;
        v = old;
        v.place = at;
        v.p_W = p_W;
        believe(cell, v);
      }
    }
    observed.move(correction);
  }

  Clock& clock;
  MapperOptions options;
  CellGrid grid;
  std::unordered_map<CellKey, Cell> cells;
  std::size_t voxels = 0;
  std::vector<CellKey> gone;  ///< Cells forgotten since the last update.
  ObservedSpace observed;
  Vector3f sensor_origin_W = Vector3f::Zero();
  Utime now = 0;
  Utime next_forget = 0;
  std::optional<Utime> last_utime;
  std::uint64_t last_digest = 0;
  ScanProblem problem = ScanProblem::kNone;
  MapperStats stats;
  MapperTimes times;
};

Mapper::Mapper(const RobotHull& hull, MapperOptions options, Clock& clock) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(hull, options, clock);
}
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;
Mapper::~Mapper() = default;

std::optional<ScanResult> Mapper::add(const RangeScan& scan, const Pose& X_WB,
                                      const Eigen::Vector3d& v_W) {
  impl_->problem = impl_->question(scan);
  if (impl_->problem != ScanProblem::kNone) return std::nullopt;
  return impl_->add(scan, X_WB, v_W);
}

ScanProblem Mapper::problem() const { return impl_->problem; }

ObstacleUpdate Mapper::add_cloud(std::span<const Eigen::Vector3f> points_W) {
  return impl_->add_cloud(points_W);
}

void Mapper::move(const std::function<Pose(Utime)>& correction) { impl_->move(correction); }

std::vector<Eigen::Vector3f> Mapper::points() const {
  std::vector<std::pair<CellKey, const Cell*>> sorted;
  for (const auto& [key, cell] : impl_->cells) sorted.emplace_back(key, &cell);
  std::sort(sorted.begin(), sorted.end());
  std::vector<Eigen::Vector3f> points;
  for (const auto& [key, cell] : sorted) {
    const std::size_t first = points.size();
    std::vector<std::pair<int, const Voxel*>> solid;
    for (const Voxel& v : cell->voxels) {
      if (v.solid) solid.emplace_back(v.place, &v);
    }
    std::sort(solid.begin(), solid.end());
    points.reserve(first + solid.size());
    for (const auto& [place, v] : solid) points.push_back(v->p_W);
  }
  return points;
}

MapperStats Mapper::stats() const {
  MapperStats stats = impl_->stats;
  stats.cells = impl_->cells.size();
  stats.voxels = impl_->voxels;
  for (const auto& [key, cell] : impl_->cells) stats.pieces += cell.surface.size();
  return stats;
}

const MapperTimes& Mapper::times() const { return impl_->times; }

void Mapper::rebuild_all() {
  for (auto& [key, cell] : impl_->cells) {
    if (!cell.voxels.empty()) cell.stale_since = 1;
  }
}

}  // namespace dive::planning
