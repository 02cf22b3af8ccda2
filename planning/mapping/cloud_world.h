#pragma once
// A point cloud in a file becomes a world: the convex pieces of its surfaces.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <tl/expected.hpp>

#include "planning/cloud/cloud_file.h"
#include "planning/world/world.h"

namespace dive::planning {

struct CloudWorldOptions {
  double voxel_m = 0.14;  ///< [0.02, 2]: the mapper's, unless the cloud asks for a wider one.
  /// Voxels with points in them that there may be: what bounds time and memory.
  std::size_t max_voxels = 500'000;
  /// Where something is going to be planned, in the axes of the file, m. Empty: everywhere. Of a
  /// cloud with more than `max_voxels` voxels nothing is made outside it.
  Eigen::AlignedBox3d region;
};

struct CloudWorld {
  /// In W; obstacles are named "cloud at x, y, z", in the axes of the file.
  World world;
  /// A point p of W lies at origin + p in the file, m. Whole numbers, for coordinates in UTM to
  /// keep their digits.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// No point lies above z = 0 of the file: it is the surface, and that of W. Else there is no
  /// surface, and all of the cloud lies kNoSurface or more below z = 0 of W, which is nothing then.
  bool has_surface = true;
  Eigen::AlignedBox3d bounds_W;  ///< Of all points of the file.
  /// Outside it, points of the file are left out of `world`. Nothing: none is.
  std::optional<Eigen::AlignedBox3d> known_W;
  double voxel_m = 0.0;         ///< That was used.
  double longest_edge_m = 0.0;  ///< Points no farther from each other can be of one surface.
  std::size_t points = 0;       ///< Of the file that `world` is made of.
  std::size_t voxels = 0;
  std::vector<std::string> warnings;  ///< For people; those of the file first.
};

inline constexpr double kNoSurface = 1000.0;  ///< m

/// Every point of the cloud (that comes within `known_W`) lies in a piece: the mapper's pieces grow
/// by up to 0.3 voxels for that, and what they still miss becomes balls of that radius. Points are
/// joined to a surface over three times their usual distance from each other (0.4 m at least, 5 m
/// at most; a warning says so where it is much). An error says what is wrong: no point at all,
/// options out of range, or a cloud too wide, which a region helps against. The same cloud gives
/// the same world.
[[nodiscard]] tl::expected<CloudWorld, std::string> world_from_cloud(
    const CloudFile& cloud, const CloudWorldOptions& options);

/// Reads the file first; an error of read_cloud() is handed on.
[[nodiscard]] tl::expected<CloudWorld, std::string> world_from_cloud(
    const std::string& path, const CloudOptions& file, const CloudWorldOptions& options);

}  // namespace dive::planning
