#pragma once
// Parameters of the mapper.

#include <string>

#include "common/range_noise.h"

namespace dive::planning {

struct MapperOptions {
  double voxel_m =
      0.14;  ///< Width of a voxel, m; one point is kept per voxel, 10 x 10 x 10 a cell.
  double min_range_m = 0.3;   ///< Least range used, m; nearer is the vehicle itself.
  double max_range_m = 50.0;  ///< Greatest range of a point that is mapped, m.
  /// Least number of points at about the same range around a point of a scan, else it is discarded.
  int min_neighbours = 2;
  double snow_range_m = 3.0;    ///< Range up to which marine snow is measured too, m.
  int min_snow_neighbours = 5;  ///< Replaces min_neighbours within snow_range_m.
  int confirm = 2;              ///< Number of scans that must hit a voxel before it is occupied.
  RangeNoise noise;             ///< Of the sensor.
  /// Distance from a piece, plus two standard deviations, within which a point belongs to it, m.
  double on_piece_m = 0.04;
  double flat_m = 0.018;         ///< FlatPieceOptions::flat_m
  double skin_m = 0.002;         ///< FlatPieceOptions::skin_m
  double ball_m = 0.03;          ///< Radius of the ball for a point that is part of no surface, m.
  double longest_edge_m = 0.4;   ///< TriangulationOptions::longest_edge_m
  int points_per_update = 1500;  ///< Limit of points triangulated in one update, beyond one cell.
  double known_tolerance_m =
      0.1;                   ///< Distance from a known surface of a point that is part of it, m.
  double memory_s = 600.0;   ///< Time after which a cell that is not observed is deleted, s.
  int max_voxels = 500'000;  ///< Limit of voxels; beyond it the oldest cells are deleted.

  /// A sentence with the option and its range; empty if the options are usable.
  [[nodiscard]] std::string validate() const;
};

}  // namespace dive::planning
