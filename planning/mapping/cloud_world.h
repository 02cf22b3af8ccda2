#pragma once
// Conversion of a point cloud to a world: the convex pieces of its surfaces.

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
  /// Voxel width in [0.02, 2] m: the mapper's, unless the cloud requires a larger one.
  double voxel_m = 0.14;
  /// Largest number of occupied voxels, which bounds time and memory.
  std::size_t max_voxels = 500'000;
  /// Region to plan in, in the axes of the file, m. Empty: everywhere. If the cloud has more than
  /// `max_voxels` voxels, only this region is converted.
  Eigen::AlignedBox3d region;
};

struct CloudWorld {
  /// World in W; obstacles are named "cloud at x, y, z", in the axes of the file.
  World world;
  /// Offset of W in the file, m: a point p of W lies at origin + p. Whole numbers, which keep the
  /// digits of UTM coordinates.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// True if no point lies above z = 0 of the file, which is then the surface, as in W. Otherwise
  /// there is no surface: all of the cloud lies kNoSurface or more below z = 0 of W, which then has
  /// no meaning.
  bool has_surface = true;
  Eigen::AlignedBox3d bounds_W;  ///< Bounds of all points of the file.
  /// Box outside which `world` leaves out points of the file; absent if it leaves out none.
  std::optional<Eigen::AlignedBox3d> known_W;
  double voxel_m = 0.0;         ///< Voxel width used, m.
  double longest_edge_m = 0.0;  ///< Largest distance between neighbouring points of one surface, m.
  std::size_t points = 0;       ///< Number of points of the file in `world`.
  std::size_t voxels = 0;
  std::vector<std::string> warnings;  ///< Messages for people; those of the file first.
};

inline constexpr double kNoSurface = 1000.0;  ///< m

/// Every point of the cloud (within `known_W`) lies in a piece: the mapper's pieces grow by up to
/// 0.3 voxels to cover it, and points that are still uncovered become balls of that radius. Points
/// are joined to a surface over three times their usual spacing (at least 0.4 m, at most 5 m; a
/// large value gives a warning). Errors: no points, options out of range, or a cloud too wide,
/// which needs a region. The same cloud gives the same world.
[[nodiscard]] tl::expected<CloudWorld, std::string> world_from_cloud(
    const CloudFile& cloud, const CloudWorldOptions& options);

/// Reads the file first; returns the errors of read_cloud() unchanged.
[[nodiscard]] tl::expected<CloudWorld, std::string> world_from_cloud(
    const std::string& path, const CloudOptions& file, const CloudWorldOptions& options);

}  // namespace dive::planning
