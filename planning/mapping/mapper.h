#pragma once
// The mapper for unknown environments: scans of a range sensor become a map of convex pieces, 20
// times a second.
//
//   scan -> without lone points -> voxels -> normals and greedy projection triangulation (PCL)
//        -> flat convex pieces
//
// Incremental and bounded. A point on an existing piece changes nothing. Only cells that gained or
// lost points are triangulated and divided again: the nearest first, up to a number of points per
// update. Meanwhile every confirmed voxel without a surface is a ball. Voxels that a later scan
// passes through are deleted, and so are cells that were not observed for `memory_s`.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/clock.h"
#include "common/map_correction.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/mapping/mapper_options.h"
#include "planning/mapping/scan_check.h"
#include "planning/mapping/scan_result.h"
#include "planning/world/world.h"

namespace dive::planning {

/// Times of the last update; they depend on the machine.
struct MapperTimes {
  double points_ms = 0.0;       ///< Filters, voxels, deletion of what rays passed.
  double triangulate_ms = 0.0;  ///< Normals and greedy projection.
  double divide_ms = 0.0;       ///< Division into convex pieces.
  double total_ms = 0.0;
};

struct MapperStats {
  std::size_t cells = 0;
  std::size_t voxels = 0;  ///< Number of voxels, unconfirmed ones included.
  std::size_t pieces = 0;
  int taken = 0;          ///< Points of the last scan that passed the filters.
  int meshed_cells = 0;   ///< Cells divided again in the last update.
  int meshed_points = 0;  ///< Points triangulated in the last update.
  int waiting_cells = 0;  ///< Cells left for a later update.
};

/// The vehicle at the time of a scan.
struct ScanPose {
  Pose X_WB;
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();  ///< m/s
  // One sigma, for mapping beside a known map:
  double position_sigma_m = 0.0;
  double attitude_sigma = 0.0;  ///< rad, about the worst axis
  /// An obstacle in the vehicle's way. From then on what is there is mapped even where the known
  /// map has a surface: the vehicle is not where it should be, or the surface is not.
  std::optional<ObstacleAhead> ahead = {};
};

/// True if a known surface lies within `tolerance` (m) of p_W.
using IsKnown = std::function<bool(const Eigen::Vector3f& p_W, double tolerance)>;

class Mapper {
 public:
  /// Demands valid options. `clock` is for MapperTimes only: the same scans give the same map on
  /// any machine. With `is_known` it maps what a known map lacks: points within
  /// max(known_tolerance_m, three sigmas) of a known surface are left out, and a scan is not
  /// aligned with the observed map, because the known one corrects the position.
  Mapper(const RobotHull& hull, MapperOptions options, Clock& clock, IsKnown is_known = nullptr);
  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;
  ~Mapper();

  /// Adds one scan. Absent if the scan was rejected, see problem().
  [[nodiscard]] std::optional<ScanResult> add(const RangeScan& scan, const ScanPose& pose);
  [[nodiscard]] ScanProblem problem() const;

  /// Adds the points of a file: they need no confirmation, none is filtered out and no voxel is
  /// deleted. `points_W` finite. The update has everything that changed.
  [[nodiscard]] ObstacleUpdate add_cloud(std::span<const Eigen::Vector3f> points_W);

  /// After a loop closure: moves everything by the correction at the time when it was last
  /// observed. The update has all of the map. Beyond 16,384 pieces the cells that were not observed
  /// for longest are deleted. Demands a well-formed correction and an unknown environment.
  [[nodiscard]] ObstacleUpdate move(const MapCorrection& correction);

  /// Points of the map, in W: one per confirmed voxel, by cell and voxel in ascending order.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;
  [[nodiscard]] MapperStats stats() const;
  [[nodiscard]] const MapperTimes& times() const;

  /// Triangulates and divides the whole map again with the next update, up to
  /// `points_per_update`; for comparisons.
  void rebuild_all();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
