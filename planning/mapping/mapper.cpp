#include "planning/mapping/mapper.h"

#include <algorithm>
#include <cmath>
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

constexpr std::size_t kAligned = 1500;   // points of a scan that are compared with the map
constexpr int kUnknownNeighbours = 2;    // of a point that the known map lacks
constexpr float kAroundObstacle = 1.5F;  // m from the first point in the vehicle's way
constexpr std::size_t kMaxDisputed = 64;
constexpr double kSigmas = 3.0;  // of a point's position, within which it is a known one

}  // namespace

struct Mapper::Impl {
  Impl(const RobotHull& hull, const MapperOptions& options_in, Clock& clock_in, IsKnown is_known_in)
      : clock(clock_in),
        options(options_in),
        is_known(std::move(is_known_in)),
        map(options),
        surfaces(options, clock),
        observed(hull) {}

  // False for the vehicle itself, a ray without a hit, and NaN.
  [[nodiscard]] bool is_usable(float range, const RangeScan& scan) const {
    return range >= static_cast<float>(options.min_range_m) &&
           range <= std::min(scan.reach, static_cast<float>(options.max_range_m));
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
                        options.noise.sigma(range) + static_cast<float>(options.flat_m)});
    }
    return points;
  }

  struct PlacedPoint {
    std::size_t index = 0;  ///< In the scan.
    Vector3f p_W;
  };

  // The points that are neither lone, nor marine snow, nor part of the known map.
  [[nodiscard]] std::vector<PlacedPoint> points_to_map(const RangeScan& scan,
                                                       const RangeImage& image,
                                                       const ScanPose& pose) const {
    const Eigen::Matrix3f R_WB = pose.X_WB.q.toRotationMatrix().cast<float>();
    const Vector3f p_WB = pose.X_WB.p.cast<float>();
    std::vector<PlacedPoint> points;
    for (std::size_t i = 0; i < scan.points_B.size(); ++i) {
      const float range = image.range(i);
      if (!is_usable(range, scan)) continue;
      const bool may_be_snow = range < static_cast<float>(options.snow_range_m);
      const bool is_landmark = i + scan.landmarks >= scan.points_B.size();
      const int least = may_be_snow ? options.min_snow_neighbours : options.min_neighbours;
      if (!is_landmark && image.neighbours(i) < least) continue;
      const Vector3f p_W = R_WB * scan.points_B[i] + p_WB;
      if (!is_known || is_disputed(p_W) || !is_known(p_W, tolerance(pose, range)))
        points.push_back({i, p_W});
    }
    if (is_known) leave_out_lone(scan, image, points);
    return points;
  }

  // True where the known map was wrong.
  [[nodiscard]] bool is_disputed(const Vector3f& p_W) const {
    return std::ranges::any_of(disputed_W, [&](const Vector3f& place_W) {
      return (p_W - place_W).squaredNorm() < kAroundObstacle * kAroundObstacle;
    });
  }

  void dispute(const Vector3f& place_W) {
    if (disputed_W.size() == kMaxDisputed) disputed_W.erase(disputed_W.begin());
    disputed_W.push_back(place_W);
  }

  // Of thousands of known points some lie beyond their three sigmas, each by itself.
  static void leave_out_lone(const RangeScan& scan, const RangeImage& image,
                             std::vector<PlacedPoint>& points) {
    std::vector<bool> marked(scan.points_B.size(), false);
    for (const PlacedPoint& point : points) marked[point.index] = true;
    std::erase_if(points, [&](const PlacedPoint& point) {
      return image.marked_neighbours(scan, point.index, marked) < kUnknownNeighbours;
    });
  }

  int add_points(const RangeScan& scan, const RangeImage& image, const ScanPose& pose) {
    const std::vector<PlacedPoint> points = points_to_map(scan, image, pose);
    for (const auto& [index, p_W] : points)
      map.observe(p_W, options.noise.sigma(image.range(index)));
    return static_cast<int>(points.size());
  }

  // m from a known surface within which a point belongs to it.
  [[nodiscard]] double tolerance(const ScanPose& pose, float range) const {
    const double along = static_cast<double>(options.noise.sigma(range));
    const double across = pose.attitude_sigma * static_cast<double>(range);
    const double sigma = std::hypot(pose.position_sigma_m, along, across);
    return std::max(options.known_tolerance_m, kSigmas * sigma);
  }

  // For a point of a triangle: true if recent rays passed it, so that the triangle is no surface.
  [[nodiscard]] bool is_free(const Vector3f& p_W) const {
    return observed.was_passed_recently(
        p_W, 2.0F * options.noise.sigma((p_W - sensor_origin_W).norm()) + map.grid().voxel_m());
  }

  void note(const SurfaceBuilder::Report& report) {
    stats.meshed_cells = report.meshed_cells;
    stats.meshed_points = report.meshed_points;
    stats.waiting_cells = report.waiting_cells;
    times.triangulate_ms = report.triangulate_ms;
    times.divide_ms = report.divide_ms;
  }

  ScanResult add(const RangeScan& scan, ScanPose pose) {
    Pose& X_WB = pose.X_WB;
    Eigen::Vector2f correction_W = Eigen::Vector2f::Zero();
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    map.set_time(scan.utime);
    {
      const Stopwatch points(clock, times.points_ms);
      RangeImage image(scan, X_WB);
      if (!is_known) {
        correction_W = align_to_map(points_to_align(scan, image, X_WB),
                                    [this](const Vector3f& p_W, float reach_m, float& height) {
                                      return map.nearest(p_W, reach_m, height);
                                    });
      }
      X_WB.p.head<2>() += correction_W.cast<double>();
      image.move(X_WB);
      sensor_origin_W = image.origin_W();
      if (is_known && pose.ahead) dispute((X_WB * pose.ahead->p_B).cast<float>());
      stats.taken = add_points(scan, image, pose);
      map.remove_passed(image);
      observed.add(std::move(image));
      map.forget_old();
    }
    note(surfaces.update(map, sensor_origin_W, [this](const Vector3f& p) { return is_free(p); }));
    ScanResult result{
        map.take_changes(), {scan.utime, observed.free_ahead(X_WB, pose.v_W)}, std::nullopt};
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

  ObstacleUpdate move(const MapCorrection& correction) {
    times = {};
    const Stopwatch stopwatch(clock, times.total_ms);
    map.set_time(map.time() + 1);  // later than the last update
    map.move(correction);
    observed.move(correction);
    sensor_origin_W =
        (correction.newest() * Eigen::Vector3d(sensor_origin_W.cast<double>())).cast<float>();
    note(surfaces.update_all(map, [this](const Vector3f& p) { return is_free(p); }));
    map.forget_beyond_one_move();
    return map.take_changes();
  }

  Clock& clock;
  MapperOptions options;
  IsKnown is_known;
  VoxelMap map;
  SurfaceBuilder surfaces;
  ObservedSpace observed;
  ScanCheck check;
  std::vector<Vector3f> disputed_W;  ///< Places of obstacles in the vehicle's way, m.
  Vector3f sensor_origin_W = Vector3f::Zero();
  ScanProblem problem = ScanProblem::kNone;
  MapperStats stats;
  MapperTimes times;
};

Mapper::Mapper(const RobotHull& hull, MapperOptions options, Clock& clock, IsKnown is_known) {
  DIVE_DEMAND(options.validate().empty());
  impl_ = std::make_unique<Impl>(hull, options, clock, std::move(is_known));
}
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;
Mapper::~Mapper() = default;

std::optional<ScanResult> Mapper::add(const RangeScan& scan, const ScanPose& pose) {
  impl_->problem = impl_->check.check(scan);
  if (impl_->problem != ScanProblem::kNone) return std::nullopt;
  return impl_->add(scan, pose);
}

ScanProblem Mapper::problem() const { return impl_->problem; }

ObstacleUpdate Mapper::add_cloud(std::span<const Eigen::Vector3f> points_W) {
  return impl_->add_cloud(points_W);
}

ObstacleUpdate Mapper::move(const MapCorrection& correction) {
  DIVE_DEMAND(is_well_formed(correction) && !impl_->is_known);
  return impl_->move(correction);
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
