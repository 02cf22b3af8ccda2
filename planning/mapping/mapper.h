#pragma once
// Unknown water: sweeps of a range sensor become a map of convex pieces, twenty times a second.
//
//   sweep -> lone points out -> voxels -> normals and greedy projection triangulation (PCL)
//         -> flat convex pieces
//
// Incremental and bounded. A point that lies on a piece already changes nothing; only cells that
// gained or lost points are triangulated and divided again, the nearest first and no more at a time
// than a stated number of points. Nothing waits for that: a voxel is a ball from the moment that it
// is believed until its surface has been found. What a later sweep sees through goes away; so does
// what was not seen for as long as the memory lasts.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/clock.h"
#include "common/range_scan.h"
#include "common/se3.h"
#include "planning/mapping/scan_result.h"
#include "planning/world/world.h"

namespace dive::planning {

struct MapperOptions {
  double voxel_m = 0.14;         ///< One point is kept per voxel; a cell is ten voxels wide.
  double min_range_m = 0.3;      ///< Nearer is the vehicle itself, or nothing to be steered round.
  int min_neighbours = 2;        ///< In the picture, at the same distance; fewer is a lone point.
  double snow_range_m = 3.0;     ///< So near, what drifts in the water is seen as well: ...
  int min_snow_neighbours = 5;   ///< ... a surface has more neighbours there.
  int confirm = 2;               ///< Sweeps that must see a voxel before it is believed.
  double noise_m = 0.01;         ///< One sigma of a range ...
  double noise_share = 0.005;    ///< ... and so much more of the range itself ...
  double noise_square = 0.0;     ///< ... and of its square, 1/m: a stereo pair's.
  double on_piece_m = 0.04;      ///< Plus two sigma: a point so near to a piece is of it.
  double flat_m = 0.018;         ///< FlatPieceOptions::flat_m
  double skin_m = 0.002;         ///< FlatPieceOptions::skin_m
  double ball_m = 0.03;          ///< Radius of a point that is part of no surface.
  double longest_edge_m = 0.4;   ///< TriangulationOptions::longest_edge_m
  int points_per_update = 1500;  ///< That are triangulated in one update; of one cell always all.
  double memory_s = 600.0;       ///< What was not seen for longer is forgotten ...
  int max_voxels = 500'000;      ///< ... and so is the oldest beyond that many.

  /// Empty when usable, else a sentence naming the option and its range.
  [[nodiscard]] std::string validate() const;
};

/// Why a sweep was not taken.
enum class ScanProblem {
  kNone,
  kEmpty,      ///< Not one ray told anything, or more points than a sweep may have.
  kRepeated,   ///< The same as the last one, bit for bit: the sensor is stuck.
  kBackwards,  ///< Not newer than the last one.
};

/// Of the last update; depends on the machine.
struct MapperTimes {
  double points_ms = 0.0;       ///< Filters, voxels, what is seen through.
  double triangulate_ms = 0.0;  ///< Normals and greedy projection.
  double divide_ms = 0.0;       ///< Into convex pieces.
  double total_ms = 0.0;
};

struct MapperStats {
  std::size_t cells = 0;
  std::size_t voxels = 0;  ///< Candidates included.
  std::size_t pieces = 0;
  int taken = 0;         ///< Points of the last sweep that passed the filters.
  int meshed_cells = 0;  ///< Cells divided again in the last update.
  int meshed_points = 0;
  int waiting_cells = 0;  ///< Cells to be divided in a later update.
};

class Mapper {
 public:
  /// Demands valid options. `clock` is for MapperTimes only: the same sweeps give the same map on
  /// any machine.
  Mapper(const RobotHull& hull, MapperOptions options, Clock& clock);
  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;
  ~Mapper();

  /// Takes one sweep, measured at X_WB by a vehicle that moves at v_W (m/s). Nothing when the sweep
  /// is not one of a working sensor; see problem().
  [[nodiscard]] std::optional<ScanResult> add(const RangeScan& scan, const Pose& X_WB,
                                              const Eigen::Vector3d& v_W);
  [[nodiscard]] ScanProblem problem() const;

  /// Points that are believed as they are, of a file: no lone point is left out, nothing is seen
  /// through. `points_W` finite. The update holds all that changed.
  [[nodiscard]] ObstacleUpdate add_cloud(std::span<const Eigen::Vector3f> points_W);

  /// A loop was closed: what was seen at time t was really at `correction(t)` times where it was
  /// put. The next update holds what moved.
  void move(const std::function<Pose(Utime)>& correction);

  /// Points of the map, in W: one per believed voxel, by cell and voxel in ascending order.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;
  [[nodiscard]] MapperStats stats() const;
  [[nodiscard]] const MapperTimes& times() const;

  /// Triangulates and divides the whole map again with the next update, as far as
  /// `points_per_update` allows; for comparisons.
  void rebuild_all();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dive::planning
