#include "planning/mapping/mapper.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/assert.h"
#include "planning/mapping/alignment.h"
#include "planning/mapping/observed_space.h"
#include "planning/mapping/surface_builder.h"
#include "planning/mapping/voxel_map.h"
#include "planning/stopwatch.h"

namespace dive::planning {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kAligned = 1500;  // points of a scan that are compared with the map

}  // namespace

struct Mapper::Impl {
  Impl(const RobotHull& hull, const MapperOptions& options_in, Clock& clock_in)
      : clock(clock_in),
        options(options_in),
        map(options),
        surfaces(options, clock),
        observed(hull) {}

  // False for the vehicle itself, a ray without a hit, and NaN.
  [[nodiscard]] bool is_usable(float range, const RangeScan& scan) const {
    return range >= static_cast<float>(options.min_range_m) && range <= scan.reach;
  }

  // A selection of the scan's points, in W, to compare with the map.
  [[nodiscard]] std::vector<MapPoint> points_to_align(const RangeScan& scan,
                                                      const RangeImage& image,
                                                      const Pose& X_WB) const {
    const Eigen::Matrix3f R_WB = X_WB.q.toRotationMatrix().cast<float>();
    const Vector3f p_WB = X_WB.p.cast<float>();
    const std::size_t stride = std::max<std::size_t>(1, scan.points_B.size() / kAligned);
    std::vector<MapPoint> points;
    for (std::size_t i = 0; i < scan.points_B.size(); i += stride) {
      const float range = image.range(i);
      if (!is_usable(range, scan)) continue;
      std::optional<Vector3f> normal = image.normal_B(scan, i);
      if (normal) normal = R_WB * *normal;
      points.push_back({R_WB * scan.points_B[i] + p_WB, normal,
                        options.noise(range) + static_cast<float>(options.flat_m)});
    }
    return points;
  }

  // Adds the scan's points to the voxels, except lone points and marine snow; returns their number.
  int add_points(const RangeScan& scan, const RangeImage& image, const Pose& X_WB) {
    const Eigen::Matrix3f R_WB = X_WB.q.toRotationMatrix().cast<float>();
    const Vector3f p_WB = X_WB.p.cast<float>();
    int added = 0;
    for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
      const float range = image.range(i);
      if (!is_usable(range, scan)) continue;
      const bool may_be_snow = range < static_cast<float>(options.snow_range_m);
      if (image.neighbours(i) <
          (may_be_snow ? options.min_snow_neighbours : options.min_neighbours)) {
        continue;
      }
      map.observe(R_WB * scan.points_B[i] + p_WB, options.noise(range));
      ++added;
    }
    return added;
  }

  // For a point of a triangle: true if recent rays passed it, so that the triangle is no surface.
  [[nodiscard]] bool is_free(const Vector3f& p_W) const {
    return observed.was_passed_recently(
        p_W, 2.0F * options.noise((p_W - sensor_origin_W).norm()) + map.grid().voxel_m());
  }

  void note(const SurfaceBuilder::Report& report) {
    stats.meshed_cells = report.meshed_cells;
    stats.meshed_points = report.meshed_points;
    stats.waiting_cells = report.waiting_cells;
    times.triangulate_ms = report.triangulate_ms;
    times.divide_ms = report.divide_ms;
  }

  ScanResult add(const RangeScan& scan, Pose X_WB, const Eigen::Vector3d& v_W) {
    Eigen::Vector2f correction_W = Eigen::Vector2f::Zero();
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    map.set_time(scan.utime);
    {
      const Stopwatch points(clock, times.points_ms);
      RangeImage image(scan, X_WB);
      correction_W = align_to_map(points_to_align(scan, image, X_WB),
                                  [this](const Vector3f& p_W, float reach_m, float& height) {
                                    return map.nearest(p_W, reach_m, height);
                                  });
      X_WB.p.head<2>() += correction_W.cast<double>();
      image.move(X_WB);
      sensor_origin_W = image.origin_W();
      stats.taken = add_points(scan, image, X_WB);
      map.remove_passed(image);
      observed.add(std::move(image));
      map.forget_old();
    }
    note(surfaces.update(map, sensor_origin_W, [this](const Vector3f& p) { return is_free(p); }));
    ScanResult result{
        map.take_changes(), {scan.utime, observed.free_ahead(X_WB, v_W)}, std::nullopt};
    if (!correction_W.isZero(0.0F))
      result.correction = PoseCorrection{scan.utime, correction_W.cast<double>()};
    return result;
  }

  ObstacleUpdate add_cloud(std::span<const Vector3f> points_W) {
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    map.set_time(std::max<Utime>(map.time(), 1));
    for (const Vector3f& p_W : points_W) map.add_confirmed(p_W);
    note(surfaces.update_all(map, [this](const Vector3f& p) { return is_free(p); }));
    return map.take_changes();
  }

  Clock& clock;
  MapperOptions options;
  VoxelMap map;
  SurfaceBuilder surfaces;
  ObservedSpace observed;
  ScanCheck check;
  Vector3f sensor_origin_W = Vector3f::Zero();
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
  impl_->problem = impl_->check.check(scan);
  if (impl_->problem != ScanProblem::kNone) return std::nullopt;
  return impl_->add(scan, X_WB, v_W);
}

ScanProblem Mapper::problem() const { return impl_->problem; }

ObstacleUpdate Mapper::add_cloud(std::span<const Eigen::Vector3f> points_W) {
  return impl_->add_cloud(points_W);
}

void Mapper::move(const std::function<Pose(Utime)>& correction) {
  impl_->map.move(correction);
  impl_->observed.move(correction);
}

std::vector<Eigen::Vector3f> Mapper::points() const { return impl_->map.points(); }

MapperStats Mapper::stats() const {
  MapperStats stats = impl_->stats;
  stats.cells = impl_->map.cells().size();
  stats.voxels = impl_->map.voxels();
  for (const auto& [key, cell] : impl_->map.cells()) stats.pieces += cell.surface.size();
  return stats;
}

const MapperTimes& Mapper::times() const { return impl_->times; }

void Mapper::rebuild_all() {
  for (auto& [key, cell] : impl_->map.cells()) {
    if (!cell.voxels.empty()) cell.stale_since = 1;
  }
}

}  // namespace dive::planning
